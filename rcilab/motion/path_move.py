"""A move of an imported path, whatever the file that it comes from."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from rcilab.motion.path import Point


@dataclass(frozen=True, slots=True, kw_only=True)
class ArcMove:
    """The arc on which a move leads to its position."""

    via: Point
    """The middle of the arc, [m]."""
    center: Point
    """[m]."""
    axis: Point
    """Unit vector; the arc goes around it by the right-hand rule."""
    angle: float
    """More than 0, up to 2 pi, [rad]."""
    radius: float
    """[m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathMove:
    """A move to a position, in the frame of its file; straight unless it has an arc."""

    line: int
    """Line of the file, from 1."""
    position: Point
    """End of the move, [m]."""
    wxyz: tuple[float, ...] | None = None
    """Orientation of the tool there, a unit quaternion; None: that of the whole path."""
    arc: ArcMove | None = None
    feed: float | None = None
    """Speed of the tool, [m/s]; None: `speed`."""
    speed: float | None = None
    """Part of the limits; None: that of the whole path."""
    dwell: float = 0.0
    """Time at standstill at its end, [s]."""

    def with_dwell(self, time: float) -> PathMove:
        """Returns the move with a longer dwell at its end, by a time, [s]."""
        return replace(self, dwell=self.dwell + time)

    def largest_blend(self, start: Point) -> float:
        """Returns the largest blend radius that fits into half of the move, [m].

        Args:
            start: Where it begins, [m].
        """
        if self.arc is None:
            return 0.5 * math.dist(start, self.position)
        return 2.0 * self.arc.radius * math.sin(0.25 * self.arc.angle)
