"""What a planner moves to: values of a client's motion commands, each with its own speed and blend."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from rcilab.core.spatial import Pose

PoseFrame: TypeAlias = Literal["base", "tool", "offset"]
"""Axes in which a pose is given: the base, or the tool at the end of the target before. An offset shifts and turns that
tool in the axes of the base."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSpeed:
    """Bounds of the joints; a number is for every joint. None, and what is above the arm's limits: those limits."""

    velocity: float | tuple[float, ...] | None = None
    """Above zero, [rad/s]."""
    acceleration: float | tuple[float, ...] | None = None
    """Above zero, [rad/s^2]."""
    jerk: float | tuple[float, ...] | None = None
    """Above zero, [rad/s^3]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolSpeed:
    """Bounds of the tool; None, and what is above the arm's limits: those limits."""

    velocity: float | None = None
    """Above zero, [m/s]."""
    acceleration: float | None = None
    """Above zero, [m/s^2]."""
    jerk: float | None = None
    """Above zero, [m/s^3]."""
    rotation_velocity: float | None = None
    """Above zero, [rad/s]."""
    rotation_acceleration: float | None = None
    """Above zero, [rad/s^2]."""
    rotation_jerk: float | None = None
    """Above zero, [rad/s^3]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Blend:
    """How the corner at the end of a target is rounded, if the next target is known in time; not at all by default."""

    radius: float = 0.0
    """Distance of the tool from the corner at which the curve leaves the path, [m]; half of either path at most."""
    share: float = 0.0
    """The same as a part of half of the shorter path, 0 to 1; applies where `radius` is 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTarget:
    """A straight line in joint space."""

    id: int
    """Number of the client, returned with the events of the target; need not be unique."""
    q: tuple[float, ...] | None = None
    """Joint angles at the end, n numbers, [rad]; None: those of `pose` that are nearest to the start."""
    pose: Pose | None = None
    """Pose of the tool at the end; None: `q` is given."""
    is_relative: bool = False
    """Whether `q` is added to the joint angles at the end of the target before."""
    frame: PoseFrame = "base"
    """Axes of `pose`."""
    speed: JointSpeed = field(default_factory=JointSpeed)
    blend: Blend = field(default_factory=Blend)


@dataclass(frozen=True, slots=True, kw_only=True)
class LineTarget:
    """A straight line of the tool; the orientation turns uniformly, in the shorter direction."""

    id: int
    pose: Pose
    """Pose of the tool at the end."""
    frame: PoseFrame = "base"
    """Axes of `pose`."""
    speed: ToolSpeed = field(default_factory=ToolSpeed)
    blend: Blend = field(default_factory=Blend)


@dataclass(frozen=True, slots=True, kw_only=True)
class ArcTarget:
    """An arc, or a circle, through the positions of start, `via` and `pose`.

    Without `angle` it ends at `pose`, with its orientation. With an angle it goes round that far, one turn or several,
    with the orientation of the start.
    """

    id: int
    via: Pose
    pose: Pose
    angle: float | None = None
    """How far it goes around the centre, above zero, [rad]; None: from the start through `via` to `pose`."""
    frame: PoseFrame = "base"
    """Axes of both poses."""
    speed: ToolSpeed = field(default_factory=ToolSpeed)
    blend: Blend = field(default_factory=Blend)


@dataclass(frozen=True, slots=True, kw_only=True)
class SplineTarget:
    """A smooth curve of the tool through poses."""

    id: int
    poses: tuple[Pose, ...]
    """Poses in their order, without the start; at least one."""
    speed: ToolSpeed = field(default_factory=ToolSpeed)


@dataclass(frozen=True, slots=True, kw_only=True)
class PauseTarget:
    """Standstill for a time."""

    id: int
    seconds: float
    """0 or more, [s]."""


Target: TypeAlias = JointTarget | LineTarget | ArcTarget | SplineTarget | PauseTarget
