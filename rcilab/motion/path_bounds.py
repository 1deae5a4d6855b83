"""Bounds of a path on the rate of its parameter s, at knots along the path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array

MIN_SLOPE = 1e-12
"""A derivative by s below which a row imposes no bound; also the smallest square of s'."""
_HALF_PLANES = 12
"""Number of pairs of half-planes that approximate a bound on a norm; they lose 0.9 %."""
POLYGON_FACTOR = math.cos(math.pi / (2.0 * _HALF_PLANES))
"""Factor on a bound on a norm for which the corners of the polygon of half-planes are inside it."""
_ANGLES = np.arange(_HALF_PLANES) * math.pi / _HALF_PLANES - math.pi / 2.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PathBounds:
    """Bounds at K + 1 knots: s'' between slope x -+ offset for each of m rows, and x = s'^2 up to `max_squares`."""

    knots: Array
    """Values of s, increasing, first 0, shape (K + 1,)."""
    offset: Array
    """Half the width of the range of s'', shape (m, K + 1), [1/s^2]."""
    slope: Array
    """Change of the range's centre with x, shape (m, K + 1)."""
    max_squares: Array
    """Largest x, shape (K + 1,), [1/s^2]."""

    def slowed(self, factor: Array) -> PathBounds:
        """Returns the bounds if each knot is passed slower by a factor of 1 or more, shape (K + 1,)."""
        squares = factor**2
        return PathBounds(
            knots=self.knots, offset=self.offset / squares, slope=self.slope, max_squares=self.max_squares / squares
        )  # fmt: skip


def path_bounds(knots: Array, first: Array, second: Array, acceleration: Array, fastest: Array) -> PathBounds:
    """Returns the bounds of m rows whose acceleration is first s'' + second s'^2.

    Args:
        knots: Values of s, increasing, first 0, shape (K + 1,).
        first: Derivatives of the rows by s, shape (m, K + 1).
        second: Second derivatives by s, shape (m, K + 1).
        acceleration: Bounds on the rows' acceleration, shape (m, K + 1) or (m, 1), [unit/s^2].
        fastest: Largest s' that other bounds allow, shape (K + 1,), [1/s].
    """
    size = np.maximum(np.abs(first), MIN_SLOPE)
    offset = acceleration / size
    slope = -second / np.copysign(size, first)
    return PathBounds(
        knots=knots, offset=offset, slope=slope, max_squares=np.minimum(_max_squares(offset, slope), fastest**2)
    )


def half_planes(first: Array, second: Array) -> tuple[Array, Array]:
    """Returns rows that bound the norm of first s'' + second s'^2 if each is bounded by it times `POLYGON_FACTOR`.

    Args:
        first: Vectors, shape (K + 1, d).
        second: Vectors, shape (K + 1, d).

    Returns:
        Rows of first and second, each of shape (sides, K + 1).
    """
    # In the plane of both vectors: components of the second along and across the first.
    length = np.sqrt((first * first).sum(axis=1))
    along = (first * second).sum(axis=1) / np.maximum(length, MIN_SLOPE)
    across = np.sqrt(np.maximum((second * second).sum(axis=1) - along * along, 0.0))
    c, s = np.cos(_ANGLES), np.sin(_ANGLES)
    return np.outer(c, length), np.outer(c, along) + np.outer(s, across)


def _max_squares(offset: Array, slope: Array) -> Array:
    """Returns the largest x at each knot for which some s'' satisfies every row, shape (K + 1,)."""
    # Beyond slope_i x - offset_i = slope_j x + offset_j the ranges of two rows do not overlap.
    max_squares = np.full(slope.shape[1], MIN_SLOPE)
    for i in range(len(slope) - 1):
        pairs = np.abs(slope[i] - slope[i + 1 :]) / (offset[i] + offset[i + 1 :])
        np.maximum(max_squares, pairs.max(axis=0), out=max_squares)
    return 1.0 / max_squares
