"""Signals of a program while it runs: outputs on the way, waits for inputs, blocks that end with an input."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from rcilab import Program, Waypoint, plan_program, simulate
from rcilab.core.errors import DeadlineError, UsageError
from rcilab.execution.session import RobotSession
from rcilab.makers.driver import require_signals
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")
AWAY = tuple(np.array(MODEL.home) + 0.05)
GO, BACK = Waypoint.joint(AWAY, speed=0.2), Waypoint.joint(MODEL.home, speed=0.2)


def plan(*steps: Waypoint, model=MODEL):
    return plan_program(
        model, Program(model=model.name, start=tuple(model.home), waypoints=steps), law="torque_rate_limited"
    )


@pytest.fixture(scope="module")
def shared() -> Iterator[RobotSession]:
    with simulate(MODEL) as robot:
        robot.power_on()
        yield robot


@pytest.fixture
def robot(shared: RobotSession) -> RobotSession:
    for signal in range(6):
        shared.simulation.set_input(signal, False)
        shared.set_output(signal, False)
    shared.simulation.set_loop_back(False)
    if not np.allclose(shared.state.q_c, MODEL.home, atol=1e-9):
        shared.move_j(MODEL.home, 0.8)
    return shared


def test_an_output_leaves_in_its_cycle_and_an_input_that_is_on_costs_no_time(robot, monkeypatch):
    robot.simulation.set_loop_back(True)
    motion = plan(GO, Waypoint.set_output(2), Waypoint.await_input(2), BACK, Waypoint.set_output(2, False))
    asked = []
    original = robot._driver.ask_signal

    def ask(signal, level=None):
        asked.append((signal, level, robot._streamed[0].cycle))
        return original(signal, level)

    monkeypatch.setattr(robot._driver, "ask_signal", ask)
    run = robot.execute(motion)
    outputs = [(signal, level, cycle) for signal, level, cycle in asked if level is not None]
    rows = [round(1000 * event.time) for event in motion.events if event.kind == "output"]
    assert outputs == [(2, True, rows[0] - 1), (2, False, rows[1] - 1)]  # The cycle before is the one in progress.
    assert robot.read_input(2) is False
    assert not run.faults
    assert np.nanmax(np.abs(run.tracking.joint)) < 1e-6
    assert len(run.t) - len(motion) < 50


def test_the_arm_stands_until_the_input_comes_and_the_run_shows_it(robot):
    motion = plan(GO, Waypoint.await_input(1, timeout=60.0), BACK)
    done = threading.Event()

    def press() -> None:
        while robot.progress is None or robot.progress.plan_time < motion.events[0].time - 1e-3:
            if done.wait(1e-3):
                return
        time.sleep(0.1)
        robot.simulation.set_input(1, True)

    helper = threading.Thread(target=press)
    helper.start()
    try:
        run = robot.execute(motion)
    finally:
        done.set()
        helper.join()
    waited = len(run.t) - len(motion)
    assert waited > 50
    assert run.plan is not None
    assert run.plan.duration == pytest.approx(motion.duration + 1e-3 * waited, abs=0.05)
    assert np.nanmax(np.abs(run.tracking.joint)) < 1e-6
    assert np.allclose(run.q_c[-1], MODEL.home, atol=1e-6)


@pytest.mark.parametrize("mode", ["joint_position", "cartesian_position", "torque"])
def test_an_input_that_does_not_come_ends_the_program_in_words(robot, mode):
    motion = plan(GO, Waypoint.await_input(4, timeout=0.2), BACK)
    with pytest.raises(DeadlineError, match=r"step 2: input DI1_0 was not on within 0\.2 s") as failure:
        robot.execute(motion, mode=mode)
    assert failure.value.code == "input_not_on"
    assert np.allclose(robot.state.q, AWAY, atol=0.02)
    robot.move_j(MODEL.home, 0.8)


def test_a_program_may_begin_with_a_wait(robot):
    with pytest.raises(DeadlineError, match=r"step 1: input DI0_1 was not on within 0\.1 s"):
        robot.execute(plan(Waypoint.await_input(1, timeout=0.1), GO))
    assert np.allclose(robot.state.q_c, MODEL.home, atol=1e-6)


@pytest.mark.parametrize("level", [True, False])
def test_a_block_ends_with_its_input(robot, level):
    robot.simulation.set_input(0, level)
    steps = (Waypoint.repeat(3, until=0, level=True), GO, BACK, Waypoint.end(), Waypoint.set_output(5))
    if level:
        run = robot.execute(plan(*steps))
        robot.simulation.set_loop_back(True)
        assert len(run.t) == pytest.approx(len(plan(GO, BACK)), abs=200)
        assert robot.read_input(5)
    else:
        with pytest.raises(DeadlineError, match="step 1: input DI0_0 was not on within 0 s"):
            robot.execute(plan(*steps))


def test_a_pause_and_another_speed_keep_the_signals_in_their_places(robot):
    robot.simulation.set_loop_back(True)
    motion = plan(GO, Waypoint.set_output(0), Waypoint.await_input(0), BACK, Waypoint.set_output(1))
    changes = iter((lambda: robot.set_speed_override(0.3), robot.pause, robot.resume))
    due = iter((0.1, 0.3, 0.3))
    following = [next(due)]

    def change(t: float, duration: float) -> None:
        if following and robot.progress is not None and robot.progress.plan_time >= following[0]:
            following.clear()
            threading.Thread(target=_change).start()

    def _change() -> None:
        for act in changes:
            try:
                act()
            except UsageError:  # It has ended.
                return
            time.sleep(0.05)

    run = robot.execute(motion, progress=change)
    assert run.has_speed_override
    assert robot.read_input(0)
    assert robot.read_input(1)
    assert np.nanmax(np.abs(run.tracking.joint)) < 1e-6


def test_signals_that_a_controller_lacks_are_refused_before_anything_moves(robot):
    with pytest.raises(UsageError, match=r"step 2: output 9 of xMatePro7 does not exist; there are outputs 0 to 5"):
        robot.execute(plan(GO, Waypoint.set_output(9)))
    franka = load_model("FR3")
    step = Waypoint.joint(tuple(np.array(franka.home) + 0.05))
    motion = plan(step, Waypoint.set_output(0), model=franka)

    with pytest.raises(UsageError, match="its interface has no digital outputs"):
        require_signals(motion.events, franka)
