"""The parameters of the joints that a client sets and a controller keeps, with the rules for setting them.

A joint with an error takes no new value: its error is cleared first. It must be disabled, too. A value is in force, and
is stored, at once; the joint stays disabled until it is enabled.

There are two sets: of the controller, and of the drives. The stricter one of both is in force.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from rcilab.core.arrays import readonly_copy
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits, Limits
from rcilab.makers.realman.bounds import LARGEST_JOINT_ACCELERATION, LARGEST_JOINT_SPEED
from rcilab.makers.realman.wire.units import (
    angles_from_millidegrees,
    millidegrees_from_angles,
    millirpm_from_speed,
    speed_from_millirpm,
)

RECOMMENDED_RATIO: Final = 1.5
"""Of the largest acceleration [RPM/s] to the largest speed [RPM]; below it a motion may be abnormal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSet:
    """One value a joint, as on the wire."""

    max_speed: tuple[int, ...]
    """[0.001 RPM]."""
    max_acc: tuple[int, ...]
    """[0.001 RPM/s]."""
    min_pos: tuple[int, ...]
    """[0.001 deg]."""
    max_pos: tuple[int, ...]
    """[0.001 deg]."""

    @classmethod
    def of_arm(cls, joint: JointLimits) -> JointSet:
        """Returns the values of a new arm."""
        return cls(
            max_speed=tuple(millirpm_from_speed(value) for value in joint.velocity.tolist()),
            max_acc=tuple(millirpm_from_speed(value) for value in joint.acceleration.tolist()),
            min_pos=tuple(millidegrees_from_angles(joint.lower.tolist())),
            max_pos=tuple(millidegrees_from_angles(joint.upper.tolist())),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class JointParameters:
    """Everything that is stored about the joints."""

    factory: JointSet = field(repr=False)
    """The values of a new arm, which bound the ranges."""
    controller: JointSet
    drive: JointSet
    zero: tuple[float, ...]
    """Angle of the arm's mechanics where a joint reads zero, n numbers, [rad]."""

    @classmethod
    def of_arm(cls, joint: JointLimits) -> JointParameters:
        """Returns the parameters of a new arm."""
        values = JointSet.of_arm(joint)
        return cls(factory=values, controller=values, drive=values, zero=(0.0,) * len(joint.lower))

    def with_value(self, name: str, joint: int, value: int, *, is_drive: bool) -> JointParameters:
        """Returns the parameters with a new value.

        Args:
            name: Field of `JointSet`.
            joint: From 1.
            value: As on the wire.
            is_drive: Whether it is one of the drives.

        Raises:
            InvalidValueError: There is no such joint, or the value is out of its bounds.
        """
        require_joint(joint, len(self.zero))
        before = self.drive if is_drive else self.controller
        index = joint - 1
        if name in ("max_speed", "max_acc"):
            bound = LARGEST_JOINT_SPEED if name == "max_speed" else LARGEST_JOINT_ACCELERATION
            if not 0 < value <= bound:
                raise InvalidValueError(name, value, f"must be above 0, up to {bound}")
        else:
            low, high = self.factory.min_pos[index], self.factory.max_pos[index]
            if name == "min_pos":
                high = min(self.controller.max_pos[index], self.drive.max_pos[index]) - 1
            else:
                low = max(self.controller.min_pos[index], self.drive.min_pos[index]) + 1
            if not low <= value <= high:
                problem = f"must be {low} to {high}, so that controller and drive leave a range"
                raise InvalidValueError(name, value, problem)
        values: tuple[int, ...] = getattr(before, name)
        after = replace(before, **{name: (*values[:index], value, *values[joint:])})
        return replace(self, drive=after) if is_drive else replace(self, controller=after)

    def with_zero(self, joint: int, angle: float) -> JointParameters:
        """Returns the parameters with a joint's zero at an angle of its mechanics, [rad]."""
        return replace(self, zero=(*self.zero[: joint - 1], angle, *self.zero[joint:]))

    def with_factory_ranges(self) -> JointParameters:
        """Returns the parameters with the ranges of the specification, as after auto_set_joint_limit."""
        ranges = {"min_pos": self.factory.min_pos, "max_pos": self.factory.max_pos}
        return replace(self, controller=replace(self.controller, **ranges), drive=replace(self.drive, **ranges))

    def ratio(self, joint: int) -> float:
        """Returns the ratio of largest acceleration to largest speed of a joint, see `RECOMMENDED_RATIO`."""
        return self.controller.max_acc[joint - 1] / self.controller.max_speed[joint - 1]

    def limits(self, limits: Limits) -> Limits:
        """Returns the limits of an arm with the values in force, in the angles that the joints read."""
        both = tuple(
            zip(*((s.max_speed, s.max_acc, s.min_pos, s.max_pos) for s in (self.controller, self.drive)), strict=True)
        )
        speeds, accelerations, lows, highs = both
        joint = limits.joint
        acceleration = [speed_from_millirpm(min(pair)) for pair in zip(*accelerations, strict=True)]
        rise = joint.jerk / joint.acceleration
        return replace(
            limits,
            joint=replace(
                joint,
                velocity=readonly_copy([speed_from_millirpm(min(pair)) for pair in zip(*speeds, strict=True)]),
                acceleration=readonly_copy(acceleration),
                jerk=readonly_copy(rise * acceleration),
                lower=readonly_copy(angles_from_millidegrees(max(pair) for pair in zip(*lows, strict=True))),
                upper=readonly_copy(angles_from_millidegrees(min(pair) for pair in zip(*highs, strict=True))),
            ),
        )


def require_joint(joint: int, n: int) -> int:
    """Returns the number of a joint.

    Raises:
        InvalidValueError: The arm has no such joint.
    """
    if not 1 <= joint <= n:
        raise InvalidValueError("joint", joint, f"must be 1 to {n}")
    return joint
