"""The error of each violation that the virtual arm reports."""

from __future__ import annotations

from collections.abc import Iterable

from rcilab.core.condition import ConditionTable
from rcilab.makers.franka.errors import FrankaError
from rcilab.sim.violations import ArmCondition, ArmViolation, CycleViolation

_ARM_ERRORS = {
    ArmCondition.FINITE_VELOCITIES: FrankaError.JOINT_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION,
    ArmCondition.FINITE_TWIST: FrankaError.CARTESIAN_MOTION_GENERATOR_VELOCITY_LIMITS_VIOLATION,
    ArmCondition.FINITE_TORQUES: FrankaError.CONTROLLER_TORQUE_DISCONTINUITY,
    ArmCondition.VALID_POSE: FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME_FLAG,
    ArmCondition.ARM_ANGLE_RANGE: FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION,
    ArmCondition.ELBOW_SIDE: FrankaError.CARTESIAN_MOTION_GENERATOR_ELBOW_SIGN_INCONSISTENT,
    ArmCondition.COMMANDS_ARRIVE: FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION,
    ArmCondition.NO_COLLISION: FrankaError.JOINT_REFLEX,
}


def errors_of(
    violations: Iterable[CycleViolation], table: ConditionTable, *, is_cartesian: bool
) -> tuple[FrankaError, ...]:
    """Returns the errors of violations, in the order of their flags and once each.

    Args:
        violations: Of one cycle.
        table: The conditions of the arm.
        is_cartesian: Whether poses or twists are commanded: the conditions of the joints are then those of the inverse.
    """
    found: set[FrankaError] = set()
    names = {row.id: row.fault for row in table.conditions}
    for violation in violations:
        if isinstance(violation, ArmViolation):
            if violation.condition is ArmCondition.START_TOLERANCE:
                return (_start_error(is_cartesian),)
            if violation.condition is ArmCondition.START_ARM_ANGLE:
                return (FrankaError.CARTESIAN_MOTION_GENERATOR_START_ELBOW_INVALID,)
            if violation.condition is not ArmCondition.FINITE_ANGLES:
                found.add(_ARM_ERRORS[violation.condition])
                continue
            name = "joint.position"
        else:
            name = violation.condition.id.replace("arm_angle", "elbow")
        if is_cartesian and name.startswith("joint."):
            name = f"inverse.{name}"
        fault = names.get(name)
        if isinstance(fault, FrankaError):
            found.add(fault)
    return tuple(sorted(found))


def _start_error(is_cartesian: bool) -> FrankaError:
    return (
        FrankaError.CARTESIAN_POSITION_MOTION_GENERATOR_START_POSE_INVALID
        if is_cartesian
        else FrankaError.JOINT_POSITION_MOTION_GENERATOR_START_POSE_INVALID
    )
