"""Velocity bounds that decrease towards the ends of the joints' ranges, as the FR3 has them."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.conformance.joint_monitor import JointMonitor
from rcilab.conformance.motion_monitor import Monitor
from rcilab.conformance.start import StartState
from rcilab.core.command import JointPosition
from rcilab.makers.franka.conditions import FR3_CONDITIONS
from rcilab.makers.franka.errors import FrankaError
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion

FR3 = load_model("FR3")
LIMITS = FR3.limits.joint
ROWS = FR3_CONDITIONS.motion[:4]


def test_the_bounds_are_those_of_the_makers_formula() -> None:
    down, up = LIMITS.velocity_bounds(np.array([2.70, 0.0, -2.90, -0.3, 2.0, 0.6, -3.0]))
    assert up[0] == pytest.approx(-0.30 + sqrt(12.0 * (2.7501 - 2.70)), abs=1e-12)
    assert down[0] == -2.62
    assert down[2] == pytest.approx(0.20 - sqrt(7.0 * (-2.90 + 2.9065)), abs=1e-12)
    assert up[3] == pytest.approx(-0.30 + sqrt(8.0 * (-0.1458 + 0.3)), abs=1e-12)
    assert down[5] == pytest.approx(0.35 - sqrt(11.0 * (0.6 - 0.54092)), abs=1e-12)
    assert (up[[1, 4, 6]] == [2.62, -0.35 + sqrt(34.0 * (2.8101 - 2.0)), 5.26]).all()


def documented(q: np.ndarray) -> np.ndarray:
    """Returns the bounds of the page, max(0, sqrt(2 a d) - offset) towards both ends, shape (2, 7)."""
    offset = np.array([0.30, 0.20, 0.20, 0.30, 0.35, 0.35, 0.35])
    twice = 2.0 * np.array([6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0])
    distance = np.stack((q - LIMITS.lower, LIMITS.upper - q))
    return np.minimum(LIMITS.velocity, np.maximum(0.0, np.sqrt(twice * distance) - offset))


@pytest.mark.parametrize("seed", range(20))
def test_what_is_checked_is_the_makers_formula_and_at_least_the_rounding_of_the_state(seed: int) -> None:
    rng = np.random.default_rng(seed)
    near = rng.choice([1e-4, 1e-2, 0.1, 1.0], 7) * rng.uniform(0.0, 1.0, 7)
    q = np.where(rng.random(7) < 0.5, LIMITS.lower + near, LIMITS.upper - near)
    down, up = documented(q)
    assert np.array(LIMITS.velocity_bounds(q)) == pytest.approx(np.stack((-down, up)), abs=1e-12)
    rounding = np.array([1.2e-4, 6e-5, 1.2e-4, 1.2e-4, 1.2e-4, 2.4e-4, 1.2e-4])
    monitor = JointMonitor(LIMITS, ROWS)
    for share, is_allowed in ((0.999, True), (1.001, False)):
        for velocity in (np.maximum(up, rounding) * share, np.minimum(-down, -rounding) * share):
            monitor.reset(q.tolist(), velocity.tolist())
            found = {v.axis for v in monitor.step((q + 0.001 * velocity).tolist()) if v.condition is ROWS[1]}
            assert found == (set() if is_allowed else set(range(1, 8)))


def test_a_joint_at_the_end_of_its_range_may_stand_and_move_away() -> None:
    down, up = LIMITS.velocity_bounds(LIMITS.upper - 1e-3)
    assert (up == 0.0).all()
    assert (down == -LIMITS.velocity).all()
    q = np.repeat((LIMITS.upper - 1e-3)[np.newaxis], 50, axis=0)
    assert check(Motion.from_cycles(q), FR3, distance=None).ok
    q[1:] += np.spacing(q[0].astype(np.float32)) / 2.0  # As a client that has the angles from the state.
    assert "joint.velocity" not in {v.condition.id for v in check(Motion.from_cycles(q), FR3, distance=None).violations}
    q[2:] += 4e-7
    assert "joint.velocity" in {v.condition.id for v in check(Motion.from_cycles(q), FR3, distance=None).violations}


def test_other_arms_have_the_same_bound_everywhere() -> None:
    limits = load_model("Panda").limits.joint
    down, up = limits.velocity_bounds(np.stack((limits.upper, limits.lower)))
    assert (up == limits.velocity).all()
    assert (down == -limits.velocity).all()


def test_soft_limits_do_not_move_the_end_of_the_range() -> None:
    soft = FR3.with_joint_limits(0.5 * LIMITS.lower + 0.5 * LIMITS.upper - 0.4, LIMITS.upper - 0.5).limits.joint
    q = LIMITS.upper - 0.6
    assert (soft.velocity_bounds(q)[1] == LIMITS.velocity_bounds(q)[1]).all()


def motion_towards(joint: int, end: float, velocity: float) -> Motion:
    """Returns 40 rows at constant velocity that end at an angle of a joint, numbered from 0."""
    q = np.repeat(FR3.home[np.newaxis], 40, axis=0)
    q[:, joint] = end - velocity * 0.001 * np.arange(39.0, -1.0, -1.0)
    return Motion.from_cycles(q)


def test_the_violation_has_the_bound_at_the_last_command() -> None:
    motion = motion_towards(0, 2.70, 0.6)
    start = StartState(motion.start, np.array([0.6, *[0.0] * 6]), np.zeros(7))
    report = check(motion, FR3, start=start, distance=None)
    (found,) = [v for v in report.violations if v.condition.id == "joint.velocity"]
    assert found.fault is FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION
    bound = LIMITS.velocity_bounds(motion.q[-2])[1][0]
    assert (found.joint, found.bound, found.value) == (1, bound, pytest.approx(0.6))
    assert found.ratio == pytest.approx(0.6 / bound)


def test_a_commanded_angle_out_of_range_raises_the_error_of_a_measured_one() -> None:
    q = np.repeat(FR3.home[np.newaxis], 5, axis=0)
    q[:, 1] = LIMITS.upper[1]
    assert {v.fault for v in check(Motion.from_cycles(q), FR3, distance=None).violations} == {
        FrankaError.JOINT_POSITION_LIMITS_VIOLATION
    }
    assert FrankaError.JOINT_MOTION_GENERATOR_POSITION_LIMITS_VIOLATION not in {
        row.fault for row in FR3_CONDITIONS.conditions
    }


def test_a_slow_down_takes_a_motion_below_the_bound() -> None:
    q = np.repeat(FR3.home[np.newaxis], 601, axis=0)
    share = np.linspace(0.0, 1.0, 601)
    q[:, 0] = 2.1 + 0.6 * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    report = check(Motion.from_cycles(q), FR3, distance=None)
    assert {v.condition.id for v in report.violations} == {"joint.velocity"}
    assert "the bound decreases towards the end of the range" in report.explain()
    assert "越接近限位，限值越低" in report.explain("zh")
    found = report.slow_down()
    assert found.ok
    assert found.decisive is not None
    assert found.decisive.ratio == pytest.approx(1.0, abs=5e-3)
    assert found.decisive.bound < 2.62


@st.composite
def spoiled_motions(draw: st.DrawFn) -> Motion:
    """Returns a motion of one joint into the last tenth of its range and back, with single rows displaced."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    joint, side = draw(st.integers(0, 6)), draw(st.sampled_from([0, 1]))
    end = (LIMITS.lower, LIMITS.upper)[side][joint]
    inwards = (1.0, -1.0)[side]
    count = draw(st.integers(60, 400))
    share = np.linspace(0.0, 2.0, count)
    swing = 0.5 - 0.5 * np.cos(np.pi * share)
    q = np.repeat(FR3.home[np.newaxis], count, axis=0)
    q[:, joint] = end + inwards * (0.4 - draw(st.floats(0.2, 0.399)) * swing)
    for _ in range(draw(st.integers(0, 3))):
        q[int(rng.integers(0, count)), joint] += inwards * 10.0 ** draw(st.floats(-9.0, -2.0))
    return Motion.from_cycles(q)


