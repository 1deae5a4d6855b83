"""Curves for a screen: no spike is lost, violations are areas, axes stand still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.app.goal.goal import goal_at
from rcilab.app.planning import build_plan_view
from rcilab.app.run.recording import Recording
from rcilab.app.store import UiState
from rcilab.app.text import Text
from rcilab.conformance.check import check
from rcilab.core.clock import CYCLE_TIME
from rcilab.makers.maker import state_rounding_of
from rcilab.makers.rokae.conditions import RCI_JOINT_CONDITIONS
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint, plan_recovery
from rcilab.views.plots import (
    ORDERS,
    QUANTITIES,
    Curves,
    bounds_of,
    build_error_frame,
    build_frame,
    decimate,
    mark_moment,
    plan_curves,
    recorded_curves,
    streamed_curves,
)
from rcilab.workbench.panels.plot_contents import plot_contents
from rcilab.workbench.panels.plots import Plots

MODEL = load_model("xMatePro7")
FR3 = load_model("FR3")
LIMITS = MODEL.limits.joint


def some_motion() -> Motion:
    return plan_joint(MODEL, MODEL.home, MODEL.home + 0.5, speed=0.5)


@given(st.integers(1, 400), st.integers(1, 50), st.integers(0, 2**31))
def test_decimation_keeps_the_extremes_of_every_bucket(count, buckets, seed):
    rng = np.random.default_rng(seed)
    t = np.sort(rng.uniform(0.0, 1.0, count))
    values = rng.normal(size=(count, 3))
    thin = decimate(Curves(t=t, values=values), np.linspace(0.0, 1.0, buckets + 1))
    assert thin.shape == (2 * buckets, 3)
    assert np.array_equal(np.nanmax(thin, axis=0), values.max(axis=0))
    assert np.array_equal(np.nanmin(thin, axis=0), values.min(axis=0))


def test_a_spike_of_one_sample_survives():
    motion = some_motion()
    q = np.array(motion.q)
    q[431, 2] += 0.3
    frame = build_frame(Curves(t=motion.times, values=q), None, LIMITS, "q", 3, buckets=60)
    assert np.nanmax(frame.plan[0]) == pytest.approx(np.degrees(q[431, 2]), abs=1e-12)


def test_a_violation_is_marked_where_it_is_and_nothing_else_is():
    motion = some_motion()
    dq = np.array(motion.dq)
    calm = build_frame(Curves(t=motion.times, values=dq), None, LIMITS, "dq", 0)
    assert not calm.violated.any()
    dq[500, 1] = 1.5 * LIMITS.velocity[1]
    spoiled = build_frame(Curves(t=motion.times, values=dq), None, LIMITS, "dq", 0)
    assert np.nanmax(spoiled.plan) == pytest.approx(150.0)
    assert spoiled.bound > 150.0
    worst = int(np.nanargmax(np.max(spoiled.plan, axis=0)))
    assert spoiled.violated[worst]
    assert 3 <= spoiled.violated.sum() <= 12


@pytest.mark.parametrize(("roundings", "is_violated"), [(3, False), (5, True)])
def test_what_only_the_rounding_of_states_puts_beyond_a_limit_is_no_violation(roundings, is_violated):
    rounding, q = state_rounding_of(FR3), np.zeros((800, 7))
    q[500:, 1] = CYCLE_TIME**2 * LIMITS.acceleration[1] + roundings * rounding
    run = recorded_curves(CYCLE_TIME * np.arange(800), q, q, 0.0 * q, "ddq", rounding=rounding)
    for joint in (0, 2):
        assert build_frame(None, run, LIMITS, "ddq", joint).violated.any() == is_violated


def near_the_end() -> Motion:
    """A fast motion of joint 4 of an FR3 to the end of its range, where its velocity limit decreases."""
    goal = FR3.home.copy()
    goal[3] = FR3.limits.joint.upper[3] - 0.02
    return plan_joint(FR3, FR3.home, goal, speed=1.0, law="jerk_limited")


def test_a_velocity_limit_that_depends_on_the_angle_is_a_curve_along_plan_and_run():
    motion, limits = near_the_end(), FR3.limits.joint
    assert check(motion, FR3).ok
    plan = plan_curves(motion, "dq")
    own = build_frame(plan, None, limits, "dq", 4)
    assert own.upper[0] == pytest.approx(np.degrees(limits.velocity[3]))
    last = np.array(motion.q[-1])
    assert own.upper[-1] == pytest.approx(np.degrees(limits.velocity_bounds(last)[1][3]))
    assert own.upper[-1] < 0.3 * own.upper[0]
    assert own.lower.min() == pytest.approx(-own.upper[0])
    run = recorded_curves(motion.times, motion.q, motion.q, motion.dq, "dq")
    assert np.allclose(build_frame(None, run, limits, "dq", 4).upper, own.upper, rtol=0.02)
    for joint in (0, 4):
        assert not build_frame(plan, run, limits, "dq", joint).violated.any()
        fast = Curves(t=plan.t, values=1.5 * plan.values, q=plan.q)
        frame = build_frame(fast, None, limits, "dq", joint)
        usage = 150.0 * np.abs(plan.values[:, 3]) / limits.velocity_bounds(plan.q)[1][:, 3]
        assert (usage > 100.0).any()
        assert frame.violated.any()
    used = build_frame(plan, None, limits, "dq", 0)
    assert set(used.upper) == {100.0}
    assert np.nanmax(used.plan[0]) == 0.0  # A joint at rest uses nothing of its limit.


@pytest.mark.parametrize("mode", ["torque", "joint_position"])
def test_torques_have_a_velocity_limit_that_does_not_depend_on_the_angles(mode):
    """A torque takes joint 4 of an FR3 faster over the end of its range than it may be commanded there."""
    limits, t = FR3.limits.joint, CYCLE_TIME * np.arange(300)
    q, dq = np.tile(near_the_end().goal, (300, 1)), np.zeros((300, 7))
    dq[:, 3] = 1.0
    still = Motion.from_cycles(q)
    plan = build_plan_view(FR3, still, check(still, FR3))
    state = UiState(model=FR3, goal=goal_at(FR3, q[0]), plan=plan, plot_joint=4)
    run = replace(state, recording=Recording(t=t, q=q + np.outer(t, dq[0]), q_c=q, dq=dq, delay=0, mode=mode))
    frame = Plots(Text("en"))._joint_frame(run, "dq", 1.0)
    expected = limits.velocity[3] if mode == "torque" else limits.velocity_bounds(q[0])[1][3]
    assert frame.upper == pytest.approx(expected)
    assert bool(frame.upper[0] > 1.0) is (mode == "torque")
    assert not frame.violated.any(), "what is measured has the same bound everywhere"
    planned = Plots(Text("en"))._joint_frame(replace(state, plan=replace(plan, mode=mode)), "dq", 1.0)
    assert np.array_equal(planned.upper, frame.upper)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_in_percent_the_limits_are_100_whatever_the_joint(quantity):
    low, high = bounds_of(LIMITS, quantity)
    curves = Curves(t=np.array([0.0, 0.5, 1.0]), values=np.array([low, 0.5 * (low + high), high]))
    frame = build_frame(curves, None, LIMITS, quantity, 0, buckets=3)
    for column in frame.plan:
        assert np.nanmin(column) == pytest.approx(-100.0)
        assert np.nanmax(column) == pytest.approx(100.0)


def test_recorded_derivatives_are_the_controllers_backward_differences():
    motion = some_motion()
    t, q = motion.times, motion.q
    jerk = recorded_curves(t, q, q, motion.dq, "jerk").values
    expected = np.zeros_like(q)
    expected[3:] = np.diff(q, n=3, axis=0) / 1e-9
    assert np.array_equal(jerk, expected)


def test_rows_of_every_tenth_cycle_are_differences_over_ten():
    t = 0.01 * np.arange(20)
    q = np.tile((t**3)[:, None], 7)
    assert np.allclose(recorded_curves(t, q, q, q, "jerk").values[3:], 6.0)


def test_a_lost_cycle_makes_no_false_spike():
    motion = some_motion()
    keep = np.ones(len(motion.times), dtype=bool)
    keep[300] = False
    t, q = motion.times[keep], motion.q[keep]
    whole = np.abs(recorded_curves(motion.times, motion.q, motion.q, motion.dq, "ddq").values).max()
    assert np.abs(recorded_curves(t, q, q, motion.dq[keep], "ddq").values).max() <= whole * (1 + 1e-9)


def test_a_fault_in_the_first_cycles_is_marked_there_and_not_on_the_empty_axis():
    motion = Motion.from_cycles(np.array([MODEL.home, MODEL.home + 0.3]))
    for quantity in QUANTITIES:
        frame = build_frame(plan_curves(motion, quantity, is_recorded=True), None, LIMITS, quantity, 0)
        assert frame.end == 0.005
        spoiled = mark_moment(frame, CYCLE_TIME)
        assert spoiled.t[spoiled.violated].tolist() == pytest.approx([CYCLE_TIME] * spoiled.violated.sum(), abs=1e-4)
        assert spoiled.violated.any()
    errors = build_error_frame(motion.times, np.zeros((2, 7)), motion.duration, 0.02)
    assert not mark_moment(errors, CYCLE_TIME).violated[20:].all()


def test_no_violation_is_marked_where_there_is_no_curve():
    """Zero is out of the range of this joint."""
    limits = load_model("Panda").limits.joint
    curves = Curves(t=np.array([0.0, 0.7]), values=np.tile(0.5 * (limits.lower + limits.upper), (2, 1)))
    assert limits.upper[3] < 0.0
    assert not build_frame(curves, None, limits, "q", 4).violated.any()


def test_the_time_axis_ends_at_a_round_number_and_holds_the_longer_curve():
    motion = some_motion()
    longer = Curves(t=np.append(motion.times, motion.times[-1] + 1.0), values=np.vstack([motion.q, motion.q[-1:]]))
    frame = build_frame(plan_curves(motion, "q"), longer, LIMITS, "q", 0)
    assert frame.end >= longer.t[-1]
    assert frame.end == frame.t[-1]
    assert frame.end in (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)


@pytest.mark.parametrize("joint", [0, 4])
def test_the_number_of_series_never_changes(joint):
    motion = some_motion()
    empty = plot_contents(build_frame(None, None, LIMITS, "q", joint), joint, 7)
    full = plot_contents(build_frame(plan_curves(motion, "q"), plan_curves(motion, "q"), LIMITS, "q", joint), joint, 7)
    assert len(empty[0]) == len(empty[1]) == len(full[0]) == len(full[1]) == 20
    assert len({len(column) for column in full[0]}) == 1


def test_a_plan_is_drawn_as_it_is_checked():
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3)
    used = {
        row.condition.order: row.ratio for row in check(motion, MODEL).rows if row.condition in RCI_JOINT_CONDITIONS
    }
    drawn = np.abs(plan_curves(motion, "jerk").values / LIMITS.jerk).max()
    assert drawn == pytest.approx(used[3], rel=1e-6)


def test_what_is_worst_behind_the_end_is_drawn_at_the_end():
    whole = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3)
    motion = Motion.from_cycles(whole.q[: len(whole.q) // 2])  # It ends at full speed: the arm cannot stop within 1 ms.
    used = {
        row.condition.order: row.ratio for row in check(motion, MODEL).rows if row.condition in RCI_JOINT_CONDITIONS
    }
    for quantity, bound in (("ddq", LIMITS.acceleration), ("jerk", LIMITS.jerk)):
        curves = plan_curves(motion, quantity)
        assert np.abs(curves.values / bound).max() == pytest.approx(used[ORDERS[quantity]], rel=1e-6)
        assert curves.t[-1] == motion.duration
        assert build_frame(curves, None, LIMITS, quantity, 0).violated.any()


def test_a_plan_that_leads_back_from_outside_its_range_is_no_violation_and_one_that_leads_out_is():
    outside = MODEL.home.copy()
    outside[0] = LIMITS.upper[0] + np.radians(0.9)
    back = plan_recovery(MODEL, outside)
    assert check(back, MODEL).ok
    out = Motion.from_cycles(back.q[::-1])
    for motion, is_violated in ((back, False), (out, True)):
        for joint in (0, 1):
            assert build_frame(plan_curves(motion, "q"), None, LIMITS, "q", joint).violated.any() == is_violated


def test_a_planned_torque_is_that_of_the_commands():
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3)
    drawn, streamed = plan_curves(motion, "tau", MODEL).values, streamed_curves(motion.q, "tau", MODEL).values
    assert np.allclose(drawn[2 : len(streamed)], streamed[2:], rtol=0, atol=1e-9)
