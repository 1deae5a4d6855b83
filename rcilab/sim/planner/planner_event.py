"""What a planner reports to its controller, cycle by cycle."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from rcilab.i18n.translator import Remark


class RefusalReason(Enum):
    """Why a target is not followed."""

    UNREACHABLE = "a pose is out of reach"
    SINGULAR = "the arm would be at a singularity"
    JOINT_RANGE = "a joint would leave its range"
    STEP = "a streamed pose is too far from the last one"
    GEOMETRY = "the poses do not give a path"


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusal:
    """Where and why a target cannot be followed."""

    reason: RefusalReason
    remark: Remark
    """As a sentence, with the values."""
    share: float = 0.0
    """Where on the path of the target, 0 to 1; 1 if its end has no joint angles, wherever the path leaves the reach."""
    joint: int | None = None
    """Number of the joint, from 1, for JOINT_RANGE."""
    value: float | None = None
    """Its angle there, [rad]; for STEP the distance, [m]."""
    bound: float | None = None
    """The end of its range, [rad]; for STEP the largest distance, [m]."""


class EventKind(Enum):
    """What happens to a target."""

    BEGAN = "began"
    REACHED = "reached"
    DISCARDED = "discarded"
    """By a stop, by `clear`, or by the refusal of a target before it."""
    REFUSED = "refused"


class PlannerEvent(NamedTuple):
    """An event of one target, in the cycle in which it happens."""

    id: int
    """As in the target."""
    kind: EventKind
    refusal: Refusal | None = None
    """For REFUSED."""


class PlannerStep(NamedTuple):
    """The result of one cycle."""

    q: list[float]
    """Joint angles to command, n plain floats, [rad]."""
    events: tuple[PlannerEvent, ...] = ()
    """In their order."""
