"""Time laws along a path: time-optimal for bounds on velocity and acceleration, then smoothed to bounded jerk.

The path has a parameter s, from 0 on, with knots at any spacing. The bounded rows are quantities that depend only on
s: joint angles, position and rotation of the tool, the arm angle. With x = s'^2 each row is linear in (x, s''):
|first s'' + second x| <= acceleration, and first^2 x <= velocity^2.

`FastestLaw` is the reachability analysis of Pham and Pham (TOPP-RA, IEEE T-RO 34(3), 2018): a backward pass for
the largest x from which the end can be reached, a forward pass with the largest s''. Its accelerations jump;
`smooth_law` takes their mean over some cycles, which keeps both ends and the distance and makes every jerk finite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.motion.path_bounds import MIN_SLOPE, PathBounds

_UNBOUNDED = 1e30
"""Larger than any x."""
_CHORDS = 8
"""Number of chords that approximate the bound on the next x as a function of x; they cost less than 0.1 % of time."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeParametrization:
    """The path parameter at every cycle, with its derivatives, each of shape (N,)."""

    s: Array
    ds: Array
    """[1/s]."""
    dds: Array
    """[1/s^2]; linear between the cycles."""


class FastestLaw:
    """The fastest time law along a path. After a local slowdown only the affected part is computed again.

    Args:
        bounds: Bounds of the path.
    """

    def __init__(self, bounds: PathBounds) -> None:
        # Over a step x grows by 2 step s'', and each row bounds s'' by slope * x -+ offset. The largest next x and the
        # largest previous x are thus minima of linear functions of x, and concave.
        step = 2.0 * np.diff(bounds.knots)
        self._gain, self._factor = step * bounds.offset[:, :-1], 1.0 + step * bounds.slope[:, :-1]
        count = len(bounds.knots)
        # If a row hardly depends on s'' (first is near 0), a large x allows only an s'' that stops at the next knot or
        # before. There x is bounded so that the row also allows s'' = 0.
        stopping = np.where(self._factor < 0.0, self._gain / (1.0 - np.minimum(self._factor, 0.0)), np.inf)
        self._max_squares = np.minimum(bounds.max_squares, np.append(stopping.min(axis=0), np.inf))
        self._slowdown = np.zeros(count)
        self._limits = [0.0] * count
        self._backward: list[list[float]] = [[]] * (count - 1)
        self._forward: list[list[float]] = [[]] * (count - 1)
        self._highest = [0.0] * count
        """Largest x from which the end can be reached."""
        self._squares = [0.0] * count

    def slowed(self, factor: Array) -> Array:
        """Returns the largest squares of s' at the knots, from standstill to standstill, shape (K + 1,), [1/s^2].

        Args:
            factor: Slowdown of each knot, 1 or more, shape (K + 1,).
        """
        changed = factor != self._slowdown
        self._slowdown = factor.copy()
        last = len(changed) - 1
        is_stale = changed[:-1] | changed[1:]
        stale: list[int] = np.flatnonzero(is_stale).tolist()
        if stale:
            self._update_chords(np.flatnonzero(changed), np.flatnonzero(is_stale))
            self._backward_pass(stale)
            self._forward_pass(changed[:-1])
        squares = np.array(self._squares)
        squares[last] = 0.0
        return squares

    def _update_chords(self, knots: NDArray[np.intp], steps: NDArray[np.intp]) -> None:
        """Computes the bounds at some knots, and the chords over some steps between knots."""
        squares = self._slowdown**2
        max_squares = self._max_squares / squares
        for k, limit in zip(knots.tolist(), max_squares[knots].tolist(), strict=True):
            self._limits[k] = limit
        gain, factor = self._gain[:, steps] / squares[steps], self._factor[:, steps]
        binds = factor > MIN_SLOPE
        inverse = np.where(binds, 1.0 / np.maximum(factor, MIN_SLOPE), 0.0)
        backward = _chords(np.where(binds, gain * inverse, _UNBOUNDED), inverse, max_squares[steps + 1])
        forward = _chords(gain, factor, max_squares[steps])
        for k, back, forth in zip(steps.tolist(), backward, forward, strict=True):
            self._backward[k], self._forward[k] = back, forth

    def _backward_pass(self, stale: list[int]) -> None:
        """Computes the largest x from which the end can be reached, from the last stale step backward."""
        limits, backward, highest = self._limits, self._backward, self._highest
        self._lowered = set[int]()
        pending = stale.copy()
        k = len(highest)
        has_changed = False
        while True:
            k = k - 1 if has_changed else min(k - 1, pending[-1] if pending else -1)
            if k < 0:
                return
            while pending and pending[-1] >= k:
                pending.pop()
            x = min(limits[k], _interpolate(backward[k], highest[k + 1] / limits[k + 1]))
            has_changed = x != highest[k]
            if has_changed:
                highest[k] = x
                self._lowered.add(k)

    def _forward_pass(self, is_changed: NDArray[np.bool_]) -> None:
        """Computes the largest x that can be reached, from the first stale step forward."""
        limits, forward, highest, squares = self._limits, self._forward, self._highest, self._squares
        is_stale = is_changed.copy()
        for k in self._lowered:
            if k:
                is_stale[k - 1] = True
        pending: list[int] = np.flatnonzero(is_stale)[::-1].tolist()
        k, last = -1, len(highest) - 1
        has_changed = False
        while True:
            k = k + 1 if has_changed else max(k + 1, pending[-1] if pending else last)
            if k >= last:
                return
            while pending and pending[-1] <= k:
                pending.pop()
            x = max(min(highest[k + 1], _interpolate(forward[k], squares[k] / limits[k])), MIN_SLOPE)
            has_changed = x != squares[k + 1]
            squares[k + 1] = x


