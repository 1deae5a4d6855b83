"""What a virtual arm reports as wrong: rows of its maker's condition table, and conditions that need no table."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple, TypeAlias

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.i18n.translator import Remark


class ArmCondition(Enum):
    """What the virtual arm of every maker checks. The maker's controller maps each to a fault of its own."""

    FINITE_ANGLES = "commanded joint angles are finite numbers"
    FINITE_TORQUES = "commanded joint torques are finite numbers"
    VALID_POSE = "a commanded pose is a pose that the arm can reach without a singularity"
    ARM_ANGLE_RANGE = "a commanded arm angle is within one turn"
    START_TOLERANCE = "a motion begins near the reference"
    """No fault by itself: it explains the limits that the jump violates."""
    COMMANDS_ARRIVE = "few commands in a row are lost, and the motion can go on without them"
    NO_COLLISION = "external joint torques stay below the collision thresholds"


class ArmViolation(NamedTuple):
    """A violation of an `ArmCondition`."""

    condition: ArmCondition
    remark: Remark
    """The values that violate it, as a sentence."""


CycleViolation: TypeAlias = LimitViolation | ArmViolation
"""Has a `condition` and a `remark`."""

Violations: TypeAlias = tuple[CycleViolation, ...]


def describe_violations(violations: Iterable[CycleViolation]) -> Remark:
    """Returns all of them in one line."""
    return Remark.all(violation.remark for violation in violations)
