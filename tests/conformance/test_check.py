from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.conformance.start import StartState
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import ConformanceError, InvalidValueError
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import Motion, differences_from_derivatives, plan_joint

MODEL = load_model("xMatePro7")
LIMITS = MODEL.limits.joint
GOAL = np.array([0.8, 0.4, -0.6, 1.2, 0.3, 0.2, -1.5])
MOTION = plan_joint(MODEL, MODEL.home, GOAL, speed=0.5)


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.floats(0.05, 1.0), st.sampled_from(["xMatePro3", "xMate7", "Panda"]))
def test_every_planned_motion_conforms_in_every_condition(seed, speed, name):
    model = load_model(name)
    rng = np.random.default_rng(seed)
    joint = model.limits.joint
    rim = 0.01 * (joint.upper - joint.lower)
    start, goal = (rng.uniform(joint.lower + rim, joint.upper - rim) for _ in range(2))
    report = check(plan_joint(model, start, goal, speed=speed), model, distance=None)  # A planner sees no table.
    assert report.ok
    assert {v.condition.signal for v in report.warnings} <= {"torque"}
    assert all(row.ratio < 1.0 for row in report.rows if row.condition.signal != "torque")


@settings(max_examples=60)
@given(st.data())
def test_exactly_the_spoiled_sample_is_flagged(data):
    row = data.draw(st.integers(4, len(MOTION) - 5))
    joint = data.draw(st.integers(0, 6))
    shift = data.draw(st.sampled_from([1.0, -1.0])) * data.draw(st.floats(2e-4, 1e-3))
    q = MOTION.q.copy()
    q[row, joint] += shift
    report = check(Motion.from_cycles(q), MODEL, distance=None)
    assert not report.ok
    assert {violation.joint for violation in report.violations} == {joint + 1}
    jerk, acceleration = (
        [v for v in report.violations if v.condition.id == name] for name in ("joint.jerk", "joint.acceleration")
    )
    # One displaced sample is in four third differences and in three second ones, all at or after it.
    assert [(v.time, v.count) for v in jerk] == [(pytest.approx(row * CYCLE_TIME), 4)]
    assert [(v.time, v.count) for v in acceleration] == [(pytest.approx(row * CYCLE_TIME), 3)]


@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_the_bound_itself_breaks_a_condition_and_a_hair_more_room_does_not(name):
    worst = next(row for row in check(MOTION, MODEL).rows if row.id == f"joint.{name}")
    for room, ok in ((abs(worst.value), False), (np.nextafter(abs(worst.value), np.inf), True)):
        bound = getattr(LIMITS, name).copy()
        bound[worst.joint - 1] = room
        limits = replace(MODEL.limits, joint=replace(LIMITS, **{name: bound}))
        report = check(MOTION, RobotModel(replace(MODEL.description, limits=limits)))
        assert report.ok is ok
        if not ok:
            assert {(v.condition.id, v.joint) for v in report.violations} == {(f"joint.{name}", worst.joint)}


def test_a_sample_on_the_position_limit_is_outside():
    q = np.repeat(MODEL.home[np.newaxis], 5, axis=0)
    q[:, 1] = LIMITS.upper[1]
    report = check(Motion.from_cycles(q), MODEL, distance=None)
    assert [(v.joint, v.fault) for v in report.violations] == [(2, Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION)]
    q[:, 1] = np.nextafter(LIMITS.upper[1], 0.0)
    assert check(Motion.from_cycles(q), MODEL, distance=None).ok


