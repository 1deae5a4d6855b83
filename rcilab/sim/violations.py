"""Violations reported by a virtual arm: of its maker's condition table, and of conditions of every arm."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple, TypeAlias

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.i18n.translator import Remark


class ArmCondition(Enum):
    """Conditions of the virtual arm of every maker. The maker's controller maps each to one of its faults."""

    FINITE_ANGLES = "commanded joint angles are finite numbers"
    FINITE_VELOCITIES = "commanded joint velocities are finite numbers"
    FINITE_TWIST = "a commanded velocity of the tool is finite numbers"
    FINITE_TORQUES = "commanded joint torques are finite numbers"
    VALID_POSE = "a commanded pose is a pose that the arm can reach without a singularity"
    ARM_ANGLE_RANGE = "a commanded arm angle is within one turn"
    START_TOLERANCE = "a motion begins near the reference"
    """Not a fault by itself, unless the maker has its own tolerance: it explains the limits that the jump violates."""
    START_ARM_ANGLE = "a motion begins near the reference's arm angle"
    """As START_TOLERANCE."""
    ELBOW_SIDE = "the elbow stays on the side of the start"
    """For arms whose maker defines an elbow flip."""
    COMMANDS_ARRIVE = "few commands in a row are lost, and the motion can continue without them"
    NO_COLLISION = "external joint torques stay below the collision thresholds"


class ArmViolation(NamedTuple):
    """A violation of an `ArmCondition`."""

    condition: ArmCondition
    remark: Remark
    """The values of the violation, as a sentence."""


CycleViolation: TypeAlias = LimitViolation | ArmViolation
"""Has a `condition` and a `remark`."""

Violations: TypeAlias = tuple[CycleViolation, ...]


def describe_violations(violations: Iterable[CycleViolation]) -> Remark:
    """Returns the remarks of all violations as one."""
    return Remark.all(violation.remark for violation in violations)
