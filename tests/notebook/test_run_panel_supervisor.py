"""RunPanel drives what moves: a control process of its own, or a session that the notebook has."""

from __future__ import annotations

import os
import re
from contextlib import ExitStack
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import rcilab
from rcilab import notebook
from rcilab.app.goal.goal_actions import SetSpeed
from rcilab.control_process import PendingRequest, SupervisorStatus
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import PlanningError, RcilabError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.notebook.browser_heartbeat import MAX_MISSED, BrowserHeartbeat
from rcilab.notebook.browser_watchdog import PAGE_GONE
from tests.waiting import wait_for

if TYPE_CHECKING:
    from rcilab.notebook import RunPanel

PRO7 = rcilab.load_model("xMatePro7")


def phase(panel: RunPanel) -> str:
    status = panel.state.status
    return "closed" if status is None else status.phase


def power_on(panel: RunPanel) -> None:
    wait_for(lambda: phase(panel) == "idle" and not panel.power_on.disabled, what="a robot that can be powered")
    panel.power_on.click()
    wait_for(lambda: panel.state.status is not None and panel.state.status.powered, what="motor power")


def test_power_execute_stop_and_what_came_of_it_in_a_process_of_its_own() -> None:
    with notebook.RunPanel(PRO7) as panel, notebook.JogPanel(panel) as jog, notebook.FaultPanel(panel) as faults:
        assert panel.execute.disabled
        panel.connect.click()
        power_on(panel)
        assert panel.execute.disabled
        jog.q = PRO7.home + 0.1
        panel.state.ask(SetSpeed(speed=0.3))
        panel.state.make_plan()
        assert not panel.execute.disabled
        panel.execute.click()
        wait_for(lambda: panel.state.outcome is not None, what="the run")
        run = panel.state.outcome.run
        assert run is not None
        np.testing.assert_allclose(run.q[-1], jog.q, atol=1e-6)
        wait_for(lambda: "Arrived" in panel._outcome.value, what="the outcome in words")
        assert panel.execute.disabled  # The plan begins elsewhere now.

        jog.q = PRO7.home - 0.6
        panel.state.make_plan()
        panel.execute.click()
        wait_for(lambda: phase(panel) == "moving" and (panel.state.status.motion_time or 0.0) > 0.05, what="a motion")
        panel.stop.click()
        wait_for(lambda: panel.state.outcome is not None, what="the end of the motion")
        wait_for(lambda: "Stopped before its end" in panel._outcome.value, what="the outcome in words")
        status = panel.state.status
        assert status is not None
        assert status.q_c is not None
        assert np.abs(status.q_c - jog.q).max() > 0.05
        assert "rl-panels" in faults._record.value  # The flight recorder has its last cycles.
        pids = status.worker_pid, status.controller_pid
    for pid in pids:
        assert pid is not None
        assert not os.path.exists(f"/proc/{pid}")


def test_a_page_that_falls_silent_stops_the_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    heartbeat = BrowserHeartbeat()
    monkeypatch.setattr("rcilab.notebook.run_panel.kernel_heartbeat", lambda: heartbeat)
    with rcilab.simulate(PRO7) as robot, notebook.RunPanel(robot) as panel:
        power_on(panel)
        panel.state.pose(PRO7.home + 0.3)
        panel.state.ask(SetSpeed(speed=0.05))
        panel.state.make_plan()
        heartbeat._on_answer({})  # A browser was there.
        panel.execute.click()
        wait_for(lambda: phase(panel) == "moving", what="a motion")
        monkeypatch.setattr(heartbeat, "_missed", MAX_MISSED)  # And is not any more.
        wait_for(lambda: panel.state.outcome is not None, what="the run")
        run = panel.state.outcome.run
        assert run is not None
        assert run.stopped == PAGE_GONE
        wait_for(lambda: "page did not answer" in panel._outcome.value, what="why, in words")
    assert repr(robot).endswith("closed>")


def test_a_session_is_driven_in_its_own_words_and_left_open() -> None:
    with rcilab.simulate(PRO7) as robot:
        with notebook.RunPanel(robot) as panel:
            assert panel.connect.layout.display == "none"
            power_on(panel)
            panel.state.pose(PRO7.home + 0.05)
            panel.state.make_plan()
            panel.execute.click()
            wait_for(lambda: panel.state.outcome is not None, what="the run")
            with notebook.JogPanel(robot) as jog:
                assert jog.state is panel.state
        np.testing.assert_allclose(robot.state.q_c, PRO7.home + 0.05, atol=1e-9)


