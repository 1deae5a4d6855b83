"""`check` and the controller have one verdict on a stream that the client library sends: the same code, or none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.command import JointPosition
from rcilab.core.errors import ControlError
from rcilab.execution.session import RobotSession
from rcilab.makers.configuration import RobotConfiguration, SoftJointLimits
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.motion import Motion, plan_joint
from tests.makers.ufactory.driver.conftest import HOME

STRETCHED = np.array([0.0, 0.6, 0.0, 1.8, 0.0, 1.2, 0.0])
ROUNDING = 1e-6  # [rad]
CAUGHT_UP = 400  # [cycles] After the last row.


def turn(start: Array, joint: int, times: Sequence[float], dq: Sequence[float]) -> Array:
    """Returns the rows of a joint, counted from 0, that has these velocities at these times."""
    t = np.arange(0.0, times[-1] + CYCLE_TIME, CYCLE_TIME)
    return start + np.outer(np.cumsum(np.interp(t, times, dq)) * CYCLE_TIME, np.eye(7)[joint])


def raised(robot: RobotSession, rows: Array) -> set[UfactoryError]:
    """Returns the error with which the controller ends a stream; without one the arm has arrived."""

    def stream(state: object, t: float) -> JointPosition:
        row = round(t / CYCLE_TIME)
        return JointPosition(readonly_copy(rows[min(row, len(rows) - 1)]), finished=row >= len(rows) + CAUGHT_UP)

    try:
        robot.control(stream)
    except ControlError as error:
        return {fault for fault in error.faults if isinstance(fault, UfactoryError)}
    assert np.abs(robot.state.q_c - rows[-1]).max() < ROUNDING
    return set()


def named(robot: RobotSession, rows: Array) -> set[UfactoryError]:
    """Returns the errors that the check names."""
    report = check(Motion.from_cycles(rows), robot.model, distance=None)
    return {violation.fault for violation in report.violations if isinstance(violation.fault, UfactoryError)}


def test_a_plan_is_followed(robot: RobotSession) -> None:
    rows = plan_joint(robot.model, robot.state.q_c, HOME + 0.1, speed=0.4).q
    assert raised(robot, rows) == named(robot, rows) == set()


@pytest.mark.parametrize(
    ("row", "times", "dq"),
    [
        ("joint.velocity", (0.0, 0.3, 0.5, 0.8), (0.0, 4.0, 4.0, 0.0)),
        ("joint.acceleration", (0.0, 0.05, 0.3, 0.35), (0.0, 2.5, 2.5, 0.0)),
        ("joint.jerk", (0.0, 0.2, 0.4), (0.0, 2.0, 0.0)),
    ],
)
def test_targets_too_fast_for_a_joint_are_followed_later(
    robot: RobotSession, row: str, times: Sequence[float], dq: Sequence[float]
) -> None:
    rows = turn(robot.state.q_c, 6, times, dq)
    report = check(Motion.from_cycles(rows), robot.model, distance=None)
    assert row in {warning.condition.id for warning in report.warnings}
    assert raised(robot, rows) == named(robot, rows) == set()


def test_targets_too_fast_for_the_tool_are_c60(robot: RobotSession) -> None:
    robot.xarm.move_j(STRETCHED, 3.0, 20.0)
    rows = turn(robot.state.q_c, 0, (0.0, 0.2, 0.5, 0.7), (0.0, 2.8, 2.8, 0.0))
    assert raised(robot, rows) == named(robot, rows) == {UfactoryError.SERVO_LINEAR_SPEED}


def test_targets_out_of_range_are_c23(robot: RobotSession) -> None:
    own = robot.model.limits.joint
    upper = own.upper.copy()
    upper[6] = 0.2
    robot.configure(RobotConfiguration(joints=SoftJointLimits(lower=tuple(own.lower), upper=tuple(upper))))
    rows = turn(robot.state.q_c, 6, (0.0, 0.2, 0.6, 0.8), (0.0, 0.5, 0.5, 0.0))
    try:
        assert raised(robot, rows) == named(robot, rows) == {UfactoryError.JOINT_RANGE}
    finally:
        robot.xarm.set_joint_ranges(own.lower, own.upper)