def test_a_motion_that_ends_moving_is_flagged_in_the_cycle_after_its_last_row():
    cut = Motion.from_cycles(MOTION.q[: len(MOTION) // 2])
    report = check(cut, MODEL)
    assert {round(v.time / CYCLE_TIME) for v in report.violations} == {len(cut)}
    assert "end it at standstill" in str(report.violations[0])
    assert "end.velocity" in {v.condition.id for v in report.warnings}


def test_a_position_that_is_worst_at_the_end_has_a_time_within_the_motion():
    arm = load_model("FR3")
    motion = plan_joint(arm, arm.home, arm.home + np.radians([0.0, 109.0, 0.0, 0.0, 0.0, 60.0, 0.0]))
    report = check(motion, arm)
    floor = next(row for row in report.rows if row.id == "clearance.floor")
    assert not floor.ok
    assert all(row.time <= motion.duration for row in report.rows if row.condition.order == 0)
    assert all(v.worst_time <= motion.duration for v in report.violations if v.condition.order == 0)


def test_a_motion_that_starts_elsewhere_is_flagged_in_its_first_cycle():
    start = MODEL.home.copy()
    start[2] += 1e-3
    report = check(MOTION, MODEL, start=start)
    assert {(v.joint, v.time) for v in report.violations} == {(3, 0.0)}
    assert "plan it from the arm's commanded position" in str(report.violations[0])
    at_ends = [v for v in report.warnings if v.condition.stage != "throughout"]
    assert [(v.condition.id, v.joint) for v in at_ends] == [("start.position", 3)]


def test_a_motion_from_a_moving_arm_conforms_when_the_arm_moves_like_that_and_only_then():
    present = MOTION.at(0.5)
    onward = plan_joint(
        MODEL, present.q, MODEL.home, start_velocity=present.dq, start_acceleration=present.ddq, speed=1.0
    )
    moving = StartState(present.q, *differences_from_derivatives(present.dq, present.ddq, present.jerk))
    assert check(onward, MODEL, start=moving).ok
    standing = check(onward, MODEL)
    assert not standing.ok
    assert {v.condition.id for v in standing.warnings if v.condition.stage == "start"} == {"start.velocity"}


def test_an_arm_that_moves_and_gets_a_standing_motion_is_flagged():
    still = plan_joint(MODEL, GOAL, GOAL)
    assert check(still, MODEL).ok
    assert not check(still, MODEL, start=StartState(GOAL, np.full(7, 0.5), np.zeros(7))).ok


def test_a_faster_motion_than_the_limits_is_flagged_with_the_speed_that_would_do():
    quick = plan_joint(MODEL, MODEL.home, GOAL, speed=1.0)
    curve = quick.polynomial
    faster = type(curve)(curve.breaks / 1.25, curve.coefficients * 1.25 ** np.arange(4))
    stretched = Motion(polynomial=faster, goal=quick.goal, law="jerk_limited")
    report = check(stretched, MODEL)
    velocity = next(v for v in report.violations if v.condition.id == "joint.velocity")
    assert velocity.ratio == pytest.approx(1.25 * 0.999, rel=1e-3)
    assert "lower speed to 0.80 or less" in str(velocity)


def test_require_returns_the_report_or_raises_with_all_violations():
    good = check(MOTION, MODEL)
    assert good.require() is good
    bad = check(Motion.from_cycles(MOTION.q[:400]), MODEL)
    with pytest.raises(ConformanceError, match=r"joint \d: commanded jerk .* \(and \d+ more\)") as caught:
        bad.require()
    assert caught.value.violations == bad.violations


def test_a_motion_or_start_for_another_arm_is_refused():
    with pytest.raises(InvalidValueError, match="motion: it is for 7 joints, xMate3 has 6"):
        check(MOTION, load_model("xMate3"))
    with pytest.raises(InvalidValueError, match="start"):
        check(MOTION, MODEL, start=np.zeros(6))
    with pytest.raises(InvalidValueError, match=r"start\.dq"):
        check(MOTION, MODEL, start=StartState(MODEL.home, np.full(7, np.nan), np.zeros(7)))


def test_rows_that_end_at_rest_to_within_a_cycle_are_not_blamed_for_their_grid():
    report = check(Motion.from_cycles(MOTION.q), MODEL)
    assert not [v for v in report.warnings if v.condition.stage != "throughout"]


@pytest.mark.parametrize(
    ("motion", "model", "sentence"),
    [
        (MODEL, MOTION, r"motion must be a motion.*, got RobotModel"),
        (MODEL.home, MODEL, "motion must be a motion"),
        (MOTION, "xMatePro7", r"use load_model\('xMatePro7'\)"),
    ],
    ids=["swapped", "angles", "name"],
)
def test_wrong_types_are_refused_in_words(motion, model, sentence):
    with pytest.raises(InvalidValueError, match=sentence):
        check(motion, model)
