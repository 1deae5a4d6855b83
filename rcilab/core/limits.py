"""The limits of an arm, each with its source."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf
from types import MappingProxyType
from typing import Literal

import numpy as np

from rcilab.core.arrays import Array, JointVector
from rcilab.core.errors import InvalidValueError

_ROUNDING = (
    1e-6  # [rad] Soft limits that are this close to the arm's own limits equal them: they are converted from degrees.
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class EndVelocity:
    """Velocity bounds that decrease towards the ends of the joints' ranges.

    At a distance d from the end, a joint may approach it with sqrt(2 deceleration d) - offset, or not at all where that
    is negative: slowly enough to brake with this deceleration. Its velocity away from the end is not affected.
    """

    offset: JointVector
    """Shape (n,), [rad/s]."""
    deceleration: JointVector
    """Shape (n,), [rad/s^2]."""
    rounding: JointVector
    """Velocity that a standing joint seems to have by the rounding of the state, shape (n,), [rad/s]. The check allows
    it where the bound is lower: where that is zero, no command would be below it."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class JointLimits:
    """Bounds of the joints, each of shape (n,)."""

    lower: JointVector
    """Smallest joint angle, [rad]."""
    upper: JointVector
    """Largest joint angle, [rad]."""
    velocity: JointVector
    """Largest speed, [rad/s]."""
    acceleration: JointVector
    """Largest acceleration, [rad/s^2]."""
    jerk: JointVector
    """Largest jerk, [rad/s^3]."""
    torque: JointVector
    """Largest commanded torque, [N m]."""
    torque_rate: JointVector
    """Largest rate of the commanded torque, [N m/s]."""
    collision_threshold: JointVector
    """Largest threshold that `setCollisionBehavior` accepts, [N m]."""
    stiffness: JointVector
    """Largest stiffness that `setJointImpedance` accepts, [N m/rad]."""
    own: JointLimits | None = None
    """The arm's own limits if soft limits of the joint angles are set; else None."""
    near_ends: EndVelocity | None = None
    """How `velocity` decreases towards the ends of the arm's own range; None: it does not."""

    def velocity_bounds(self, q: Array) -> tuple[Array, Array]:
        """Returns the smallest and the largest velocity at joint angles, by the maker's formula.

        Args:
            q: Joint angles one cycle before, shape (n,) or (N, n), [rad]: the last command, which a controller reports.

        Returns:
            Both of the shape of q, [rad/s]; zero next to an end.
        """
        if self.near_ends is None:
            bound = np.broadcast_to(self.velocity, q.shape)
            return -bound, bound
        own = self if self.own is None else self.own
        offset, twice = self.near_ends.offset, 2.0 * self.near_ends.deceleration
        down, up = (
            np.clip(np.sqrt(np.maximum(twice * room, 0.0)) - offset, 0.0, self.velocity)
            for room in (q - own.lower, own.upper - q)
        )
        return -down, up

    def in_mode(self, mode: str) -> JointLimits:
        """Returns the limits to which curves of a motion are compared.

        Commanded torques have no joint angles: their velocities are bounded where they are measured, everywhere alike.

        Args:
            mode: Control mode, such as "torque"; "" if it is not known.
        """
        return replace(self, near_ends=None) if mode == "torque" else self

    def checked_velocity_bounds(self, q: Array) -> tuple[Array, Array]:
        """Returns the bounds of the check, and of plans: as `velocity_bounds`, but at least `EndVelocity.rounding`."""
        lower, upper = self.velocity_bounds(q)
        if self.near_ends is None:
            return lower, upper
        return np.minimum(lower, -self.near_ends.rounding), np.maximum(upper, self.near_ends.rounding)

    def __repr__(self) -> str:
        hidden = ("own",) if self.near_ends is not None else ("own", "near_ends")
        names = ", ".join(name for name in self.__slots__ if name not in hidden)
        return f"<JointLimits of {len(self.velocity)} joints: {names}>"

    def is_soft(self, joint: int, side: Literal["lower", "upper"]) -> bool:
        """Returns whether a soft limit bounds the angle of a joint, counted from 1, on this side."""
        if self.own is None:
            return False
        inwards = getattr(self, side)[joint - 1] - getattr(self.own, side)[joint - 1]
        return bool((inwards if side == "lower" else -inwards) > _ROUNDING)

    def is_own(self, joint: int, bound: float) -> bool:
        """Returns whether a bound of the angle of a joint, counted from 1, is the arm's own, not one that was set."""
        own = self.own
        return own is None or min(abs(bound - angle[joint - 1]) for angle in (own.lower, own.upper)) <= _ROUNDING

    def exceeded_soft_limit(self, joint: int, angle: float) -> float | None:
        """Returns the soft limit that an angle of a joint, counted from 1, reaches or exceeds, [rad], or None."""
        lower, upper = float(self.lower[joint - 1]), float(self.upper[joint - 1])
        if angle <= lower:
            return lower if self.is_soft(joint, "lower") else None
        return upper if angle >= upper and self.is_soft(joint, "upper") else None


@dataclass(frozen=True, slots=True, kw_only=True)
class CartesianLimits:
    """Bounds of the tool's motion."""

    translation_velocity: float
    """[m/s]."""
    translation_acceleration: float
    """[m/s^2]."""
    translation_jerk: float
    """[m/s^3]."""
    rotation_velocity: float
    """[rad/s]."""
    rotation_acceleration: float
    """[rad/s^2]."""
    rotation_jerk: float
    """[rad/s^3]."""
    translation_stiffness: float
    """Largest stiffness that `setCartesianImpedance` accepts, [N/m]."""
    rotation_stiffness: float
    """[N m/rad]."""
    force: float
    """Largest desired force of the Cartesian impedance, [N]."""
    moment: float
    """[N m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ArmAngleLimits:
    """Bounds of the arm angle of a 7-axis arm."""

    velocity: float
    """[rad/s]."""
    acceleration: float
    """[rad/s^2]."""
    jerk: float
    """[rad/s^3]."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Limits:
    """All bounds of one arm."""

    joint: JointLimits
    cartesian: CartesianLimits
    arm_angle: ArmAngleLimits | None
    """None for an arm without a redundant joint."""
    joint_tool_velocity: float = inf
    """Of the tool in motions that are commanded in joint angles, [m/s]; infinite where the interface has no bound."""
    sources: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """Source of each limit, by dotted name."""

    def __repr__(self) -> str:
        arm_angle = "" if self.arm_angle is None else ", .arm_angle"
        return f"<Limits of {len(self.joint.velocity)} joints: .joint, .cartesian{arm_angle}, .source(name)>"

    def source(self, name: str) -> str:
        """Returns the source of a limit.

        Args:
            name: Dotted name of the limit, such as "joint.velocity".

        Raises:
            InvalidValueError: There is no such limit; the message lists those that exist.
        """
        try:
            return self.sources[name]
        except (KeyError, TypeError):
            raise InvalidValueError("limit", name, f"is unknown; known: {', '.join(self.sources)}") from None
