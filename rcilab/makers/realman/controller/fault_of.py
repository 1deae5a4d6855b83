"""The error of each violation that the virtual arm reports, and of each target that the planner refuses."""

from __future__ import annotations

from collections.abc import Iterable

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.makers.realman.conditions import REALMAN_CONDITIONS
from rcilab.makers.realman.errors import JOINT_BITS, RealManError
from rcilab.sim.planner import RefusalReason
from rcilab.sim.violations import ArmCondition, ArmViolation, CycleViolation

_ARM_ERRORS = {
    ArmCondition.NO_COLLISION: RealManError.COLLISION,
    ArmCondition.VALID_POSE: RealManError.UNREACHABLE,
}
_FAULTS = {row.id: row.fault for row in REALMAN_CONDITIONS.conditions if isinstance(row.fault, RealManError)}
REFUSALS = {
    RefusalReason.UNREACHABLE: RealManError.UNREACHABLE,
    RefusalReason.SINGULAR: RealManError.UNREACHABLE,
    RefusalReason.JOINT_RANGE: RealManError.TARGET_OVER_LIMIT,
    RefusalReason.GEOMETRY: RealManError.CIRCLE,
}


def errors_of(violations: Iterable[CycleViolation]) -> list[tuple[RealManError, int]]:
    """Returns the errors of one cycle's violations, each with its joint, or 0 for one of the whole system."""
    found: list[tuple[RealManError, int]] = []
    for violation in violations:
        joint = 0
        if isinstance(violation, ArmViolation):
            error = _ARM_ERRORS.get(violation.condition, RealManError.PLANNER_KERNEL)
        else:
            error = _FAULTS.get(violation.condition.id) or RealManError.PLANNER_KERNEL
            joint = _joint_of(violation, error)
        if (error, joint) not in found:
            found.append((error, joint))
    return found


def _joint_of(violation: LimitViolation, error: RealManError) -> int:
    return violation.axis if error in JOINT_BITS else 0
