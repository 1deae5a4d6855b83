"""Franka's table for the Panda: bounds and names of the pages, beside the manual's, and `check` that judges by them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.conformance.common_conditions import condition_table
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.makers.franka.conditions import FCI_CONDITIONS, FR3_CONDITIONS
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.limit_tables import cartesian_limits
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint

PANDA = load_model("Panda")
FCI, RCI = FCI_CONDITIONS, RCI_CONDITIONS
MOTION = plan_joint(PANDA, PANDA.home, PANDA.home + [0.8, 0.4, -0.6, 0.5, 0.3, 0.6, -1.0], speed=0.5)

JOINT_ERRORS = {
    "joint.position": "joint_motion_generator_position_limits_violation",
    "joint.velocity": "joint_motion_generator_velocity_limits_violation",
    "joint.acceleration": "joint_motion_generator_velocity_discontinuity",
    "joint.jerk": "joint_motion_generator_acceleration_discontinuity",
}


def test_an_arm_is_judged_by_its_makers_table():
    assert condition_table(PANDA.description) is FCI
    assert condition_table(load_model("xMate3").description) is RCI
    assert [row.condition for row in check(MOTION, PANDA, distance=None).rows] == list(FCI.motion)


def test_both_tables_judge_the_same_things_of_a_joint_motion_under_the_same_ids():
    assert [row.id for row in FCI.motion] == [row.id for row in RCI.motion]
    for ours, theirs in zip(FCI.motion, RCI.motion, strict=True):
        assert (ours.quantity, ours.unit, ours.signal, ours.order) == (
            theirs.quantity, theirs.unit, theirs.signal, theirs.order)  # fmt: skip
        assert "Franka" in ours.source


def test_the_necessary_conditions_on_joints_raise_what_the_makers_page_says():
    names = {row.id: row.fault.manual_name for row in FCI.motion if row.fault is not None}
    assert names == JOINT_ERRORS | {"start.position": "joint_position_motion_generator_start_pose_invalid"}


def test_bounds_are_the_numbers_of_the_page():
    def bound(name: str) -> list[float]:
        return FCI.find(name).bounds(PANDA.limits)[1].tolist()

    assert bound("joint.velocity") == [2.175] * 4 + [2.610] * 3
    assert bound("joint.acceleration") == [15, 7.5, 10, 12.5, 15, 20, 20]
    assert bound("joint.jerk") == [7500, 3750, 5000, 6250, 7500, 10000, 10000]
    assert bound("joint.torque") == [87] * 4 + [12] * 3
    assert bound("torque.rate") == [1000] * 7
    assert [bound(f"cartesian.{name}.translation") for name in ("velocity", "acceleration", "jerk")] == [
        [2.0], [13.0], [6500.0]]  # fmt: skip
    assert [bound(f"cartesian.{name}.rotation") for name in ("velocity", "acceleration", "jerk")] == [
        [2.5], [25.0], [12500.0]]  # fmt: skip
    assert [bound(f"elbow.{name}") for name in ("position", "velocity", "acceleration", "jerk")] == [
        [2.8973], [2.175], [10.0], [5000.0]]  # fmt: skip
    assert bound("lost.commands") == [20]


def test_the_stricter_translation_velocity_of_the_page_is_a_setting_and_the_report_says_which_applies():
    strict = cartesian_limits(PANDA.limits, "manual")
    assert FCI.find("cartesian.velocity.translation").bounds(strict)[1].tolist() == [1.7]
    assert cartesian_limits(PANDA.limits) is PANDA.limits
    assert "page has 1.7 m/s" in str(check(MOTION, PANDA, mode="cartesian_position", distance=None))
    fr3 = load_model("FR3")
    assert cartesian_limits(fr3.limits, "manual") is fr3.limits
    assert not any("1.7" in row.source for row in FR3_CONDITIONS.conditions)
    with pytest.raises(InvalidValueError, match="known: sdk, manual"):
        cartesian_limits(PANDA.limits, "page")


def test_every_number_of_the_fr3_is_from_a_source_of_the_fr3():
    panda, fr3 = PANDA.limits, load_model("FR3").limits
    for row in FR3_CONDITIONS.conditions:
        if row.is_measured or row.stage != "throughout" or row.bounds_at is not None:
            continue
        has_own = any((a != b).any() for a, b in zip(row.bounds(panda), row.bounds(fr3), strict=True))
        assert not has_own or "Franka Research 3" in row.source or "URDF of the arm" in row.source, row.id
    assert "Franka Research 3" in FR3_CONDITIONS.find("joint.acceleration").source


def test_a_condition_that_raises_an_error_is_necessary_and_ids_are_unique():
    assert all((row.fault is not None) == (row.necessity == "necessary") for row in FCI.conditions)
    assert all(row.fault is None or isinstance(row.fault, FrankaError) for row in FCI.conditions)
    assert len({row.id for row in FCI.conditions}) == len(FCI.conditions)
    for row in FCI.conditions:
        lower, upper = row.bounds(PANDA.limits)
        assert lower.shape == upper.shape == ((7,) if row.is_per_joint else (1,)), row.id
        assert (lower < upper).all(), row.id


def test_every_error_of_a_commanded_motion_is_raised_by_a_row():
    commanded = [error for error in FrankaError if "MOTION_GENERATOR" in error.name and error.value <= 31]
    assert len(commanded) == 17
    assert all(FCI.raising(error) for error in commanded)
    assert {row.id for row in FCI.raising(FrankaError.CONTROLLER_TORQUE_DISCONTINUITY)} == {"torque.rate"}
    assert FCI.raising(Fault.COLLISION) == ()  # 15 as well, but another maker's


def test_names_are_those_that_the_client_library_prints():
    assert len(FrankaError) == 41
    assert [error.value for error in FrankaError] == list(range(41))
    assert FrankaError(14).manual_name == "joint_motion_generator_velocity_discontinuity"
    assert FrankaError(34).manual_name == "tau_J_range_violation"
    assert all(error.cause and error.cause[0].islower() for error in FrankaError)


def test_an_unknown_condition_lists_the_known_ones():
    with pytest.raises(InvalidValueError, match=r"elbow\.sign"):
        FCI.find("arm_angle.velocity")


@settings(max_examples=40)
@given(st.data())
def test_exactly_the_spoiled_sample_is_flagged_with_the_makers_names(data):
    row = data.draw(st.integers(4, len(MOTION) - 5))
    joint = data.draw(st.integers(0, 6))
    shift = data.draw(st.sampled_from([1.0, -1.0])) * data.draw(st.floats(2e-4, 1e-3))
    q = MOTION.q.copy()
    q[row, joint] += shift
    report = check(Motion.from_cycles(q), PANDA, distance=None)
    assert {violation.joint for violation in report.violations} == {joint + 1}
    jerk, acceleration = (
        [(v.time, v.count, v.fault) for v in report.violations if v.condition.id == name]
        for name in ("joint.jerk", "joint.acceleration")
    )
    at = pytest.approx(row * CYCLE_TIME)
    assert jerk == [(at, 4, FrankaError.JOINT_MOTION_GENERATOR_ACCELERATION_DISCONTINUITY)]
    assert acceleration == [(at, 3, FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_DISCONTINUITY)]


def test_one_motion_is_judged_by_two_makers_side_by_side():
    q = MOTION.q.copy()
    q[100, 2] += 1e-3
    pro = load_model("xMatePro7")
    names = {
        model.name: {
            v.fault.manual_name for v in check(Motion.from_cycles(q - PANDA.home + model.home), model).violations
        }
        for model in (PANDA, pro)
    }
    assert names["Panda"] >= {"joint_motion_generator_acceleration_discontinuity"}
    assert names["xMatePro7"] >= {"kCommandJointAccelerationDiscontinuity"}


def test_a_start_elsewhere_aborts_a_panda_and_no_slow_down_mends_it():
    report = check(MOTION, PANDA, start=PANDA.home + 0.01)
    assert FrankaError.JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID in {v.fault for v in report.violations}
    assert report.slow_down().obstacle == "elsewhere"
    assert check(MOTION, PANDA, start=PANDA.home + 1e-7).ok  # a jerk inside every bound


def test_joint_4_has_to_stay_below_its_upper_limit_and_the_words_say_so():
    q = np.repeat(PANDA.home[np.newaxis], 5, axis=0)
    q[:, 3] = PANDA.limits.joint.upper[3]
    report = check(Motion.from_cycles(q), PANDA)
    assert [(v.joint, v.fault) for v in report.violations] == [
        (4, FrankaError.JOINT_MOTION_GENERATOR_POSITION_LIMITS_VIOLATION)
    ]
    for language in ("en", "zh"):
        assert "joint_motion_generator_position_limits_violation" in report.explain(language)


def test_a_box_is_judged_by_the_makers_error():
    box = SafetyBox(size=(0.02, 0.02, 0.02), T_base_box=PANDA.forward(PANDA.home))
    found = {v.fault for v in check(MOTION, PANDA, box=box).violations}
    assert found == {FrankaError.CARTESIAN_POSITION_LIMITS_VIOLATION}


def test_a_conforming_motion_of_a_panda_has_a_certificate():
    report = check(MOTION, PANDA)
    assert report.require().certificate is not None
    slower = replace(PANDA.description, limits=replace(PANDA.limits, joint=replace(
        PANDA.limits.joint, velocity=0.1 * PANDA.limits.joint.velocity)))  # fmt: skip
    assert not check(MOTION, type(PANDA)(slower)).ok
    assert math.isfinite(report.worst.ratio)
