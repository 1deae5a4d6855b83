"""How far the links shall stay from each other and from the floor: rcilab's own condition, no controller checks it."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

from rcilab.core.arrays import as_number
from rcilab.core.errors import InvalidValueError

ADVISED_DISTANCE = 0.02  # [m]
"""What is left to what the capsules do not cover: a link's rim (at most 12 mm), cables, a brake's way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearanceLimit:
    """How far the capsules around the links shall stay from each other and from the floor.

    A motion that comes as near as `links` or `floor` is refused; one that comes as near as `advised` is advised
    against. The floor is a horizontal plane under the whole arm; the base stands on it and is not compared with it.

    Raises:
        InvalidValueError: A number is not finite, or a distance or radius is below 0.
    """

    links: float = 0.0
    """Between any two links that are not neighbours, [m]; at 0 they must not touch."""
    floor: float = 0.0
    """Between a link that moves up or down and the floor, [m]."""
    advised: float = ADVISED_DISTANCE
    """What is recommended for both, [m]."""
    floor_height: float | None = 0.0
    """Height of the floor in the base frame, [m]; None without a floor, as under a ceiling."""
    tool_radius: float | None = None
    """Radius of a capsule from the flange to the origin of the tool that counts as a link, [m]; None: the tool has no
    body."""

    def __post_init__(self) -> None:
        """Checks the values."""
        for name in ("links", "floor", "advised", "floor_height", "tool_radius"):
            value = getattr(self, name)
            if value is None and name in ("floor_height", "tool_radius"):
                continue
            number = as_number(value, name, "m")
            if not isfinite(number):
                raise InvalidValueError(name, number, "must be finite [m]")
            if number < 0.0 and name != "floor_height":
                raise InvalidValueError(name, number, "m must not be below 0")
            object.__setattr__(self, name, number)


STANDARD_DISTANCE = ClearanceLimit()
"""Links that do not touch each other nor a floor at height 0, with 20 mm recommended."""

FLOOR = -1
"""Stands for the floor where a link's number is expected."""
TOOL = -2
"""Stands for the tool where a link's number is expected."""


class LinkPair(NamedTuple):
    """The two links of a distance: 0 is the base, n the last link; or `TOOL`, or `FLOOR`."""

    first: int
    second: int

    def __str__(self) -> str:
        return f"{link_name(self.first)} and {link_name(self.second)}"


def link_name(number: int) -> str:
    """Returns a link's name in words by its number; see `LinkPair`."""
    return {FLOOR: "floor", TOOL: "tool", 0: "base"}.get(number, f"link {number}")
