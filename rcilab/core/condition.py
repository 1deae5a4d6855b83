"""Conditions on a motion: a quantity, its bounds, source and fault. Each maker has a table of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError
from rcilab.core.fault import FaultCode
from rcilab.core.limits import JointLimits, Limits
from rcilab.core.state import MODES, Mode

Necessity: TypeAlias = Literal["necessary", "recommended"]
Stage: TypeAlias = Literal["throughout", "start", "end"]

Signal: TypeAlias = Literal[
    "joint",
    "joint_step",
    "torque",
    "position",
    "translation",
    "rotation",
    "arm_angle",
    "frame",
    "link_distance",
    "floor_distance",
    "cell_distance",
    "elbow_sign",
    "external_torque",
    "external_force",
    "lost_commands",
]
"""The quantity of a condition: every joint's angle, its step from one command to the next, or its torque; the tool's
position, the norms of its translation and rotation; the arm angle; the tool's pose as a whole; the smallest distance
between links, from the floor, or from the obstacles of a cell; the sign of the elbow angle; external torques and force;
commands that did not arrive."""

Bounds: TypeAlias = tuple[Array, Array]
"""Lower and upper bound, each of shape (n,) for joints and (1,) for anything else."""

AnyLimits: TypeAlias = Limits | JointLimits
"""All limits of an arm; for a condition on joints, those of the joints are enough."""

_LOCATIONS: dict[Signal, str] = {
    "arm_angle": "elbow",
    "elbow_sign": "elbow",
    "link_distance": "links",
    "floor_distance": "links",
    "cell_distance": "links",
    "lost_commands": "network",
}
"""Part of the arm that a signal belongs to; any other signal belongs to the tool."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Condition:
    """One row of the table."""

    id: str
    """Short stable name, such as "joint.velocity"."""
    quantity: str
    """Name of the quantity, such as "commanded velocity"."""
    formula: str
    """As printed in the maker's manual or on its website."""
    necessity: Necessity
    """The robot stops when a necessary condition is violated."""
    unit: str
    source: str = ""
    """Source of condition and bound."""
    fault: FaultCode | None = None
    """Fault of the maker's controller; None for a recommended condition and for one that it does not check."""
    stage: Stage
    """When it is checked."""
    signal: Signal = "joint"
    """The signal it bounds."""
    part: str = ""
    """Part of the arm that its value belongs to, where that does not follow from the signal."""
    order: int
    """Derivative of the signal that it bounds: 0 the signal itself, 3 its jerk."""
    bounds: Callable[[AnyLimits], Bounds]
    """Computes its bounds from the limits of an arm."""
    bounds_at: Callable[[JointLimits, Array], Bounds] | None = None
    """Computes its bounds at the joint angles of the cycle before, shape (N, n), [rad]; None if they do not depend on
    them. `bounds` are then the widest ones."""

    def depends_on_angles(self, limits: JointLimits) -> bool:
        """Returns whether its bounds depend on the joint angles, with these limits."""
        return self.bounds_at is not None and limits.near_ends is not None

    @property
    def is_measured(self) -> bool:
        """Whether it bounds measured values, not commanded ones."""
        return self.id.startswith("measured.")

    @property
    def is_clearance(self) -> bool:
        """Whether it bounds distances, which only rcilab checks and no controller."""
        return self.signal in ("link_distance", "floor_distance", "cell_distance")

    @property
    def is_per_joint(self) -> bool:
        """Whether every joint has its own value and bound."""
        return self.signal in ("joint", "joint_step", "torque", "external_torque")

    @property
    def is_rate(self) -> bool:
        """Whether it bounds how fast something changes during the motion."""
        return self.order > 0 and self.stage == "throughout"

    def location(self, axis: int) -> str:
        """Returns the part of the arm that the value belongs to: "joint 2", "tool", "elbow", "links", "network".

        Axis 0 of a condition on joints: "joints", where it is not known which.
        """
        if self.is_per_joint:
            return f"joint {axis}" if axis else "joints"
        return self.part or _LOCATIONS.get(self.signal, "tool")

    def __repr__(self) -> str:
        return f"<Condition {self.id}: {self.formula} ({self.necessity})>"


def joint_limits(limits: AnyLimits) -> JointLimits:
    """Returns the bounds of the joints."""
    return limits if isinstance(limits, JointLimits) else limits.joint


def all_limits(limits: AnyLimits) -> Limits:
    """Returns the bounds of the whole arm.

    Raises:
        InvalidValueError: They are the limits of the joints only.
    """
    if isinstance(limits, JointLimits):
        raise InvalidValueError("limits", limits, "must not be those of the joints only; pass model.limits")
    return limits


def symmetric_bounds(value: float) -> Bounds:
    """Returns the bounds -value and value, each of shape (1,)."""
    bound = np.array([value])
    return -bound, bound


def joint_tolerance(value: float) -> Callable[[AnyLimits], Bounds]:
    """Returns a function that computes the bounds -value and value for every joint."""

    def bounds(limits: AnyLimits) -> Bounds:
        bound = np.full(len(joint_limits(limits).velocity), value)
        return -bound, bound

    return bounds


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ConditionTable:
    """The conditions of one maker's interface. Conditions on the same quantity have the same id in every table."""

    name: str
    """Name of the interface, such as "RCI"."""
    motion: tuple[Condition, ...]
    """For every joint motion."""
    cartesian: tuple[Condition, ...]
    """For a motion sent as poses of the tool."""
    torque: tuple[Condition, ...]
    """For a motion sent as torques."""
    measured: tuple[Condition, ...]
    """For measured values."""
    box: Condition
    """For the commanded tool position with a safety box."""
    conditions: tuple[Condition, ...]
    """Every condition of the interface."""
    command_cycles: int = 1
    """Cycles from one command of a motion to the next: of its rows, only every so many are sent."""
    modes: tuple[Mode, ...] = MODES
    """Modes in which it has conditions; `check` refuses others."""
    has_free_elbow: bool = False
    """Whether poses without an arm angle leave it free: the joints move least. Otherwise the arm angle is held."""
    sends_arm_angle: bool = True
    """Whether a session sends the arm angle with poses, as far as the arm has one."""

    def rows(self, mode: Mode, *, has_elbow: bool = True, has_box: bool = False) -> tuple[Condition, ...]:
        """Returns the conditions on a motion in a mode, except those on distances.

        Args:
            mode: Command mode of the motion.
            has_elbow: Whether the arm has an arm angle.
            has_box: Whether there is a safety box. A torque motion has no commanded position: its measured one is
                checked.
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
