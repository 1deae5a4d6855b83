"""Another pace for a motion under way: the same way, inside the limits, whenever it is asked for."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.conformance.speed_scaling_check import plan_speed_override, plan_start_with_override
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError, PlanningError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint, plan_line
from rcilab.motion.speed_scaling import as_planned, require_speed_override

MODEL = load_model("xMatePro7")
WAY = np.array([1.0, 0.4, -0.5, 0.3, 0.6, 0.2, 1.2])


def joint_motion(speed: float) -> Motion:
    return plan_joint(MODEL, MODEL.home, MODEL.home + WAY, speed=speed)


def line(speed: float) -> Motion:
    T = MODEL.forward(MODEL.home)
    return plan_line(MODEL, MODEL.home, Pose(T.position + (0.1, 0.25, -0.1), T.wxyz), speed=speed)


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5, 0.75])
@pytest.mark.parametrize("plan", [joint_motion, line])
@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_held_and_gone_on_with_it_keeps_every_condition_and_arrives(plan, speed, share):
    motion = plan(speed)
    cycle = int(share * len(motion))
    held = plan_speed_override(as_planned(motion), cycle, 0.0, MODEL, "joint_position")
    if not held.is_held:  # So near to its end it arrives before it could be held.
        assert np.array_equal(held.q[-1], motion.goal)
        return
    assert np.array_equal(held.q[: cycle + 1], motion.q[: cycle + 1])
    on = plan_speed_override(held, len(held.q) + 700, 0.4, MODEL, "joint_position")
    on = plan_speed_override(on, len(held.q) + 1000, 1.0, MODEL, "joint_position")
    assert np.array_equal(on.q[-1], motion.goal)
    assert on.plan_time[-1] == motion.duration
    assert check(on.as_motion(), MODEL, distance=None).ok


def test_the_way_stays_the_same():
    motion = joint_motion(0.5)
    slow = plan_speed_override(as_planned(motion), 300, 0.5, MODEL, "joint_position")
    for row in range(0, len(slow.q) - 1, 97):
        assert slow.q[row] == pytest.approx(motion.at(float(slow.plan_time[row])).q, abs=1e-12)
    assert slow.duration > motion.duration
    assert (np.diff(slow.plan_time) >= 0.0).all()


def test_a_change_in_the_middle_of_a_change_continues_it():
    motion = joint_motion(0.1)
    slow = plan_speed_override(as_planned(motion), 1000, 0.2, MODEL, "joint_position")
    assert 0.2 < slow.rate[1030] < 1.0
    fast = plan_speed_override(slow, 1030, 1.0, MODEL, "joint_position")
    assert fast.rate[1030] == slow.rate[1030]
    assert check(fast.as_motion(), MODEL, distance=None).ok


@pytest.mark.parametrize("plan", [joint_motion, line])
def test_as_a_motion_it_has_the_velocity_and_acceleration_of_the_plan_at_its_rate(plan):
    motion = plan(0.4)
    held = plan_speed_override(
        plan_start_with_override(motion, 0.6, MODEL, "joint_position"), 150, 0.0, MODEL, "joint_position"
    )
    scaled_motion = plan_speed_override(held, len(held.q) + 20, 1.0, MODEL, "joint_position")
    run = scaled_motion.as_motion()
    assert np.array_equal(run.q, scaled_motion.q)
    for row in range(1, len(scaled_motion.q) - 1, 41):
        there, rate, drate = (
            motion.at(float(scaled_motion.plan_time[row])),
            scaled_motion.rate[row],
            scaled_motion.drate[row],
        )
        assert run.dq[row] == pytest.approx(there.dq * rate, abs=1e-12)
        assert run.ddq[row] == pytest.approx(there.ddq * rate**2 + there.dq * drate, abs=1e-9)
    assert not run.dq[-1].any()


def test_in_cartesian_modes_the_tool_is_judged_too():
    motion = line(0.6)
    held = plan_speed_override(as_planned(motion), 200, 0.0, MODEL, "cartesian_position")
    on = plan_speed_override(held, len(held.q) + 100, 1.0, MODEL, "cartesian_position")
    assert check(on.as_motion(), MODEL, distance=None, mode="cartesian_position").ok


def test_what_has_arrived_has_no_pace():
    motion = joint_motion(0.5)
    with pytest.raises(PlanningError, match="stop"):
        plan_speed_override(as_planned(motion), len(motion) + 10, 0.0, MODEL, "joint_position")


@pytest.mark.parametrize("mode", ["joint_position", "cartesian_position"])
@pytest.mark.parametrize("plan", [joint_motion, line])
@pytest.mark.parametrize("speed_override", [0.1, 0.37, 0.9])
def test_begun_at_a_pace_it_is_never_faster_and_goes_the_same_way(plan, speed_override, mode):
    motion = plan(0.4)
    slow = plan_start_with_override(motion, speed_override, MODEL, mode)
    assert slow.duration == pytest.approx(motion.duration / speed_override, abs=CYCLE_TIME)
    rates = np.abs(np.diff(slow.q, axis=0)).max(axis=0) / CYCLE_TIME
    assert (rates <= 1.0001 * speed_override * np.abs(motion.dq).max(axis=0) + 1e-6).all()
    assert np.array_equal(slow.q[0], motion.q[0])
    assert np.array_equal(slow.q[-1], motion.goal)
    for row in range(0, len(slow.q) - 1, 97):
        assert slow.q[row] == pytest.approx(motion.at(float(slow.plan_time[row])).q, abs=1e-12)
    assert check(slow.as_motion(), MODEL, distance=None, mode=mode).ok
    fast = plan_speed_override(slow, 200, 1.0, MODEL, mode)
    assert np.array_equal(fast.q[-1], motion.goal)
    assert fast.duration < slow.duration


def test_what_breaks_a_condition_at_its_pace_is_refused():
    with pytest.raises(PlanningError, match=r"torque\.rate at t = .* use another speed override"):
        plan_start_with_override(joint_motion(0.8), 0.9, MODEL, "torque")  # Nor would it be allowed as planned.


def test_nothing_asked_for_leaves_the_motion_itself():
    motion = joint_motion(0.5)
    scaled_motion = as_planned(motion)
    assert scaled_motion.as_motion() is motion
    assert plan_start_with_override(motion, 1.0, MODEL, "joint_position").as_motion() is motion
    assert scaled_motion.q is motion.q
    assert scaled_motion.plan_time_at(10) == pytest.approx(10 * CYCLE_TIME)
    assert not scaled_motion.is_held


@pytest.mark.parametrize("speed_override", [0.0, 0.05, 1.01, np.nan, "fast"])
def test_a_pace_has_a_range(speed_override):
    with pytest.raises(InvalidValueError):
        require_speed_override(speed_override)
