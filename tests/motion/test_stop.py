import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.model.robot_model import load_model
from rcilab.motion import (
    LIMIT_MARGIN,
    derivatives_from_differences,
    differences_from_derivatives,
    plan_joint,
    plan_stop,
)

MODEL = load_model("xMatePro7")
LIMITS = MODEL.limits.joint


def differences(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    dq = np.diff(q, axis=0) / CYCLE_TIME
    ddq = np.diff(dq, axis=0) / CYCLE_TIME
    return dq, ddq, np.diff(ddq, axis=0) / CYCLE_TIME


def running_motion(seed: int):
    rng = np.random.default_rng(seed)
    start, goal = (0.6 * rng.uniform(LIMITS.lower, LIMITS.upper) for _ in range(2))
    motion = plan_joint(MODEL, start, goal, speed=rng.uniform(0.1, 1.0))
    return motion, int(rng.integers(3, len(motion) - 1))


@settings(max_examples=80)
@given(st.integers(0, 2**32))
def test_a_running_motion_stopped_at_any_row_stays_inside_the_limits(seed):
    motion, row = running_motion(seed)
    present = motion.at(float(motion.times[row]))
    stop = plan_stop(LIMITS, present.q, present.dq, present.ddq)
    q = np.concatenate((motion.q[: row + 1], stop.q[1:], np.repeat(stop.q[-1:], 3, axis=0)))
    for values, bound in zip(differences(q), (LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk), strict=True):
        assert (np.abs(values) < bound).all()


@settings(max_examples=80)
@given(st.integers(0, 2**32))
def test_a_stop_from_reported_differences_stays_inside_the_limits(seed):
    motion, row = running_motion(seed)
    dq, ddq = (table[-1] for table in differences(motion.q[row - 2 : row + 1])[:2])
    stop = plan_stop(LIMITS, motion.q[row], *derivatives_from_differences(dq, ddq))
    q = np.concatenate((motion.q[: row + 1], stop.q[1:], np.repeat(stop.q[-1:], 3, axis=0)))
    # Two of three differences of history are known here: the velocity is off by up to jerk * cycle^2 / 3.
    slack = LIMITS.jerk * CYCLE_TIME**2
    for values, bound in zip(differences(q), (LIMITS.velocity + slack, LIMITS.acceleration, LIMITS.jerk), strict=True):
        assert (np.abs(values) < bound).all()


def test_a_joint_stops_in_the_time_that_its_limits_give_by_hand():
    dq = np.zeros(7)
    dq[0] = 2.0
    a, j = LIMIT_MARGIN * LIMITS.acceleration[0], LIMIT_MARGIN * LIMITS.jerk[0]
    stop = plan_stop(LIMITS, np.zeros(7), dq, np.zeros(7))
    assert stop.duration == pytest.approx(2.0 / a + a / j, abs=1e-12)
    assert stop.goal[0] == pytest.approx(2.0 * stop.duration / 2.0, abs=1e-12)


@settings(max_examples=80)
@given(st.lists(st.floats(-8.0, 8.0), min_size=7, max_size=7), st.lists(st.floats(-80.0, 80.0), min_size=7, max_size=7))
def test_any_state_has_an_answer_that_ends_at_rest(dq, ddq):
    stop = plan_stop(LIMITS, np.zeros(7), dq, ddq)
    end = stop.end()
    assert np.allclose(end.dq, 0.0, atol=1e-9)
    assert np.allclose(end.ddq, 0.0, atol=1e-6)
    assert np.array_equal(stop.q[-1], stop.goal)
    assert (np.abs(stop.jerk) <= LIMITS.jerk).all()
    inside = np.abs(np.array(ddq)) <= LIMIT_MARGIN * LIMITS.acceleration
    assert (np.abs(stop.ddq[:, inside]) <= LIMITS.acceleration[inside]).all()


def test_a_standing_arm_is_stopped_at_once():
    stop = plan_stop(LIMITS, MODEL.home, np.zeros(7), np.zeros(7))
    assert stop.duration == 0.0
    assert np.array_equal(stop.q, [MODEL.home])


def test_a_state_that_is_no_state_is_refused():
    with pytest.raises(InvalidValueError, match=r"dq.*finite"):
        plan_stop(LIMITS, np.zeros(7), np.full(7, np.nan), np.zeros(7))
    with pytest.raises(InvalidValueError, match=r"q.*needs \(7,\)"):
        plan_stop(LIMITS, np.zeros(6), np.zeros(7), np.zeros(7))


@given(st.floats(-2.0, 2.0), st.floats(-20.0, 20.0), st.floats(-5000.0, 5000.0))
def test_differences_and_derivatives_of_a_cubic_convert_exactly(v, a, j):
    h = CYCLE_TIME
    t = np.array([-3.0, -2.0, -1.0, 0.0]) * h
    dq, ddq, jerk = (table[-1] for table in differences((v * t + a * t**2 / 2.0 + j * t**3 / 6.0)[:, np.newaxis]))
    # Angles of about 1e-2 rad are rounded at 1e-18 rad; a third difference divides that by 1e-9 s^3.
    back = differences_from_derivatives(v, a, j)
    assert np.allclose([dq[0], ddq[0]], back, atol=1e-9)
    assert np.allclose(derivatives_from_differences(dq, ddq, jerk), [[v], [a]], atol=1e-9)


@pytest.mark.parametrize("wrong", [MODEL, MODEL.limits, None])
def test_what_are_no_joint_limits_is_named(wrong):
    with pytest.raises(InvalidValueError, match=r"limits must be JointLimits.*; pass model\.limits\.joint"):
        plan_stop(wrong, np.zeros(7), np.zeros(7), np.zeros(7))
