"""The least slow-down: it passes, nothing faster does, and where none passes that is said with the reason."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.conformance.report import Report
from rcilab.conformance.start import StartState
from rcilab.conformance.time_scaling import PRECISION, Obstacle
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import Motion, PiecewisePolynomial, differences_from_derivatives, plan_joint
from rcilab.motion.motion import stationary_motion

MODEL = load_model("xMatePro7")
GOAL = np.array([0.8, 0.4, -0.6, 1.2, 0.3, 0.2, -1.5])
FULL = plan_joint(MODEL, MODEL.home, GOAL, speed=1.0)


def hurried(motion: Motion, factor: float) -> Motion:
    """The same motion, run faster."""
    return Motion(polynomial=motion.polynomial.slowed(1.0 / factor), goal=motion.goal, law=motion.law)


def refused(report: Report, **options: float) -> tuple[str | None, str]:
    result = report.slow_down(**options)
    assert not result.ok
    assert result.factor is result.motion is result.report is None
    assert result.decisive is not None
    return result.obstacle, result.decisive.id


@settings(max_examples=25)
@given(st.integers(0, 2**32), st.floats(1.01, 8.0), st.sampled_from(["jerk_limited", "s_profile", "samples"]))
def test_the_slowed_motion_passes_and_one_that_is_a_little_faster_does_not(seed, factor, law):
    rng = np.random.default_rng(seed)
    start, goal = (0.9 * rng.uniform(MODEL.limits.joint.lower, MODEL.limits.joint.upper) for _ in range(2))
    planned = plan_joint(MODEL, start, goal, speed=1.0, law="jerk_limited" if law == "samples" else law)
    motion = hurried(planned, factor)
    if law == "samples":  # Rows tell rest from motion only so far: hurried further, their curve starts with a step.
        motion = Motion.from_cycles(hurried(planned, 1.0 + factor / 8.0).q)
    # A planner sees no table: what is judged here is how fast.
    report = check(motion, MODEL, distance=None)
    result = report.slow_down()
    assert result.ok
    if report.ok:
        assert (result.factor, result.motion, result.report) == (1.0, motion, report)
        return
    assert result.factor > 1.0
    assert result.motion.fingerprint == motion.slowed(result.factor).fingerprint
    assert check(result.motion, MODEL, distance=None).ok
    assert result.report.certificate == check(result.motion, MODEL, distance=None).certificate
    if law == "samples":  # Their acceleration jumps from row to row, which shows at one factor and not at the next.
        return
    assert result.factor <= factor * 1.002
    # The derivatives of the rows waver by PRECISION with the factor: it may be broken at one and not at the next.
    faster = (motion.slowed(max(1.0, result.factor / (1.0 + part * PRECISION))) for part in (1.0, 1.5))
    broken = [{row.id for row in check(each, MODEL, distance=None).rows if not row.ok} for each in faster]
    assert any(result.decisive.id in found for found in broken)


@pytest.mark.parametrize("factor", [1.01, 1.5, 4.0, 15.0])
def test_a_time_optimal_motion_that_was_hurried_is_slowed_to_what_it_was(factor):
    result = check(hurried(FULL, factor), MODEL).slow_down()
    # The planner leaves a part in a thousand of every bound; the cube root of it, for a jerk.
    assert result.factor == pytest.approx(factor, rel=2e-3)
    assert f"{result.factor:.4g} times slower" in str(result)


def test_a_motion_that_passes_is_returned_as_it_is():
    report = check(FULL, MODEL)
    result = report.slow_down()
    assert (result.factor, result.motion, result.report, result.decisive) == (1.0, FULL, report, None)
    assert str(result) == "No slow-down is needed."
    still = check(stationary_motion(GOAL), MODEL).slow_down()
    assert still.factor == 1.0


def test_recommended_conditions_count_only_when_asked_and_those_that_none_meets_are_named():
    report = check(FULL, MODEL, start=MODEL.home + 2e-9)
    assert {v.condition.id for v in report.warnings} == {"joint.torque_rate", "start.position"}
    assert report.slow_down().factor == 1.0
    result = report.slow_down(recommended=True)
    assert result.factor > 1.5
    assert result.decisive.id == "joint.torque_rate"
    assert [row.id for row in result.unmet] == ["start.position"]
    assert {v.condition.id for v in result.report.warnings} == {"start.position"}
    assert "distance of the start from the arm" in str(result)
    faster = check(FULL.slowed(result.factor / (1.0 + 1.5 * PRECISION)), MODEL)
    assert "joint.torque_rate" in {v.condition.id for v in faster.warnings}


def test_a_joint_out_of_its_range_is_not_mended():
    q = FULL.q.copy()
    q[:, 1] += MODEL.limits.joint.upper[1]
    report = check(Motion.from_cycles(q), MODEL, distance=None)
    assert refused(report) == ("position", "joint.position")
    assert "the path stays the same: joint 2, commanded position" in str(report.slow_down())


def test_a_tool_out_of_the_safety_box_is_not_mended():
    box = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=MODEL.forward(MODEL.home))
    assert refused(check(hurried(FULL, 2.0), MODEL, box=box)) == ("position", "cartesian.position")


def test_a_turn_between_rows_that_only_a_slower_motion_shows_is_not_mended():
    duration, lift = 0.401, 0.1  # Turns half-way between two rows; (4 t (T - t) / T^2)^3 starts and ends at rest.
    bump = np.polynomial.polynomial.polypow([0.0, 4.0 / duration, -4.0 / duration**2], 3)
    curve = np.zeros((1, 7, 7))
    curve[0, :, 0] = MODEL.home
    curve[0, 1, : len(bump)] += lift * bump
    motion = Motion(polynomial=PiecewisePolynomial([0.0, duration], curve), goal=MODEL.home, law="samples")
    upper = MODEL.limits.joint.upper.copy()
    upper[1] = np.nextafter(motion.q[:, 1].max(), np.inf)
    limits = replace(MODEL.limits, joint=replace(MODEL.limits.joint, upper=upper))
    report = check(motion, RobotModel(replace(MODEL.description, limits=limits)))
    assert {v.condition.id for v in report.violations} == {"joint.acceleration"}
    assert refused(report) == ("position", "joint.position")


def test_a_box_that_is_kept_is_kept_and_covered_by_the_certificate():
    box = SafetyBox(size=(4.0, 4.0, 4.0), T_base_box=MODEL.forward(MODEL.home))
    result = check(hurried(FULL, 2.0), MODEL, box=box).slow_down()
    assert "cartesian.position" in {row.id for row in result.report.rows}
    result.report.certificate.verify(result.motion, MODEL, MODEL.home, box)


def test_a_start_that_is_elsewhere_is_not_mended():
    start = MODEL.home.copy()
    start[2] += 1e-3
    assert refused(check(FULL, MODEL, start=start)) == ("elsewhere", "joint.jerk")
    assert refused(check(hurried(FULL, 3.0), MODEL, start=start))[0] == "elsewhere"


def test_an_arm_that_moves_at_the_start_must_go_on_as_it_moves():
    present = FULL.at(0.3)
    onward = plan_joint(MODEL, present.q, GOAL, start_velocity=present.dq, start_acceleration=present.ddq, speed=1.0)
    moving = StartState(present.q, *differences_from_derivatives(present.dq, present.ddq, present.jerk))
    report = check(onward, MODEL, start=moving)
    assert report.slow_down().factor == 1.0
    spoiled = onward.q.copy()
    spoiled[200:, 0] += np.linspace(0.0, 4e-3, len(spoiled) - 200)
    obstacle, _ = refused(check(Motion.from_cycles(spoiled), MODEL, start=moving))
    assert obstacle == "moving_start"
    # A recommendation is no reason to break a necessary condition.
    result = report.slow_down(recommended=True)
    assert result.factor == 1.0
    assert {row.id for row in result.unmet} == {v.condition.id for v in report.warnings}


def test_a_step_in_velocity_is_not_mended_but_told_as_a_jump():
    report = check(Motion.from_cycles(FULL.q[:300]), MODEL)
    assert refused(report) == ("jump", "joint.jerk")
    assert "jumps at t = 0.299 s" in str(report.slow_down())
    # It only becomes smaller, and with patience small enough.
    patient = report.slow_down(at_most=500.0)
    assert 200.0 < patient.factor < 300.0


def test_a_limit_on_the_factor_is_kept():
    report = check(hurried(FULL, 4.0), MODEL)
    assert refused(report, at_most=3.0)[0] == "too_fast"
    assert refused(report, at_most=1.0)[0] == "too_fast"
    assert report.slow_down(at_most=4.1).ok
    for at_most in (0.5, np.inf, np.nan):
        with pytest.raises(InvalidValueError, match="at_most"):
            report.slow_down(at_most=at_most)


def test_a_long_motion_is_not_slowed_into_hours():
    for seconds, at_most in ((10.0, 20.0), (100.0, 6.0), (400.0, 2.0)):
        still = PiecewisePolynomial([0.0, seconds], MODEL.limits.joint.upper.reshape(1, 7, 1))
        motion = Motion(polynomial=still, goal=MODEL.limits.joint.upper, law="samples")
        assert check(motion, MODEL, distance=None).slow_down().at_most == at_most


def test_every_obstacle_has_a_sentence_in_both_languages():
    report = check(hurried(FULL, 4.0), MODEL)
    for obstacle in get_args(Obstacle):
        result = replace(report.slow_down(at_most=3.0), obstacle=obstacle)
        assert "joint 7, commanded" in result.explain()
        assert "关节 7，指令" in result.explain("zh")
    with pytest.raises(InvalidValueError, match="known: en, zh"):
        report.slow_down().explain("de")


def test_a_search_tells_how_far_it_is_and_ends_when_nobody_wants_it_any_more() -> None:
    told: list[float] = []
    report = check(hurried(FULL, 2.0), MODEL)
    report.slow_down(progress=told.append)
    assert told == sorted(told)
    assert 0.0 < told[0] < told[-1] < 1.0

    def give_up(part: float) -> None:
        raise InterruptedError

    with pytest.raises(InterruptedError):
        report.slow_down(progress=give_up)
