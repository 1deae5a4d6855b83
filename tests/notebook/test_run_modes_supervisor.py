"""The five modes and their parameters on RunPanel: typed, acknowledged, and the arm follows in them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import rcilab
from rcilab import notebook
from rcilab.app.goal.goal_actions import SetSpeed
from rcilab.app.session_connection import BusyError
from rcilab.control_process import PendingRequest, SupervisorStatus
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.state import MODES
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.translator import Text
from rcilab.makers.configuration import ControllerParameters, RobotConfiguration
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import default_parameters
from rcilab.notebook import status_texts
from tests.waiting import wait_for

if TYPE_CHECKING:
    from rcilab.notebook import RunPanel

PRO7 = rcilab.load_model("xMatePro7")


def text_of(widget: Any) -> str:
    return re.sub(r"<[^>]*>", "", widget.value)


def held(panel: RunPanel) -> ControllerParameters | None:
    status = panel.state.status
    return None if status is None else status.setup.control


def run_in(panel: RunPanel, mode: str, speed: float, way: float) -> Any:
    panel.modes.mode.value = mode
    panel.state.ask(SetSpeed(speed=speed))
    panel.state.pose(panel.state.here + way)
    panel.state.make_plan()
    plan = panel.state.now.plan
    assert plan is not None
    assert plan.mode == mode
    panel.execute.click()
    return wait_for(lambda: panel.state.outcome, 30.0, "the run").run


def test_a_parameter_is_typed_acknowledged_and_the_arm_follows_in_its_mode() -> None:
    with notebook.RunPanel(PRO7) as panel:
        assert [name for _, name in panel.modes.mode.options] == list(MODES)
        panel.connect.click()
        wait_for(lambda: not panel.power_on.disabled, 30.0, "a robot that can be powered")
        panel.power_on.click()
        wait_for(lambda: panel.state.status is not None and panel.state.status.powered, 30.0, "motor power")
        assert panel.modes.folders["joint_stiffness"].layout.display == "none"
        panel.modes.mode.value = "joint_impedance"
        field = panel.modes.fields["joint_stiffness"][2]  # The folder of the mode is open.
        assert field.box.value == "3000"
        field.box.value = "30000"
        assert "outside 0" in text_of(field.message_box)
        field.box.value = "1234 N·m/rad"
        wait_for(lambda: (told := held(panel)) is not None and told["joint_stiffness"][2] == 1234.0, 30.0, "the answer")
        run = run_in(panel, "joint_impedance", 0.5, 0.05)
        assert run.setup.mode == "joint_impedance"
        assert "1234" in text_of(panel.modes._held)
        panel.modes.reset.click()
        wait_for(lambda: held(panel) == default_parameters(parameters_of(PRO7)), 30.0, "the defaults")
        assert field.box.value == "3000"


def test_a_session_is_told_only_what_was_typed_and_is_driven_in_every_mode() -> None:
    with rcilab.simulate(PRO7) as robot, notebook.RunPanel(robot) as panel:
        robot.power_on()
        panel.modes.mode.value = "cartesian_impedance"
        panel.modes.folders["desired_wrench"].selected_index = 0
        panel.modes.fields["desired_wrench"][2].box.value = "-1"
        wait_for(lambda: held(panel) is not None, 30.0, "the answer")
        assert held(panel) == ControllerParameters(desired_wrench=(0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
        assert "its own value, which cannot be read" in text_of(panel.modes._held)
        panel.modes.fields["desired_wrench"][2].box.value = "0"
        wait_for(lambda: held(panel) == ControllerParameters(desired_wrench=(0.0,) * 6), 30.0, "the answer")
        wait_for(lambda: panel.state.status is not None and panel.state.status.powered, 30.0, "motor power")
        for mode, speed in (("cartesian_position", 0.1), ("torque", 0.03)):
            run = run_in(panel, mode, speed, 0.01)
            assert run.setup.mode == mode
            assert not run.stopped
            np.testing.assert_allclose(run.q[-1], panel.state.now.goal.q, atol=5e-3)  # Torques lead it there softly.


class Real:
    """A robot that is not virtual, as RunPanel sees it."""

    name, scaled_motion = "rci://192.168.0.160:1337", None

    def __init__(self) -> None:
        self.told: list[ControllerParameters] = []
        q = PRO7.home
        self._status = SupervisorStatus(phase="idle", code="idle", q=q, q_c=q, powered=True)

    def status(self) -> SupervisorStatus:
        return self._status

    def configure(self, setup: RobotConfiguration) -> PendingRequest:
        assert setup.control is not None
        self.told.append(setup.control)
        return PendingRequest("control")

    def robot(self) -> Real:
        return self

    def drain(self) -> Any:
        return np.zeros(0, cycle_dtype(PRO7.n))

    def stop(self) -> None: ...
    def heartbeat(self) -> None: ...
    def close(self) -> None: ...


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_robot_is_told_parameters_after_a_second_press_only(language: str) -> None:
    text = Text(language, "rcilab.notebook")
    with notebook.RunPanel(PRO7, language=language) as panel:
        robot = Real()
        panel._take(robot)  # type: ignore[arg-type]
        panel.state.pose(PRO7.home + 0.1)
        panel.state.make_plan()
        panel.modes.mode.value = "joint_impedance"
        assert not panel.execute.disabled
        panel.modes.fields["joint_stiffness"][0].box.value = "500"
        assert panel.execute.disabled
        assert text("ready.control_unsent", address=robot.name) in text_of(panel._note)
        panel.modes.send.click()
        assert robot.told == []
        assert robot.name in text_of(panel.modes._sentence)
        panel.modes.send.click()
        stiffness = default_parameters(parameters_of(PRO7))["joint_stiffness"]
        assert [told["joint_stiffness"] for told in robot.told] == [(500.0, *stiffness[1:])]


def test_refusals_are_told_in_the_language_of_the_panel(only_planned: str) -> None:
    from rcilab.core.errors import CommandRejectedError, InvalidValueError
    from rcilab.makers.rokae import wire as rci

    kinds = (rci.SettingStatus, rci.StartStatus, rci.StopStatus, rci.RecoveryStatus, rci.GuideStatus)
    statuses = [status for kind in kinds for status in kind if status.name not in ("SUCCESS", "MOTION_STARTED")]
    errors = [CommandRejectedError("StartMove", status) for status in statuses]
    errors += [BusyError("power_on", what) for what in ("execute", "control", "power_on", "power_off", "recover")]
    errors += [InvalidValueError("address", "robot", "is not a valid address")]
    for language in LANGUAGES:
        text = Text(language, "rcilab.notebook")
        for error in errors:
            said = text.render(status_texts.describe_refusal(error))
            assert str(error) not in said
            assert not re.search(r"\b(status|what|error|robot)\.[a-zA-Z_]+", said), said
    with notebook.RunPanel(rcilab.load_model(only_planned), language="zh") as panel:
        panel.connect.click()
        assert "Franka" in text_of(panel._outcome)
        assert "plan for it" not in text_of(panel._outcome)


def test_every_mode_has_words_and_every_part_a_name() -> None:
    for language in LANGUAGES:
        text = Text(language, "rcilab.notebook")
        assert all(text.has(f"mode.{mode}") and text.has(f"mode.{mode}_note") for mode in MODES)
        assert all(text.has(f"control.{group.name}") for group in parameters_of(PRO7))
