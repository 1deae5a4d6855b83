"""The configuration of a robot: tool, load, safety box, force-control frame, soft joint limits, mode parameters.

Values that every maker understands; for None, the controller keeps its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from rcilab.core.arrays import readonly_copy
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.dynamics.payload import Payload

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

SetupPart: TypeAlias = Literal["box", "tool", "load", "force", "joints", "control"]

SETUP_PARTS: tuple[SetupPart, ...] = ("box", "tool", "load", "force")
"""The parts with a position in space."""
_DIGITS = 6  # Of the ratio of jerk to acceleration: the limits after several changes do not depend on their order.
_ALL_PARTS: tuple[SetupPart, ...] = (*SETUP_PARTS, "joints", "control")


class ForceFrame(IntEnum):
    """The reference of a force-control frame's axes."""

    WORLD = 0
    TOOL = 1
    PATH = 2


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ForceControlFrame:
    """The frame in which the controller reports and controls forces."""

    T_flange_force: Pose = IDENTITY
    type: ForceFrame = ForceFrame.WORLD
    """The reference of its axes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SoftJointLimits:
    """Soft limits of the joint angles within the arm's own, n numbers each, [rad]."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]


class ControllerParameters(Mapping[str, tuple[float, ...]]):
    """Parameters of the modes by name of the group; for missing groups, the controller keeps its own.

    The groups `joint_velocity`, `joint_acceleration` and `tool_limits` are bounds of every motion: a model has them,
    see `RobotConfiguration.applied_to`.

    Args:
        groups: Such as `joint_stiffness=(...)`. The groups of an arm: `Maker.parameters`.
    """

    def __init__(self, **groups: tuple[float, ...]) -> None:
        self._groups = groups

    def __getitem__(self, name: str) -> tuple[float, ...]:
        return self._groups[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._groups)

    def __len__(self) -> int:
        return len(self._groups)

    def __repr__(self) -> str:
        return f"ControllerParameters({', '.join(f'{name}={values!r}' for name, values in self.items())})"

    def limited(self, limits: Limits) -> Limits:
        """Returns limits with the bounds among these parameters; a jerk keeps its ratio to the acceleration."""
        joint, tool = limits.joint, limits.cartesian
        if "joint_velocity" in self:
            joint = replace(joint, velocity=readonly_copy(self["joint_velocity"]))
        if "joint_acceleration" in self:
            rise = np.round(joint.jerk / joint.acceleration, _DIGITS)
            acceleration = readonly_copy(self["joint_acceleration"])
            joint = replace(joint, acceleration=acceleration, jerk=readonly_copy(rise * acceleration))
        if "tool_limits" in self:
            v, a, w, alpha = self["tool_limits"]
            tool = replace(
                tool,
                translation_velocity=v,
                translation_acceleration=a,
                translation_jerk=round(tool.translation_jerk / tool.translation_acceleration, _DIGITS) * a,
                rotation_velocity=w,
                rotation_acceleration=alpha,
                rotation_jerk=round(tool.rotation_jerk / tool.rotation_acceleration, _DIGITS) * alpha,
            )
        return (
            limits
            if joint is limits.joint and tool is limits.cartesian
            else replace(limits, joint=joint, cartesian=tool)
        )


def tool_limits_of(limits: Limits) -> tuple[float, ...]:
    """Returns the values of the group `tool_limits`: velocity, acceleration, and those of rotations."""
    tool = limits.cartesian
    return tool.translation_velocity, tool.translation_acceleration, tool.rotation_velocity, tool.rotation_acceleration


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RobotConfiguration:
    """A configuration, or parts of one: for None, the controller keeps its own."""

    box: SafetyBox | None = None
    tool: Pose | None = None
    """Pose of the tool in the flange frame."""
    load: Payload | None = None
    force: ForceControlFrame | None = None
    joints: SoftJointLimits | None = None
    control: ControllerParameters | None = None
    """Parameters of the modes."""

    @property
    def parts(self) -> tuple[SetupPart, ...]:
        """Names of the parts that are not None."""
        return tuple(part for part in _ALL_PARTS if getattr(self, part) is not None)

    def only(self, parts: Iterable[str]) -> RobotConfiguration:
        """Returns a configuration of these parts alone."""
        return RobotConfiguration(**{part: getattr(self, part) for part in _ALL_PARTS if part in parts})

    def without(self, parts: Iterable[str]) -> RobotConfiguration:
        """Returns a configuration without these parts."""
        return self.only(set(_ALL_PARTS) - set(parts))

    def updated(self, newer: RobotConfiguration) -> RobotConfiguration:
        """Returns this configuration with the parts of a newer one."""
        return replace(self, **{part: getattr(newer, part) for part in newer.parts})

    def applied_to(self, model: RobotModel) -> RobotModel:
        """Returns the arm with this tool, this load, these soft limits, and the bounds among these parameters.

        Raises:
            InvalidValueError: The load is heavier than the arm's payload.
        """
        changed = model if self.tool is None else model.with_tool(self.tool)
        changed = changed if self.load is None else changed.with_load(self.load)
        changed = changed if self.control is None else changed.with_limits(self.control.limited(changed.limits))
        return changed if self.joints is None else changed.with_joint_limits(self.joints.lower, self.joints.upper)


def require_setup(setup: object) -> RobotConfiguration:
    """Returns `setup` if it is one.

    Raises:
        InvalidValueError: It is not a configuration.
    """
    if isinstance(setup, RobotConfiguration):
        return setup
    raise InvalidValueError(
        "setup", setup, "is not a RobotConfiguration; RobotConfiguration(tool=..., box=...) makes one"
    )


def send_groups(control: object, requests: Mapping[str, Callable[[tuple[float, ...]], None]]) -> None:
    """Sends each group of parameters by its request, in the order of the requests.

    Args:
        control: The parameters, a `ControllerParameters`.
        requests: The request of each group that the controller has, called with the values of the group.

    Raises:
        InvalidValueError: It is not a ControllerParameters, or the controller has no such group; nothing was sent.
    """
    if not isinstance(control, ControllerParameters):
        problem = "is not a ControllerParameters; ControllerParameters(joint_stiffness=...) makes some"
        raise InvalidValueError("control", control, problem)
    unknown = control.keys() - requests
    if unknown:
        raise InvalidValueError("control", sorted(unknown), f"does not exist; known: {', '.join(requests)}")
    for name, send in requests.items():
        if name in control:
            send(control[name])


def as_whole(name: str, value: float, most: int, least: int = 0) -> int:
    """Returns a parameter that has whole numbers from `least` to `most`.

    Raises:
        InvalidValueError: It is not one.
    """
    if value not in range(least, most + 1):
        raise InvalidValueError(name, value, f"must be a whole number from {least} to {most}")
    return round(value)