@pytest.mark.parametrize("own", [True, False], ids=["control_process", "session"])
def test_a_motion_is_held_gone_on_with_and_slowed_down_as_by_the_session(own: bool) -> None:
    with ExitStack() as open_things:
        robot = None if own else open_things.enter_context(rcilab.simulate(PRO7))
        panel = open_things.enter_context(notebook.RunPanel(PRO7 if robot is None else robot))
        speed_override = panel.speed_override
        if own:
            panel.connect.click()
        power_on(panel)
        assert speed_override.pause.disabled
        panel.state.pose(PRO7.home - 0.6)
        panel.state.ask(SetSpeed(speed=0.1))
        panel.state.make_plan()
        panel.execute.click()
        wait_for(lambda: not speed_override.pause.disabled, what="a motion that can be held")
        speed_override.pause.click()
        wait_for(lambda: speed_override.resume.layout.display is None, what="the arm held")
        wait_for(
            lambda: re.search(r"Paused at \d+\.\d s of the plan", speed_override._progress.value),
            what="where it is held, in words",
        )
        speed_override.field.box.value = "50"
        assert speed_override.slider.value == 50.0
        assert panel.state.status is not None
        assert panel.state.status.speed_override == 0.0  # It keeps waiting.
        speed_override.resume.click()
        wait_for(lambda: "50 %" in speed_override._progress.value, what="half the speed")
        wait_for(
            lambda: (
                (now := panel.state.status).motion_plan_time is not None
                and now.motion_plan_time < (now.motion_time or 0.0)
            ),
            what="the plan falling behind the clock",
        )
        assert speed_override.resume.layout.display == "none"
        speed_override.slider.value = 100.0
        wait_for(lambda: panel.state.status is not None and panel.state.status.speed_override == 1.0, what="all of it")
        panel.stop.click()
        wait_for(lambda: speed_override.pause.disabled, what="the end of the motion")
        wait_for(
            lambda: not speed_override._progress.value, what="the end of what is said of it"
        )  # Another thread writes it, a moment later.
        wait_for(lambda: panel.state.outcome is not None, what="the run")
        run = panel.state.outcome.run
        assert run is not None
        assert run.has_speed_override
        assert run.stop_time is not None
        assert run.tracking.joint_max.max() < 1e-6  # Against what was asked for: the hold, the pace, until the stop.
        with notebook.Timeline(panel) as timeline, notebook.MotionPlot(panel) as plot:
            assert run.plan is not None
            assert timeline.slider.max == round(1000.0 * run.plan.duration)
            timeline.moment = 1.0
            assert "left:" in plot._cursor.value
            assert panel.state.shown_scene_plan is not None
            np.testing.assert_array_equal(panel.state.shown_scene_plan.motion.at(1.0).q, run.plan.at(1.0).q)
            panel.state.make_plan()
            assert timeline.slider.max < round(1000.0 * run.plan.duration)


def test_what_cannot_be_held_any_more_goes_on_and_says_so() -> None:
    with notebook.RunPanel(PRO7) as panel:
        robot = Real(PRO7.home, phase="moving", code="moving", motion_duration=1.0, motion_plan_time=0.9)
        robot.error = PlanningError("it arrives before")
        panel._take(robot)  # type: ignore[arg-type]
        panel.speed_override.pause.click()
        wait_for(lambda: "Too late to pause" in panel.speed_override._progress.value, what="why not")
        assert robot.overrides == [0.0]
        assert "rl-problem" in panel.speed_override._progress.value


def test_a_pace_that_is_none_is_refused_below_its_field() -> None:
    with notebook.RunPanel(PRO7) as panel:
        for typed in ("5", "120", "fast", "nan"):
            panel.speed_override.field.box.value = typed
            assert "rl-problem" in panel.speed_override.field.message_box.value
            assert panel.state.now.drive.speed_override == 1.0


class Real:
    """A robot that is not virtual, as RunPanel sees it."""

    name, scaled_motion = "rci://192.168.0.160:1337", None

    def __init__(self, q: Any, **how: Any) -> None:
        self.executed: list[Any] = []
        self.overrides: list[float] = []
        self.error: RcilabError | None = None
        self._status = SupervisorStatus(**{"phase": "idle", "code": "idle", "q": q, "q_c": q, "powered": True, **how})

    def status(self) -> Any:
        return self._status

    def execute(self, motion: Any, certificate: Any, mode: str, **how: Any) -> PendingRequest:
        self.executed.append(motion)
        return PendingRequest("execute")

    def set_speed_override(self, speed_override: float) -> PendingRequest:
        self.overrides.append(speed_override)
        if self.error is not None:
            raise self.error
        return PendingRequest("pace")

    def pause(self) -> PendingRequest:
        return self.set_speed_override(0.0)

    def robot(self) -> Real:
        return self

    def drain(self) -> Any:
        return np.zeros(0, cycle_dtype(PRO7.n))

    def stop(self) -> None: ...
    def heartbeat(self) -> None: ...
    def close(self) -> None: ...


def test_after_a_start_that_failed_there_is_nothing_to_recover() -> None:
    with notebook.RunPanel(PRO7) as panel:
        panel._take(Real(PRO7.home, phase="crashed", code="crashed.slow_start"))  # type: ignore[arg-type]
        panel.state.notify("robot")
        assert panel.recover.disabled
        assert "press Disconnect, then Connect" in panel._note.value


