"""UFACTORY's table: bounds of the manual, codes of the client library, and `check` that applies them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.conformance.common_conditions import condition_table
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.makers.ufactory.conditions import UFACTORY_CONDITIONS as TABLE
from rcilab.makers.ufactory.errors import UfactoryError, UfactoryWarning
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint, plan_line
from tests.makers.ufactory.library import library_module, needs_library

ARM = load_model("xArm6")
AHEAD = ARM.home + [0.0, 0.9, -0.9, 0.0, 0.0, 0.0]
GOAL = ARM.home + [0.6, 0.2, -0.3, 0.4, 0.2, -0.5]


def spoiled(joint, order, size):
    """A motion of a joint, counted from 0, that exceeds a bound of the given derivative, in its second half."""
    rate = np.zeros(2000)
    rate[1000 : 1000 + (1 if order > 1 else 900)] = size
    for _ in range(order):
        rate = np.cumsum(rate) * CYCLE_TIME
    return Motion.from_cycles(AHEAD + np.outer(rate, np.eye(6)[joint]))


def test_every_arm_is_checked_by_the_table_and_ids_are_unique():
    for name in ("xArm6", "xArm7", "Lite6", "850"):
        model = load_model(name)
        assert condition_table(model.description) is TABLE
        for row in TABLE.conditions:
            lower, upper = row.bounds(model.limits)
            assert lower.shape == upper.shape == ((model.n,) if row.is_per_joint else (1,)), row.id
            assert (lower < upper).all(), row.id
    assert len({row.id for row in TABLE.conditions}) == len(TABLE.conditions)
    assert all((row.fault is not None) == (row.necessity == "necessary") for row in TABLE.conditions)


def test_bounds_are_the_numbers_of_the_manual():
    def bound(name, model=ARM):
        return (
            np.degrees(TABLE.find(name).bounds(model.limits)[1])
            if "joint" in name
            else (1e3 * TABLE.find(name).bounds(model.limits)[1])
        )

    np.testing.assert_allclose(bound("joint.velocity"), 180.0)
    np.testing.assert_allclose(bound("joint.acceleration"), 1146.0, rtol=1e-3)
    np.testing.assert_allclose(bound("joint.jerk"), 28647.0, rtol=1e-3)
    assert bound("cartesian.velocity.translation") == [1000.0]
    assert bound("cartesian.velocity.translation", load_model("Lite6")) == [500.0]
    assert bound("cartesian.acceleration.translation") == [50000.0]
    assert bound("cartesian.jerk.translation") == [100000.0]
    assert bound("servo.velocity.translation") == [1200.0]
    assert bound("start.cartesian.position") == [10.0]


@pytest.mark.parametrize("name", ["xArm6", "xArm7", "Lite6", "850"])
def test_planned_motions_conform(name):
    model = load_model(name)
    assert check(plan_joint(model, model.home, model.home + 0.2, speed=0.5), model).ok
    home = model.forward(model.home)
    line = plan_line(model, model.home, Pose(home.position + (0.0, 0.06, -0.08), home.wxyz), speed=1.0)
    assert check(line, model).ok


@pytest.mark.parametrize(
    ("order", "size", "row"), [(1, 3.5, "joint.velocity"), (2, 25.0, "joint.acceleration"), (3, 600.0, "joint.jerk")]
)
def test_targets_that_are_too_fast_for_a_joint_are_a_warning_and_no_error(order, size, row):
    report = check(spoiled(5, order, size), ARM, distance=None)
    assert report.ok
    (warning,) = (v for v in report.warnings if v.condition.id == row)
    assert (warning.joint, warning.fault) == (6, None)
    assert "the controller does not stop for it" in str(warning)


def test_a_tool_that_is_too_fast_has_code_60():
    assert {v.fault for v in check(spoiled(0, 1, 3.1), ARM, distance=None).violations} == {
        UfactoryError.SERVO_LINEAR_SPEED
    }


def test_a_motion_out_of_range_and_one_out_of_the_boundary_have_codes_23_and_35():
    q = ARM.home.copy()
    q[2] = ARM.limits.joint.upper[2] - 0.01
    out = Motion.from_cycles(q + np.outer(np.linspace(0.0, 0.1, 500), [0, 0, 1, 0, 0, 0]))
    found = {v.condition.id: v.condition.fault for v in check(out, ARM, distance=None).violations}
    assert found["joint.position"] is UfactoryError.JOINT_RANGE
    box = SafetyBox(size=(0.4, 0.4, 0.4), T_base_box=Pose(ARM.forward(ARM.home).position))
    motion = plan_joint(ARM, ARM.home, GOAL, speed=0.3)
    found = {v.condition.id: v.condition.fault for v in check(motion, ARM, box=box, distance=None).violations}
    assert found == {"cartesian.position": UfactoryError.SAFETY_BOUNDARY}


def test_each_code_that_a_condition_can_raise_has_a_row():
    codes = {row.fault.value for row in TABLE.conditions if row.fault is not None}
    assert codes == {21, 22, 23, 24, 30, 31, 35, 60}


def test_errors_and_warnings_are_named_and_explained():
    assert [error.value for error in UfactoryError] == [
        *range(1, 4),
        *range(11, 18),
        *range(21, 26),
        30,
        31,
        35,
        37,
        40,
        60,
    ]
    assert [warning.value for warning in UfactoryWarning] == [11, 12, 13, 14]
    assert UfactoryError(31).manual_name == "C31"
    assert UfactoryWarning(11).manual_name == "W11"
    keys = [fault.key for fault in (*UfactoryError, *UfactoryWarning)]
    assert len(set(keys)) == len(keys)
    for fault in (*UfactoryError, *UfactoryWarning):
        assert fault.cause[0].islower()
        assert fault.remedy.endswith(".")


@needs_library
def test_codes_are_those_of_the_client_library():
    codes = library_module("xarm.core.config.x_code")
    assert {error.value for error in UfactoryError} <= set(codes.ControllerErrorCodeMap)
    assert {warning.value for warning in UfactoryWarning} <= set(codes.ControllerWarnCodeMap)


def test_the_documented_codes_are_all_of_them_with_their_causes_and_remedies():
    text = (Path(__file__).parents[3] / "docs" / "ufactory.md").read_text(encoding="utf-8")
    for fault in (*UfactoryError, *UfactoryWarning):
        is_drive = 11 <= fault.value <= 17 and isinstance(fault, UfactoryError)
        row = f"| C11 to C17 | {UfactoryError.JOINT_1.cause.replace('1', '1 to 7')} | {fault.remedy} |"
        assert (row if is_drive else f"| {fault.manual_name} | {fault.cause} | {fault.remedy} |") in text


def test_the_report_on_a_motion_has_how_often_its_angles_are_sent():
    model = load_model("xArm6")
    report = check(plan_joint(model, model.home, model.home + 0.1, speed=0.2), model)
    assert str(report.title).endswith("of which the angles of every 5 ms are sent")
