"""Bounds of a path on the rate of its parameter s, at knots along the path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array

LEAST = 1e-12
"""A slope by s below which a row bounds nothing, and the least square of s'."""
_SIDES = 12
"""Half-planes on each side in place of a round bound; they lose 0.9 %."""
ROUNDNESS = math.cos(math.pi / (2.0 * _SIDES))
"""By what a round bound is multiplied so that the corners between its half-planes are inside it."""
_ANGLES = np.arange(_SIDES) * math.pi / _SIDES - math.pi / 2.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PathBounds:
    """Bounds at K + 1 knots: s'' between tilt x -+ reserve, for each of m rows, and x = s'^2 up to most."""

    knots: Array
    """Values of s, increasing, first 0, shape (K + 1,)."""
    reserve: Array
    """Shape (m, K + 1): all that follows is the least or the largest of the rows, [1/s^2]."""
    tilt: Array
    """Shape (m, K + 1)."""
    most: Array
    """Largest x, shape (K + 1,), [1/s^2]."""

    def slowed(self, factor: Array) -> PathBounds:
        """Returns the bounds when each knot is passed slower by a factor of 1 or more, shape (K + 1,)."""
        squares = factor**2
        return PathBounds(
            knots=self.knots, reserve=self.reserve / squares, tilt=self.tilt, most=self.most / squares
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
    size = np.maximum(np.abs(first), LEAST)
    reserve = acceleration / size
    tilt = -second / np.copysign(size, first)
    return PathBounds(knots=knots, reserve=reserve, tilt=tilt, most=np.minimum(_ceiling(reserve, tilt), fastest**2))


def half_planes(first: Array, second: Array) -> tuple[Array, Array]:
    """Returns rows whose bounds, times `ROUNDNESS`, stand for one on the length of first s'' + second s'^2.

    Args:
        first: Vectors, shape (K + 1, d).
        second: Vectors, shape (K + 1, d).

    Returns:
        Rows of first and second, each of shape (sides, K + 1).
    """
    # In the plane of both, by the part of the second along the first and the part across.
    length = np.sqrt((first * first).sum(axis=1))
    along = (first * second).sum(axis=1) / np.maximum(length, LEAST)
    across = np.sqrt(np.maximum((second * second).sum(axis=1) - along * along, 0.0))
    c, s = np.cos(_ANGLES), np.sin(_ANGLES)
    return np.outer(c, length), np.outer(c, along) + np.outer(s, across)


def _ceiling(reserve: Array, tilt: Array) -> Array:
    """Returns the largest x at each knot at which some s'' keeps every row, shape (K + 1,)."""
    # Where two rows leave no s'' between them: tilt_i x - reserve_i = tilt_j x + reserve_j.
    most = np.full(tilt.shape[1], LEAST)
    for i in range(len(tilt) - 1):
        pairs = np.abs(tilt[i] - tilt[i + 1 :]) / (reserve[i] + reserve[i + 1 :])
        np.maximum(most, pairs.max(axis=0), out=most)
    return 1.0 / most
