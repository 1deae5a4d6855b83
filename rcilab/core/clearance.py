"""Clearance between links and to the floor: a condition of rcilab itself, which no controller checks."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

from rcilab.core.arrays import as_number
from rcilab.core.errors import InvalidValueError

ADVISED_DISTANCE = 0.02  # [m]
"""Covers what the capsules do not model: a link's rim (at most 12 mm), cables, the braking distance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearanceLimit:
    """Minimum distances of the capsules around the links from each other and from the floor.

    A motion with a distance of `links`, `floor` or `cell` or less is refused; one with `advised` or less gets a
    recommendation. The floor is a horizontal plane under the whole arm. The base is mounted on it and is not checked.

    Raises:
        InvalidValueError: A number is not finite, or a distance or radius is below 0.
    """

    links: float = 0.0
    """Between any two links that are not neighbours, [m]; at 0 they must not touch."""
    floor: float = 0.0
    """Between a link that moves up or down and the floor, [m]."""
    cell: float = 0.0
    """Between the arm, with what it carries, and the obstacles of a cell, [m]."""
    advised: float = ADVISED_DISTANCE
    """Recommended distance for all of them, [m]."""
    floor_height: float | None = 0.0
    """Height of the floor in the base frame, [m]; None without a floor, as under a ceiling."""
    tool_radius: float | None = None
    """Radius of the tool's capsule, from the flange to the origin of the tool, [m]; None: the tool is not checked."""

    def __post_init__(self) -> None:
        """Checks the values."""
        for name in ("links", "floor", "cell", "advised", "floor_height", "tool_radius"):
            value = getattr(self, name)
            if value is None and name in ("floor_height", "tool_radius"):
                continue
            number = as_number(value, name, "m")
            if not isfinite(number):
                raise InvalidValueError(name, number, "must be finite [m]")
            if number < 0.0 and name != "floor_height":
                raise InvalidValueError(name, number, "must not be below 0 [m]")
            object.__setattr__(self, name, number)


STANDARD_DISTANCE = ClearanceLimit()
"""Links that touch neither each other nor a floor at height 0, with 20 mm recommended."""

FLOOR = -1
"""Link number of the floor."""
TOOL = -2
"""Link number of the tool."""
PART = -3
"""Link number of the part that the tool holds."""
OBSTACLE = -10
"""Link number of the first obstacle of a cell; the next ones have -11, -12, ..."""


class LinkPair(NamedTuple):
    """The two links of a distance: 0 is the base, n the last link; also `TOOL`, `PART`, `FLOOR` and obstacles."""

    first: int
    second: int
    obstacle: str = ""
    """Name of the second if it is an obstacle."""

    def __str__(self) -> str:
        return f"{link_name(self.first)} and {self.obstacle or link_name(self.second)}"


def link_name(number: int) -> str:
    """Returns the name of a link by its number; see `LinkPair`."""
    return {FLOOR: "floor", TOOL: "tool", PART: "part", 0: "base"}.get(number, f"link {number}")
