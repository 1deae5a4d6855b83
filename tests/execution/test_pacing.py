"""Pauses and paces of a session's motion, from another thread."""

from __future__ import annotations

import threading

import numpy as np
import pytest

import rcilab
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.motion import plan_joint
from tests.waiting import wait_for


def test_a_motion_of_a_session_runs_slowly_from_its_first_row_on():
    model = rcilab.load_model("xMate3")
    motion = plan_joint(model, model.home, model.home + np.array([0.2, 0.1, 0.0, 0.0, 0.0, 0.2]), speed=0.5)
    with rcilab.simulate(model) as robot:
        robot.power_on()
        with pytest.raises(InvalidValueError, match=r"speed.override"):
            robot.execute(motion, speed_override=0.05)
        run = robot.execute(motion, speed_override=0.25)
    assert run.has_speed_override
    assert run.plan.duration == pytest.approx(motion.duration / 0.25, abs=CYCLE_TIME)
    assert np.abs(run.plan.dq).max() < 0.26 * np.abs(motion.dq).max()
    assert np.nanmax(np.abs(run.error)) < 1e-9
    assert run.q[-1] == pytest.approx(motion.goal, abs=1e-9)


def test_a_motion_that_takes_longer_than_planned_is_recorded_from_its_first_cycle_on():
    model = rcilab.load_model("xMate3")
    motion = plan_joint(model, model.home, model.home + 0.2, speed=0.5)
    with rcilab.simulate(model) as robot:
        robot.power_on()
        run = robot.execute(motion, speed_override=0.1)
    assert not run.truncated
    assert run.t[0] == 0.0


def test_a_motion_of_a_session_is_held_and_gone_on_with():
    model = rcilab.load_model("xMate3")
    with rcilab.simulate(model) as robot:
        robot.power_on()
        with pytest.raises(UsageError, match=r"speed.override"):
            robot.pause()
        assert robot.progress is None
        motion = plan_joint(model, model.home, model.home + np.array([0.2, 0.1, 0.0, 0.0, 0.0, 0.2]), speed=0.03)
        runs: list[rcilab.Run] = []
        moved: list[float] = []
        mover = threading.Thread(
            target=lambda: runs.append(
                robot.execute(motion, progress=lambda t, duration: moved.append(t), mode="joint_impedance")
            )
        )
        mover.start()
        wait_for(lambda: moved)
        with pytest.raises(InvalidValueError, match=r"speed.override"):
            robot.set_speed_override(0.01)
        wait_for(lambda: robot.progress.plan_time > 0.05)  # It moves by then.
        before = robot.progress
        assert before is not None
        assert (before.speed_override, before.mode) == (1.0, "joint_impedance")
        assert before.duration == pytest.approx(motion.duration, abs=CYCLE_TIME)
        assert before.plan_time == pytest.approx(before.time)
        assert before.time >= moved[0]
        robot.pause()
        wait_for(lambda: not robot.state.dq_c.any())
        held = robot.progress
        assert held.speed_override == 0.0
        assert before.plan_time < held.plan_time < held.time
        wait_for(lambda: robot.progress.time > held.time)
        assert robot.progress.plan_time == held.plan_time
        robot.resume(0.7)
        wait_for(lambda: robot.progress.plan_time > held.plan_time)
        assert robot.progress.speed_override == 0.7
        mover.join(30.0)
        assert robot.progress is None
    run = runs[0]
    assert run.setup.mode == "joint_impedance"
    assert run.plan is not motion
    assert run.plan.duration > motion.duration
    assert run.plan.goal == pytest.approx(motion.goal, abs=1e-12)
    assert np.abs(run.q[-1] - motion.goal).max() < 0.02
