"""A cell moves the arm of a session while RunPanel shows it: what is seen meanwhile, what stops it, what is left."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import rcilab
from rcilab import notebook
from rcilab.core.errors import ControlError
from tests.waiting import wait_for

if TYPE_CHECKING:
    from rcilab.execution.session import RobotSession
    from rcilab.notebook import RunPanel

PRO7 = rcilab.load_model("xMatePro7")


@pytest.fixture(scope="module")
def robot() -> Iterator[RobotSession]:
    with rcilab.simulate(PRO7) as session:
        session.power_on()
        yield session


@pytest.fixture
def panel(robot: RobotSession) -> Iterator[RunPanel]:
    with notebook.RunPanel(robot) as made:
        wait_for(lambda: made.state.status is not None and made.state.status.phase == "idle", what="the robot")
        yield made


class Cell:
    """What the cell does, in a thread of its own as the kernel has one for cells."""

    def __init__(self, act: Callable[[], Any]) -> None:
        self.value: Any = None
        self._act = act
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def _work(self) -> None:
        try:
            self.value = self._act()
        except rcilab.RcilabError as error:
            self.value = error

    def end(self) -> Any:
        self._thread.join(30.0)
        return self.value


def execute(robot: RobotSession) -> Cell:
    sign = -1.0 if robot.state.q_c[0] > 0.0 else 1.0
    motion = rcilab.plan_joint(PRO7, robot.state.q_c, PRO7.home + 0.5 * sign, speed=0.01)  # Far longer than the test.
    return Cell(lambda: robot.execute(motion))


def sway(robot: RobotSession, until: float, jump: float = 0.0) -> Any:
    first = robot.state.q_c

    def callback(state: object, t: float) -> Any:
        q = first + 0.02 * (1.0 - np.cos(t)) + (jump if t > 0.3 else 0.0)
        return rcilab.JointPosition(q=q, finished=t >= until)

    return robot.control(callback)


def test_a_motion_of_a_cell_is_shown_and_stopped_and_its_recording_is_there(
    robot: RobotSession, panel: RunPanel
) -> None:
    with notebook.MotionPlot(panel) as plot, notebook.Timeline(panel) as timeline:
        panel.state.pose(robot.state.q_c + 0.1)
        panel.state.make_plan()
        planned = panel.state.now.plan
        assert planned is not None
        wait_for(lambda: not panel.execute.disabled, what="Execute")
        cell = execute(robot)
        wait_for(lambda: "A cell moves the arm" in panel._note.value and panel.progress.value > 0.0, what="the motion")
        assert panel.progress.layout.visibility == "visible"
        assert panel.execute.disabled
        panel._on_execute()  # A press that was on its way.
        assert "The arm is moving" in panel._sentence.value
        panel.stop.click()
        run = cell.end()
        assert run.stopped == "on request"
        wait_for(lambda: panel.state.outcome is not None, what="the recording")
        wait_for(lambda: "Stopped before its end" in panel._outcome.value, what="the outcome in words")
        assert "A cell moved the arm" in panel._outcome.value
        assert panel.state.outcome.run is run
        assert panel.state.now.plan is planned  # The person's own is still there.
        assert "rl-panels" in plot.html
        assert timeline.slider.max == round(1000.0 * run.plan.duration)
        panel.state.pose(robot.state.q_c)
        assert timeline.slider.max == round(1000.0 * planned.motion.duration)
        assert panel.state.shown_run is None  # The run of the cell does not belong to this plan.


def test_a_motion_of_a_cell_is_held_and_goes_on_from_the_panel(robot: RobotSession, panel: RunPanel) -> None:
    cell = execute(robot)
    wait_for(lambda: not panel.speed_override.pause.disabled, what="a motion that can be held")
    panel.speed_override.pause.click()
    wait_for(lambda: panel.speed_override.resume.layout.display is None, what="the arm held")
    panel.speed_override.resume.click()
    wait_for(lambda: panel.speed_override.pause.layout.display is None, what="the arm on its way again")
    panel.stop.click()
    assert cell.end().stopped == "on request"


def test_a_callback_of_a_cell_is_shown_as_moving_without_an_end_that_nobody_knows(
    robot: RobotSession, panel: RunPanel
) -> None:
    cell = Cell(lambda: sway(robot, until=60.0))
    wait_for(lambda: "A cell moves the arm" in panel._note.value, what="the motion")
    assert panel.progress.layout.visibility == "hidden"
    assert panel.speed_override.pause.disabled
    assert panel.execute.disabled
    time.sleep(0.1)
    panel.stop.click()
    run = cell.end()
    assert run.stopped == "on request"
    wait_for(lambda: (ended := panel.state.outcome) is not None and ended.run is run, what="the recording")
    seen = panel.state.shown_plan
    assert seen is not None
    np.testing.assert_allclose(seen.motion.q[0], run.command[0], atol=1e-9)
    assert run.plan is None


def test_a_fault_in_a_cell_is_told_and_its_last_cycles_are_kept(robot: RobotSession, panel: RunPanel) -> None:
    with notebook.FaultPanel(panel) as faults:
        error = Cell(lambda: sway(robot, until=5.0, jump=0.1)).end()
        assert isinstance(error, ControlError)
        wait_for(lambda: "The controller stopped the arm" in panel._outcome.value, what="the outcome in words")
        assert panel.state.outcome.error is error
        assert "rl-panels" in faults._record.value
    robot.recover()


def test_a_stop_pressed_while_a_motion_is_still_checked_keeps_the_arm_where_it_is(
    robot: RobotSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = robot.state.q_c
    motion = rcilab.plan_joint(PRO7, before, before + 0.1, speed=0.3)
    monkeypatch.setattr(robot, "_require_allowed", lambda *_: robot.stop())
    run = robot.execute(motion)
    assert run.stopped == "on request"
    np.testing.assert_array_equal(robot.state.q_c, before)
    monkeypatch.undo()
    assert robot.execute(motion).stopped is None  # It was for that motion only.


def test_a_session_that_is_closed_is_told_to_be() -> None:
    with rcilab.simulate(PRO7) as robot, notebook.RunPanel(robot) as panel:
        robot.close()
        wait_for(lambda: "The session was closed" in panel._note.value, what="the words")
        assert panel.execute.disabled
