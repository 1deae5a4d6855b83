import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, PiecewisePolynomial, plan_joint
from rcilab.motion.motion import stationary_motion

MODEL = load_model("xMatePro7")
GOAL = np.array([0.4, 0.3, -0.2, 0.9, 0.1, 0.5, -1.0])


def ramp(duration: float) -> Motion:
    return Motion(polynomial=PiecewisePolynomial([0.0, duration], [[[0.0, 1.0]]]), goal=[duration], law="samples")


def test_rows_are_whole_cycles_from_the_start_to_the_goal_at_rest():
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    assert np.array_equal(motion.q[0], MODEL.home)
    assert np.array_equal(motion.q[-1], GOAL)
    assert not motion.dq[-1].any()
    assert not motion.ddq[-1].any()
    assert not motion.jerk[-1].any()
    assert np.array_equal(motion.times, np.arange(len(motion)) * CYCLE_TIME)
    assert motion.times[-2] < motion.duration <= motion.times[-1]


@given(st.floats(min_value=1e-6, max_value=0.5))
def test_the_last_row_is_the_first_cycle_that_is_not_before_the_end(duration):
    motion = ramp(duration)
    assert len(motion) == len(motion.q) == len(motion.times)
    assert motion.times[-1] >= duration - 1e-9 * CYCLE_TIME
    assert motion.times[-1] - duration < CYCLE_TIME
    assert motion.duration == duration


@pytest.mark.parametrize("cycles", [1, 3, 7, 49, 303, 1000, 4999])
def test_a_duration_of_whole_cycles_gets_no_row_too_many(cycles):
    assert len(ramp(cycles * CYCLE_TIME)) == cycles + 1
    assert len(ramp(cycles / 1000)) == cycles + 1


def test_at_agrees_with_the_rows_to_the_last_bit():
    motion = plan_joint(MODEL, MODEL.home, GOAL, speed=0.8)
    for row, t in enumerate(motion.times):
        sample = motion.at(float(t))
        assert np.array_equal(sample.q, motion.q[row])
        assert np.array_equal(sample.dq, motion.dq[row])
        assert np.array_equal(sample.ddq, motion.ddq[row])
        assert np.array_equal(sample.jerk, motion.jerk[row])


def test_outside_its_time_a_motion_stands_at_start_and_goal():
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    assert np.array_equal(motion.at(-1.0).q, MODEL.home)
    for t in (motion.duration, motion.duration + 9.0, np.inf):
        assert np.array_equal(motion.at(t).q, GOAL)
        assert not motion.at(t).dq.any()
    with pytest.raises(InvalidValueError, match="not a time"):
        motion.at(float("nan"))


def test_a_motion_of_no_length_is_one_row():
    motion = plan_joint(MODEL, GOAL, GOAL)
    assert motion.duration == 0.0
    assert motion.q.shape == motion.dq.shape == (1, 7)
    assert np.array_equal(motion.q[0], GOAL)
    assert np.array_equal(motion.at(0.0).q, GOAL)
    assert not motion.end().dq.any()


def test_rows_are_computed_once_and_cannot_be_changed():
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    assert motion.q is motion.q
    for array in (motion.q, motion.dq, motion.ddq, motion.jerk, motion.times, motion.goal, motion.at(0.1).q):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_samples_of_a_curve_come_back_as_its_rows():
    q = np.random.default_rng(0).normal(size=(40, 6))
    motion = Motion.from_cycles(q)
    assert np.array_equal(motion.q, q)
    assert motion.n == 6
    assert motion.duration == 39 * CYCLE_TIME
    assert len(Motion.from_cycles(q[:1])) == 1


def test_samples_of_a_smooth_curve_give_nearly_its_velocity():
    planned = plan_joint(MODEL, MODEL.home, GOAL)
    again = Motion.from_cycles(planned.q)
    # A cubic through rows 1 ms apart is off by less than the jerk's effect over one cycle.
    assert np.abs(again.dq - planned.dq).max() < MODEL.limits.joint.jerk.max() * CYCLE_TIME**2


@pytest.mark.parametrize("rows", [np.zeros((0, 7)), np.full((3, 7), np.nan), np.zeros((2, 2, 2))])
def test_rows_that_are_no_path_are_refused(rows):
    with pytest.raises(InvalidValueError, match="q"):
        Motion.from_cycles(rows)


def test_the_fingerprint_changes_with_anything_that_defines_the_motion():
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    nudged = GOAL.copy()
    nudged[3] = np.nextafter(nudged[3], 2.0)
    others = [
        plan_joint(MODEL, MODEL.home, GOAL, speed=0.51),
        plan_joint(MODEL, MODEL.home, nudged),
        plan_joint(MODEL, MODEL.home, GOAL, law="s_profile"),
        Motion(polynomial=motion.polynomial, goal=nudged, law=motion.law, speed=motion.speed),
        Motion(polynomial=motion.polynomial, goal=motion.goal, law="samples", speed=motion.speed),
    ]
    assert plan_joint(MODEL, MODEL.home, GOAL).fingerprint == motion.fingerprint
    assert len({motion.fingerprint, *(other.fingerprint for other in others)}) == len(others) + 1


