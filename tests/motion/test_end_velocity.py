"""Plans keep velocity bounds that decrease towards the ends of the joints' ranges, or are refused with the reason."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.errors import PlanningError
from rcilab.model.robot_model import load_model
from rcilab.motion import Jog, Motion, Program, Waypoint, plan_joint, plan_line, plan_program
from rcilab.motion.end_velocity import end_excess

FR3 = load_model("FR3")
LIMITS = FR3.limits.joint
ZONE = (LIMITS.near_ends.offset + 1e-3) ** 2 / (2.0 * LIMITS.near_ends.deceleration)  # pyright: ignore[reportOptionalMemberAccess]


def home_but(joint: int, angle: float) -> np.ndarray:
    q = FR3.home.copy()
    q[joint] = angle
    return q


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("side", [0, 1], ids=["lower", "upper"])
def test_a_joint_motion_to_an_end_conforms_and_is_not_slower_than_needed(joint: int, side: int) -> None:
    end = (LIMITS.lower, LIMITS.upper)[side][joint]
    inwards = (1.0, -1.0)[side]
    for distance in (1.2 * ZONE[joint], ZONE[joint] + 0.02, ZONE[joint] + 0.1):
        goal = home_but(joint, end + inwards * distance)
        motion = plan_joint(FR3, FR3.home, goal, speed=1.0)
        assert (motion.goal == goal).all()
        assert check(motion, FR3, distance=None).ok
        back = plan_joint(FR3, goal, FR3.home, speed=1.0)
        assert check(back, FR3, distance=None).ok
    assert 0.99 < end_excess(LIMITS, motion.q).max() <= 1.0 or motion.duration == back.duration


def test_far_from_the_ends_nothing_is_slower() -> None:
    plain = plan_joint(FR3, FR3.home, FR3.home + 0.2, speed=1.0)
    assert end_excess(LIMITS, plain.q).max() < 0.999
    assert check(plain, FR3, distance=None).ok


@pytest.mark.parametrize("law", ["jerk_limited", "torque_rate_limited"])
def test_a_goal_where_the_arm_may_not_move_is_refused_with_the_last_angle_that_is_possible(law: str) -> None:
    goal = home_but(0, LIMITS.upper[0] - 0.5 * ZONE[0])
    with pytest.raises(
        PlanningError, match=r"joint 1: 157\.\d+° .* is too close to its limit .* beyond 157\.14°"
    ) as caught:
        plan_joint(FR3, FR3.home, goal, law=law)  # pyright: ignore[reportArgumentType]
    assert caught.value.code == "near_end"
    last = caught.value.facts["last"]
    assert check(plan_joint(FR3, FR3.home, home_but(0, last - 2e-3), speed=1.0), FR3, distance=None).ok


def test_a_joint_that_stands_there_may_stay_or_leave() -> None:
    start = home_but(0, LIMITS.upper[0] - 0.5 * ZONE[0])
    goal = start.copy()
    goal[3] += 0.3
    assert check(plan_joint(FR3, start, goal, speed=1.0), FR3, distance=None).ok
    goal[0] -= 1.0
    assert check(plan_joint(FR3, start, goal, speed=1.0), FR3, distance=None).ok


def test_a_moving_start_that_is_too_fast_towards_an_end_is_refused() -> None:
    start = home_but(4, LIMITS.upper[4] - 0.05)
    with pytest.raises(PlanningError, match="near the ends of the joints' ranges"):
        plan_joint(FR3, start, FR3.home, start_velocity=[0, 0, 0, 0, 1.2, 0, 0])


def test_a_line_of_the_tool_slows_down_near_the_end_of_a_range() -> None:
    start = np.array([2.0, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8])
    end = np.array([2.66, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8])
    motion = plan_line(FR3, start, FR3.forward(end), speed=1.0)
    assert motion.q[:, 0].max() > 2.6
    assert check(motion, FR3, mode="cartesian_position", distance=None).ok
    assert check(motion, FR3, distance=None).ok
    limited = end_excess(LIMITS, motion.q)
    assert limited.max() <= 1.0


def test_a_program_that_passes_close_to_the_end_of_a_range_conforms() -> None:
    q = home_but(5, LIMITS.upper[5] - 0.06)
    waypoints = (Waypoint.joint(q, speed=1.0, blend=0.05), Waypoint.joint(FR3.home + 0.2, speed=1.0))
    planned = plan_program(FR3, Program(model="FR3", start=FR3.home, waypoints=waypoints))
    assert planned.q[:, 5].max() > LIMITS.upper[5] - 0.2
    assert check(planned, FR3, distance=None).ok


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_jog_into_the_end_of_a_range_keeps_the_bounds_and_stops_there(joint: int, way: float) -> None:
    jog = Jog(FR3, FR3.home)
    dq = np.zeros(7)
    dq[joint] = way * LIMITS.velocity[joint]
    jog.set_joint_velocity(dq)
    rows = [jog.q, *(jog.step() for _ in range(6000))]
    assert jog.is_stationary
    end = (LIMITS.upper if way > 0.0 else LIMITS.lower)[joint]
    assert abs(rows[-1][joint] - end) < 0.05
    assert end_excess(LIMITS, np.array(rows)).max() <= 1.0 + 1e-9  # Rounding of the difference.
    assert check(Motion.from_cycles(np.array(rows)), FR3, distance=None).ok


def test_a_jog_of_the_tool_keeps_the_bounds_near_the_end_of_a_range() -> None:
    start = np.array([2.2, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8])
    jog = Jog(FR3, start)
    jog.set_twist([*(1.5 * FR3.jacobian(start)[:3, 0]), 0.0, 0.0, 0.0])
    rows = np.array([jog.q, *(jog.step() for _ in range(4000))])
    assert rows[:, 0].max() > 2.4
    assert check(Motion.from_cycles(rows), FR3, distance=None).ok


def test_a_jog_may_start_where_the_arm_may_not_move_outwards() -> None:
    jog = Jog(FR3, home_but(0, LIMITS.upper[0] - 0.5 * ZONE[0]))
    jog.set_joint_velocity([1.0, 0, 0, 0, 0, 0, 0])
    assert np.ptp([jog.step()[0] for _ in range(50)]) == 0.0
    jog.set_joint_velocity([-1.0, 0, 0, 0, 0, 0, 0])
    rows = [jog.q, *(jog.step() for _ in range(500))]
    jog.stop()
    rows += [jog.step() for _ in range(500)]
    assert rows[-1][0] < 2.6
    assert check(Motion.from_cycles(np.array(rows)), FR3, distance=None).violations == ()