def smooth_law(knots: Array, squares: Array, cycles: int) -> TimeParametrization:
    """Returns the law on the grid of cycles whose acceleration is the moving average of the given one over some cycles.

    It begins and ends at standstill with zero acceleration, and lasts `cycles` and less than one cycle longer. Its
    jerk is at most the largest jump of the given acceleration divided by the time of `cycles`.

    Args:
        knots: Values of s, shape (K + 1,).
        squares: Squares of s' at the knots, shape (K + 1,), [1/s^2].
        cycles: Number of cycles of the average, 1 or more.
    """
    h = CYCLE_TIME
    times = _knot_times(knots, squares)
    count = max(math.ceil(times[-1] / h - 1e-9), 1)
    stretch = count * h / times[-1]
    grid = (np.arange(count + 2 * cycles + 1) - cycles) * h
    ds = np.interp(grid, times * stretch, np.sqrt(squares) / stretch)
    dds = (ds[cycles:] - ds[:-cycles]) / (cycles * h)
    ds = np.concatenate(([0.0], np.cumsum((dds[:-1] + dds[1:]) * (h / 2.0))))
    distances = ds[:-1] * h + (2.0 * dds[:-1] + dds[1:]) * (h * h / 6.0)
    s = np.concatenate(([0.0], np.cumsum(distances)))
    part = knots[-1] / s[-1]
    return TimeParametrization(np.minimum(s * part, knots[-1]), ds * part, dds * part)


def _chords(offset: Array, slope: Array, x_max: Array) -> list[list[float]]:
    """Returns the minimum of the lines offset + slope x of each step, at even points from 0 to x_max, as plain floats.

    The minimum of lines is concave, so the chords between these points never exceed it.
    """
    table = np.empty((len(x_max), _CHORDS + 1))
    for i in range(_CHORDS + 1):
        table[:, i] = (offset + slope * (x_max * (i / _CHORDS))).min(axis=0)
    return table.tolist()


def _interpolate(chords: list[float], part: float) -> float:
    position = part * _CHORDS
    i = min(int(position), _CHORDS - 1)
    return chords[i] + (position - i) * (chords[i + 1] - chords[i])


def _knot_times(knots: Array, squares: Array) -> Array:
    speed = np.sqrt(squares)
    return np.concatenate(([0.0], np.cumsum(2.0 * np.diff(knots) / (speed[:-1] + speed[1:]))))