@settings(max_examples=80)
@given(spoiled_motions())
def test_monitor_and_check_give_the_same_verdict_in_every_cycle(motion: Motion) -> None:
    monitor = JointMonitor(LIMITS, ROWS)
    monitor.reset(motion.q[0].tolist())
    played = [{(v.condition.id, v.axis, v.value, v.bound) for v in monitor.step(row.tolist())} for row in motion.q]
    report = check(motion, FR3, distance=None)
    for row in ROWS:
        expected = np.zeros(len(played), dtype=bool)
        for violation in report.violations:
            if violation.condition.id == row.id:
                first = round(violation.time / 0.001)
                expected[first : first + violation.count] = True
        assert [row.id in {found[0] for found in cycle} for cycle in played] == expected.tolist()[: len(played)]


def test_a_gap_in_conforming_commands_violates_nothing() -> None:
    q = np.repeat(FR3.home[np.newaxis], 1500, axis=0)
    share = np.linspace(0.0, 1.0, 1500)
    q[:, 6] = 2.2 + 0.7 * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    assert check(Motion.from_cycles(q), FR3, distance=None).ok
    for gap in (2, 7, 19):
        monitor = JointMonitor(LIMITS, ROWS)
        monitor.reset(q[0].tolist())
        assert not any(monitor.step(row.tolist(), gap) for row in q[::gap][1:])


def test_the_monitor_of_a_session_uses_the_same_bounds() -> None:
    monitor = Monitor(FR3, "joint_position")
    q = FR3.home.copy()
    q[4] = 2.805
    for velocity, bounds in ((-0.5, []), (0.5, [LIMITS.velocity_bounds(q)[1][4]])):
        dq = np.array([0.0, 0.0, 0.0, 0.0, velocity, 0.0, 0.0])
        monitor.reset(StartState(q, dq, np.zeros(7)))
        found = monitor.step(JointPosition(q + 0.001 * dq))
        assert [v.bound for v in found if v.condition.id == "joint.velocity"] == bounds


def test_inverse_joint_velocities_are_bounded_likewise() -> None:
    row = FR3_CONDITIONS.find("inverse.joint.velocity")
    assert row.bounds_at is not None
    assert row.fault is FrankaError.CARTESIAN_MOTION_GENERATOR_JOINT_VELOCITY_LIMITS_VIOLATION
    assert FR3_CONDITIONS.find("inverse.joint.position").fault is FrankaError.JOINT_POSITION_LIMITS_VIOLATION