def test_a_robot_is_moved_after_an_explicit_yes_only_and_by_no_drag() -> None:
    with notebook.RunPanel(PRO7) as panel, notebook.JogPanel(panel) as jog:
        robot = Real(PRO7.home)
        panel._take(robot)  # type: ignore[arg-type]
        jog.sliders[0].value = 20.0
        panel.state.make_plan()
        assert robot.executed == []
        panel.execute.click()
        assert robot.executed == []
        assert "192.168.0.160" in panel._question.value
        assert panel._answers.layout.display is None
        panel.no.click()
        assert panel._question.value == ""
        panel.execute.click()
        jog.sliders[0].value = 25.0
        panel.state.make_plan()  # Another plan: the question was about the one before.
        assert panel._question.value == ""
        panel.execute.click()
        panel.yes.click()
        assert len(robot.executed) == 1


def test_an_address_that_is_none_is_refused_beside_the_button() -> None:
    with notebook.RunPanel(PRO7) as panel:
        panel.target.value = "address"
        panel.connect.click()
        assert "rl-problem" in panel._sentence.value
        panel.address.value = "nonsense"
        panel.connect.click()
        assert "rl-problem" in panel._outcome.value
        assert panel.state.robot is None


@pytest.mark.parametrize("is_own", [True, False])
def test_outputs_and_inputs_are_shown_and_a_restart_is_asked_about(is_own: bool) -> None:
    with ExitStack() as stack:
        subject = PRO7 if is_own else stack.enter_context(rcilab.simulate(PRO7))
        panel = stack.enter_context(notebook.RunPanel(subject))
        if is_own:
            panel.connect.click()
        wait_for(lambda: phase(panel) == "idle", what="a robot")
        signals = panel.signals
        signals.output.value = 4
        signals.on.click()
        wait_for(
            lambda: panel.state.status.outputs[4] is True and panel.state.status.inputs == (False,) * 6, what="levels"
        )
        signals.reboot.click()
        assert phase(panel) == "idle"
        signals.yes.click()
        wait_for(lambda: phase(panel) in ("lost", "closed"), what="the end of the connection")


@pytest.mark.parametrize("is_own", [True, False], ids=["control_process", "session"])
def test_soft_limits_and_auto_limit_are_set_and_count_in_plan_and_check(is_own: bool) -> None:
    with ExitStack() as stack:
        subject = PRO7 if is_own else stack.enter_context(rcilab.simulate(PRO7))
        panel = stack.enter_context(notebook.RunPanel(subject))
        if is_own:
            panel.connect.click()
        wait_for(lambda: phase(panel) == "idle", what="a robot")
        panel.state.pose(PRO7.home + np.eye(7)[0])
        panel.state.make_plan()
        assert panel.state.now.plan.report.ok
        limits = panel.limits
        limits.folder.selected_index = 0
        limits.fields[0][1].box.value = "-200"
        assert limits.fields[0][1].problem
        limits.fields[0][1].box.value = "30"
        limits.send.click()
        wait_for(lambda: np.isclose(panel.model.limits.joint.upper[0], np.radians(30.0)), what="the limit in the model")
        wait_for(lambda: not panel.state.now.plan.report.ok, what="the plan checked anew")
        assert panel.state.status.setup.joints.upper[0] == pytest.approx(np.radians(30.0))
        assert panel.execute.disabled
        panel.state.make_plan()
        assert panel.state.now.plan is None or not panel.state.now.plan.report.ok
        with pytest.raises(RcilabError, match="joint 1"):
            panel.state.pose(PRO7.home + np.eye(7)[0])
        limits.auto.value = True
        wait_for(lambda: panel.state.now.world.auto_limit, what="auto_limit")
        if is_own:
            host, _, port = panel.state.robot.status().world_address.partition(":")
            world = stack.enter_context(SimulationControl(host, int(port)))
        else:
            world = subject.world
        wait_for(lambda: world.status().auto_limit, what="the controller")
        world.set_auto_limit(False)  # As another client does.
        wait_for(lambda: not limits.auto.value, what="the box")
        limits.whole.click()
        wait_for(lambda: panel.model.limits.joint.upper[0] == PRO7.limits.joint.upper[0], what="the whole range")
        limits.fields[0][0].box.value, limits.fields[0][1].box.value = "20", "10"
        limits.send.click()
        assert "20.0° to 10.0° is not a range" in limits.message_box.value


@pytest.mark.skipif(find_spec("xarm") is None, reason="the extra xarm is not installed")
def test_an_emergency_stop_that_is_an_error_is_recovered_from_and_foreign_settings_are_left_out() -> None:
    with ExitStack() as stack:
        panel = stack.enter_context(notebook.RunPanel(rcilab.load_model("xArm6")))
        assert panel.limits.auto not in panel.limits.folder.children[0].children
        panel.connect.click()
        power_on(panel)
        host, _, port = panel.state.robot.status().world_address.partition(":")
        world = stack.enter_context(SimulationControl(host, int(port)))
        world.press("estop")
        wait_for(lambda: phase(panel) == "fault" and panel.state.status.is_pressed, what="the stop")
        world.press("none")
        wait_for(lambda: not panel.recover.disabled, what="the way out")
        panel.recover.click()
        wait_for(lambda: phase(panel) == "idle" and panel.state.status.powered, what="a ready arm")
