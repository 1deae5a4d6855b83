"""The types of waypoints: which fields each has, and the ranges of their numbers."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from rcilab.motion.path import CircleOrientation, ElbowDirection

WaypointType: TypeAlias = Literal[
    "joint", "line", "arc", "circle", "nullspace", "free", "retreat",
    "wait", "input", "output", "tool", "repeat", "group", "end", "comment",
]  # fmt: skip

MAX_COORDINATE = 10.0
"""Largest coordinate, [m]: far beyond the reach of an arm; a larger one is probably in millimetres."""
LARGEST_BLEND = 1.0
"""Largest blend radius, [m]: about the reach of an arm."""
LARGEST_OFFSET = 1.0
"""Largest distance of an approach or a retreat, [m]."""
LONGEST_DWELL = 3600.0
"""Longest dwell at a waypoint, [s]."""

LONGEST_TEXT = 200
"""Longest comment or name of a group, [characters]."""
MOST_REPEATS = 1000
"""Largest number of repetitions."""
DEFAULT_TIMEOUT = 10.0
"""Default time to wait for an input, [s]."""

COMMON_FIELDS = ("speed", "blend", "dwell")
"""Fields with a default; those of every motion."""
_TARGET = ("q", "position", "wxyz", "frame", "psi")
ALLOWED: dict[WaypointType, tuple[str, ...]] = {
    "joint": (*_TARGET, "approach", *COMMON_FIELDS),
    "line": (*_TARGET, "approach", *COMMON_FIELDS),
    "arc": ("via", "via_wxyz", *_TARGET, *COMMON_FIELDS),
    "circle": ("center", "axis", "frame", "angle", "orientation", "psi", *COMMON_FIELDS),
    "nullspace": ("psi", "way", *COMMON_FIELDS),
    "free": (*_TARGET, "approach", *COMMON_FIELDS),
    "retreat": ("distance", *COMMON_FIELDS),
    "wait": ("dwell",),
    "input": ("signal", "level", "timeout"),
    "output": ("signal", "level"),
    "tool": ("jaws", "signal", "dwell"),
    "repeat": ("count", "signal", "level", "text"),
    "group": ("text",),
    "end": (),
    "comment": ("text",),
}
"""Fields of a waypoint by type."""
INSTRUCTIONS: tuple[WaypointType, ...] = ("wait", "input", "output", "tool", "repeat", "group", "end", "comment")
"""Types of steps at which nothing moves."""
BLOCKS: tuple[WaypointType, ...] = ("repeat", "group")
"""Types that begin a block, which "end" ends."""
REQUIRED: dict[WaypointType, tuple[str, ...]] = {
    "joint": (),
    "line": (),
    "arc": ("via",),
    "circle": ("center", "axis"),
    "nullspace": ("psi",),
    "free": (),
    "retreat": ("distance",),
    "wait": (),
    "input": ("signal",),
    "output": ("signal",),
    "tool": (),
    "repeat": ("count",),
    "group": (),
    "end": (),
    "comment": ("text",),
}
"""Required fields in addition to a target; the target of joint, line, arc and free is q, or position and wxyz."""

CHOICES: dict[str, tuple[str, ...]] = {
    "orientation": get_args(CircleOrientation),
    "way": get_args(ElbowDirection),
    "jaws": ("close", "open"),
}
"""Values of the fields that have a fixed set of them; the first is the default."""
LAST_SIGNAL = 1023
"""Largest number of a signal."""

Floats: TypeAlias = tuple[float, ...]

MOST_WAYPOINTS = 10_000
"""Largest number of waypoints; a motion through them takes a gigabyte."""
