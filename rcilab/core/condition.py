"""Conditions on a motion: a quantity between two bounds, its source and the fault it raises; a table for each maker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError
from rcilab.core.fault import FaultCode
from rcilab.core.limits import JointLimits, Limits
from rcilab.core.state import Mode

Necessity: TypeAlias = Literal["necessary", "recommended"]
Stage: TypeAlias = Literal["throughout", "start", "end"]

Signal: TypeAlias = Literal[
    "joint",
    "torque",
    "position",
    "translation",
    "rotation",
    "arm_angle",
    "frame",
    "link_distance",
    "floor_distance",
    "elbow_sign",
    "external_torque",
    "external_force",
    "lost_commands",
]
"""The quantity of a condition: every joint's angle or torque; the tool's position, the norms of its translation and
rotation; the arm angle; the tool's pose as a whole; the smallest distance between links, or from the floor; the side
of the elbow; external torques and force; commands that did not arrive."""

Bounds: TypeAlias = tuple[Array, Array]
"""Lower and upper bound, each of shape (n,) for joints and (1,) for anything else."""

AnyLimits: TypeAlias = Limits | JointLimits
"""All limits of an arm; a condition on joints makes do with those of the joints."""

_PLACES: dict[Signal, str] = {
    "arm_angle": "elbow",
    "elbow_sign": "elbow",
    "link_distance": "links",
    "floor_distance": "links",
    "lost_commands": "network",
}
"""Whose value it is; anything else is the tool's."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Condition:
    """One row of the table."""

    id: str
    """Short stable name, such as "joint.velocity"."""
    quantity: str
    """The quantity in words, such as "commanded velocity"."""
    formula: str
    """As the manual, or the maker's page, prints it."""
    necessity: Necessity
    """The robot stops when a necessary condition is broken."""
    unit: str
    source: str = ""
    """Where condition and bound come from."""
    fault: FaultCode | None = None
    """What the maker's controller raises; None for a recommended condition, and for one that it does not check."""
    stage: Stage
    """When it is checked."""
    signal: Signal = "joint"
    """The signal it is on."""
    order: int
    """Which derivative of the signal it is on: 0 the signal itself, 3 its jerk."""
    bounds: Callable[[AnyLimits], Bounds]
    """Returns its bounds from the limits of an arm."""

    @property
    def is_measured(self) -> bool:
        """Whether it is on measured values, not on commanded ones."""
        return self.id.startswith("measured.")

    @property
    def is_clearance(self) -> bool:
        """Whether it is on distances, which no controller checks: rcilab's own."""
        return self.signal in ("link_distance", "floor_distance")

    @property
    def is_per_joint(self) -> bool:
        """Whether every joint has a value and a bound of its own."""
        return self.signal in ("joint", "torque", "external_torque")

    def place(self, axis: int) -> str:
        """Returns whose value it is, in words: "joint 2", "tool", "elbow", "links", "network"."""
        if self.is_per_joint:
            return f"joint {axis}"
        return _PLACES.get(self.signal, "tool")

    def __repr__(self) -> str:
        return f"<Condition {self.id}: {self.formula} ({self.necessity})>"


def joint_limits(limits: AnyLimits) -> JointLimits:
    """Returns the bounds of the joints."""
    return limits if isinstance(limits, JointLimits) else limits.joint


def all_limits(limits: AnyLimits) -> Limits:
    """Returns the bounds of the whole arm.

    Raises:
        InvalidValueError: They are those of the joints only.
    """
    if isinstance(limits, JointLimits):
        raise InvalidValueError("limits", limits, "are of the joints only; pass model.limits")
    return limits


def same(value: float) -> Bounds:
    """Returns a single pair of bounds around zero."""
    bound = np.array([value])
    return -bound, bound


def tolerance(value: float) -> Callable[[AnyLimits], Bounds]:
    """Returns the function for bounds that are the same for every joint, around zero."""

    def bounds(limits: AnyLimits) -> Bounds:
        bound = np.full(len(joint_limits(limits).velocity), value)
        return -bound, bound

    return bounds


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ConditionTable:
    """The conditions of one maker's interface. Rows on the same quantity have the same id in every table."""

    name: str
    """Of the interface, such as "RCI"."""
    motion: tuple[Condition, ...]
    """For every joint motion."""
    cartesian: tuple[Condition, ...]
    """For a motion that is sent as poses of the tool."""
    torque: tuple[Condition, ...]
    """For a motion that is sent as torques."""
    measured: tuple[Condition, ...]
    """For what the sensors measure."""
    box: Condition
    """For a commanded tool where there is a safety box."""
    conditions: tuple[Condition, ...]
    """Every condition of the interface."""

    def rows(self, mode: Mode, *, has_elbow: bool = True, has_box: bool = False) -> tuple[Condition, ...]:
        """Returns the conditions on a motion in a mode, without those on distances.

        Args:
            mode: How it is commanded.
            has_elbow: Whether the arm has an arm angle.
            has_box: Whether there is a safety box. A motion in torques has no commanded position: the measured one
                is checked.
        """
        if mode == "torque":
            return self.torque + ((self.find("measured.cartesian.position"),) if has_box else ())
        box = (self.box,) if has_box else ()
        if not mode.startswith("cartesian"):
            return self.motion + box
        return tuple(row for row in self.cartesian if has_elbow or row.signal != "arm_angle") + box

    def find(self, name: str) -> Condition:
        """Returns a condition by id.

        Raises:
            InvalidValueError: There is no such condition; the message lists those that exist.
        """
        for row in self.conditions:
            if row.id == name:
                return row
        known = ", ".join(row.id for row in self.conditions)
        raise InvalidValueError("condition", name, f"is unknown to the {self.name}; known: {known}")

    def raising(self, fault: FaultCode) -> tuple[Condition, ...]:
        """Returns the conditions that raise a fault."""
        return tuple(row for row in self.conditions if row.fault is fault)

    def __repr__(self) -> str:
        return f"<ConditionTable of the {self.name}: {len(self.conditions)} conditions, .motion, .find(id)>"