def test_a_pickled_motion_is_the_same_motion():
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    again = pickle.loads(pickle.dumps(motion))
    assert again.fingerprint == motion.fingerprint
    assert np.array_equal(again.q, motion.q)


def test_speed_law_and_goal_are_checked_when_a_motion_is_built():
    curve = stationary_motion(GOAL).polynomial
    with pytest.raises(InvalidValueError, match="speed"):
        Motion(polynomial=curve, goal=GOAL, law="samples", speed=0.0)
    with pytest.raises(InvalidValueError, match="known: jerk_limited"):
        Motion(polynomial=curve, goal=GOAL, law="teleport")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="goal"):
        Motion(polynomial=curve, goal=GOAL[:6], law="samples")


def test_its_texts_are_short_and_name_duration_and_law():
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    assert f"{motion.duration:.3f} s" in repr(motion)
    assert len(repr(motion)) < 80
    assert "jerk_limited" in motion._repr_html_()
    assert len(motion._repr_html_()) < 800


@pytest.mark.parametrize("q", ["abc", None, [], [[1.0, 2.0], [1.0]], np.zeros((2, 2, 2))])
def test_samples_that_are_no_table_are_refused_in_words(q):
    with pytest.raises(InvalidValueError, match=r"^q (needs|must) "):
        Motion.from_cycles(q)


def test_a_sample_that_is_not_finite_is_named_by_row_and_joint():
    q = np.zeros((5, 6))
    q[3, 1] = np.nan
    with pytest.raises(InvalidValueError, match=r"q at row 3 \(from 0\), joint 2 must be finite.*, got nan"):
        Motion.from_cycles(q)


@pytest.mark.parametrize("t", ["a", None])
def test_a_time_that_is_no_number_is_refused_in_words(t):
    with pytest.raises(InvalidValueError, match=r"t must be a number"):
        Motion.from_cycles(np.zeros((3, 6))).at(t)


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.floats(1.0, 30.0), st.sampled_from(["jerk_limited", "s_profile", "samples"]))
def test_a_slowed_motion_runs_the_same_way_with_smaller_derivatives(seed, factor, law):
    rng = np.random.default_rng(seed)
    goal = MODEL.home + rng.uniform(-0.5, 0.5, 7)
    if law == "samples":
        motion = Motion.from_cycles(plan_joint(MODEL, MODEL.home, goal).q)
    else:
        motion = plan_joint(MODEL, MODEL.home, goal, law=law, speed=rng.uniform(0.1, 1.0))
    slowed = motion.slowed(factor)
    assert slowed.duration == pytest.approx(factor * motion.duration, rel=1e-15)
    assert (slowed.law, slowed.speed) == (motion.law, motion.speed)
    assert np.array_equal(slowed.goal, motion.goal)
    assert np.array_equal(slowed.start, motion.start)
    starts = motion.polynomial.breaks[:-1]
    middles = starts + rng.uniform(0.1, 0.9, len(starts)) * np.diff(motion.polynomial.breaks)  # Clear of jumps.
    for t in rng.choice(middles, 10):
        fast, slow = motion.at(t), slowed.at(t * factor)
        for order, name in enumerate(("q", "dq", "ddq", "jerk")):
            expected = getattr(fast, name) / factor**order
            # The time in a piece is off by rounding, and velocities change with it by up to 1e4 rad/s^2.
            assert getattr(slow, name) == pytest.approx(expected, rel=1e-9, abs=1e-8)


def test_a_motion_slowed_by_one_is_itself_and_two_slow_downs_multiply():
    motion = plan_joint(MODEL, MODEL.home, GOAL)
    assert motion.slowed(1.0).fingerprint == motion.fingerprint
    twice, once = motion.slowed(2.0).slowed(4.0), motion.slowed(8.0)  # Powers of two do not round.
    assert twice.fingerprint == once.fingerprint != motion.fingerprint
    assert len(stationary_motion(GOAL).slowed(3.0)) == 1


@pytest.mark.parametrize("factor", [0.999, 0.0, -2.0, np.inf, np.nan, "twice", None])
def test_a_factor_that_is_no_slow_down_is_refused(factor):
    with pytest.raises(InvalidValueError, match="factor"):
        plan_joint(MODEL, MODEL.home, GOAL).slowed(factor)


def test_rows_of_every_tenth_cycle_are_ten_cycles_apart():
    planned = plan_joint(MODEL, MODEL.home, GOAL)
    rows = planned.q[::10]
    again = Motion.from_cycles(rows, 10)
    assert again.duration == pytest.approx((len(rows) - 1) * 10 * CYCLE_TIME)
    assert np.allclose(again.q[::10], rows, rtol=0, atol=1e-12)
    assert np.abs(again.dq[: len(planned.dq)] - planned.dq[: len(again.dq)]).max() < 0.05
