"""What an arm lacks is not on the page and in the notebook, and refused with the reason."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import ipywidgets
import pytest

from rcilab.app.arm_features import explain_missing_feature, explain_missing_part
from rcilab.app.goal.goal import POSE_FIELDS, goal_at
from rcilab.app.request import TypeField
from rcilab.app.run.run_actions import ChooseRobot, RunActions
from rcilab.app.setup.configuration_state import pending_parts
from rcilab.app.setup.setup_actions import MoveSetup, PressSetup, SetSetup, SetupActions
from rcilab.app.setup.setup_fields import FACE_NAMES
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store, UiState
from rcilab.app.text import Text
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import InvalidValueError, ModelError
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Text as NotebookText
from rcilab.makers.configuration import RobotConfiguration, SoftJointLimits
from rcilab.makers.maker import maker_of, require_parts
from rcilab.model.robot_model import load_model
from rcilab.notebook.limit_fields import LimitFields
from rcilab.notebook.run_panel import RunPanel as RunPart
from rcilab.notebook.signal_fields import SignalFields
from rcilab.workbench.panels.fault_injection import FaultInjectionPanel
from rcilab.workbench.panels.mode import ModePanel
from rcilab.workbench.panels.push import PushPanel
from rcilab.workbench.panels.run import RunPanel
from rcilab.workbench.panels.setup import SetupPanel
from rcilab.workbench.panels.setup_numbers import SetupNumbersPanel
from rcilab.workbench.panels.signals import SignalsPanel, levels_html
from rcilab.workbench.panels.soft_limits import SoftLimitsPanel

MODEL = load_model("xMate3")
READY = SupervisorStatus(phase="idle", code="idle", world_address="127.0.0.1:1")


@pytest.fixture
def lacking(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    maker = maker_of(MODEL)
    assert maker is not None

    def lack(**changes: object) -> None:
        monkeypatch.setattr(type(maker), "capabilities", replace(maker.capabilities, **changes))

    return lack


@pytest.fixture
def store() -> Store:
    return Store(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home)))


def gui() -> MagicMock:
    """A page whose every control is another object."""

    def build(*_: object, **__: object) -> MagicMock:
        return MagicMock(value="")

    names = ("add_text", "add_button", "add_checkbox", "add_dropdown", "add_html", "add_folder", "add_slider")
    return MagicMock(**{f"{name}.side_effect": build for name in names})


def disabled(handle: Any) -> bool:
    return handle.disabled is True


def test_the_setup_tab_has_the_parts_that_the_arm_has(lacking, store) -> None:
    lacking(setup=("tool", "load", "control"))
    text = Text("en")
    numbers, setup = (panel(text, lambda request: None) for panel in (SetupNumbersPanel, SetupPanel))
    for panel in (numbers, setup):
        panel.build(gui(), store.state)
        panel.show(store.state, READY)
    assert set(numbers._folders) == {"tool", "load"}
    assert set(setup._choices) == {"", "tool", "load"}
    table = setup._table_html(store.state, READY)
    assert "safety box" not in table
    assert "<th>tool</th>" in table
    assert "<th>Joint stiffness</th>" in table
    assert text("setup.in_mode") in table


def test_groups_of_what_an_arm_lacks_are_not_there(lacking, store) -> None:
    kinds = (SoftLimitsPanel, SignalsPanel, PushPanel, RunPanel, FaultInjectionPanel)

    def labels() -> set[str]:
        page, text = gui(), Text("en")
        for panel in (kind(text, lambda request: None) for kind in kinds):
            panel.build(page, store.state)
            panel.show(store.state, READY)
        return {call.args[0] for control in (page.add_folder, page.add_button) for call in control.call_args_list}

    things = {
        "Soft joint limits [deg]",
        "At a soft limit",
        "Digital outputs and inputs",
        "Restart the controller",
        "Guide by hand",
        "Power on",
        "Power off",
        "Open the gate",
    }
    assert things <= labels()
    lacking(setup=("tool",), outputs=(), inputs=(), reboots=False, guides=False, switches_power=False, has_gate=False)
    assert not things & labels()
    assert "Recover" in labels()


def test_parameters_of_the_modes_are_off_with_the_reason(lacking, store) -> None:
    text = Text("zh")
    mode = ModePanel(text, lambda request: None)
    mode.build(gui(), store.state)
    mode.show(store.state, READY)
    assert not disabled(mode._reset)
    lacking(setup=("tool",))
    mode.show(store.state, READY)
    assert disabled(mode._reset)
    lack = explain_missing_feature(MODEL, "control")
    assert lack is not None
    assert text.render(lack) in mode._missing._shown


def test_the_signals_are_those_of_the_maker(lacking) -> None:
    lacking(outputs=("CO0",), inputs=("CI0", "CI1"))
    status = replace(READY, outputs=(True,), inputs=(False, True))
    shown = levels_html(MODEL, status, Text("en"))
    assert "<tr><th>CO0</th><td>On</td><th>CI0</th><td>Off</td></tr>" in shown
    assert "<tr><th></th><td>—</td><th>CI1</th><td>On</td></tr>" in shown


def test_a_part_that_is_lacking_cannot_be_edited_restored_or_sent(lacking, store) -> None:
    lacking(setup=("tool", "load"))
    actions = SetupActions(store, SimpleNamespace(status=lambda: READY))
    before = store.state.setup.wanted
    assert before.box is not None
    actions.set_setup(SetSetup(name="edited", value="box"))
    assert "box" not in store.state.setup.seen  # It has no handles in the scene.
    actions.set_setup(SetSetup(name="active", value=True))
    actions.set_setup(SetSetup(name="box", value=True))
    actions.press(PressSetup(what="whole"))
    actions.type_field(TypeField(field="setup.box.xmax", text="500"))
    actions.type_field(TypeField(field="setup.joints.lower.0", text="-90"))
    assert set(store.state.problems) == {"setup.box.xmax", "setup.joints.lower.0"}
    actions.restore(RobotConfiguration(box=before.box, tool=MODEL.T_flange_tool))
    setup = store.state.setup
    assert setup.touched == {"tool"}
    assert setup.seen == {"tool"}
    assert (setup.wanted.box, setup.wanted.force) == (before.box, before.force)
    assert pending_parts(store.state, READY) == ("tool",)
    with pytest.raises(ModelError, match="xMate3 has no soft joint limits"):
        require_parts(MODEL, RobotConfiguration(joints=SoftJointLimits(lower=(0.0,), upper=(1.0,))))


def test_a_box_that_cannot_be_turned_has_no_angles_and_is_refused_with_a_turn(lacking, store) -> None:
    lacking(turns_box=False)
    numbers, actions = SetupNumbersPanel(Text("en"), print), SetupActions(store, SimpleNamespace(status=lambda: READY))
    numbers.build(gui(), store.state)
    assert set(numbers._fields["box"]) == set(FACE_NAMES)
    assert set(numbers._fields["tool"]) == set(POSE_FIELDS)
    before = store.state.setup.wanted
    actions.type_field(TypeField(field="setup.box.yaw", text="30"))
    assert store.state.setup.wanted is before
    actions.set_setup(SetSetup(name="edited", value="box"))
    actions.move(MoveSetup(part="box", position=(0.1, 0.0, 0.6), wxyz=(0.8, 0.0, 0.0, 0.6)))
    box = store.state.setup.wanted.box
    assert box is not None
    assert box.T_base_box.is_close(Pose((0.1, 0.0, 0.6)), 1e-12)
    turned = replace(box, T_base_box=Pose.from_rpy((0.1, 0.0, 0.6), (0.0, 0.0, math.radians(30.0))))
    with pytest.raises(
        InvalidValueError, match=r"must be 0 deg.*got \[0\.0, 0\.0, 30\.0\]; leave the turn out"
    ) as refusal:
        require_parts(MODEL, RobotConfiguration(box=turned))
    for language, sentence in (("en", "(roll, pitch, yaw: 0, 0, 30°)"), ("zh", "请将这三个角度设为 0")):
        assert sentence in Text(language).render(explain_error(refusal.value))


def test_an_arm_that_is_only_planned_for_keeps_its_setup(store, only_planned) -> None:
    panda = load_model(only_planned)
    for part in ("box", "tool", "load", "joints"):
        assert explain_missing_part(panda, part) is None


def test_in_the_notebook_signals_restart_soft_limits_and_power_are_not_there(lacking) -> None:
    lacking(setup=("tool",), outputs=(), inputs=(), reboots=False, switches_power=False)
    text = NotebookText("en", "rcilab.notebook")
    signals = SignalFields(MODEL, text, MagicMock(), lambda *_, **__: ipywidgets.Button())
    signals.show(READY)
    assert signals.folder.layout.display == "none"
    state = SimpleNamespace(model=MODEL, status=READY, robot=None, now=SimpleNamespace(is_virtual=True))
    limits = LimitFields(state, text, MagicMock(), MagicMock(), lambda *_, **__: ipywidgets.Button())
    limits.show(READY)
    assert limits.folder.layout.display == "none"
    panel = RunPart(MODEL)
    rows = [row.children for row in panel.widget.children if isinstance(row, ipywidgets.HBox)]
    assert (panel.recover,) in rows
    assert not any(panel.power_off in row for row in rows)
    panel.close()


def test_an_arm_of_another_maker_is_not_sought_at_the_address_of_the_last_one() -> None:
    address = "fci://127.0.0.9"
    model = load_model("FR3")
    for name, target in (("Panda", address), ("xMate3", "virtual")):
        shown = Store(UiState(model=model, goal=goal_at(model, model.home), target=address))
        connection = MagicMock()
        connection.status.return_value = READY
        RunActions(shown, connection).choose_robot(ChooseRobot(model=name))
        assert (shown.state.model.name, shown.state.target) == (name, target)
        assert connection.open.call_args.args[1] == target
