"""Time-optimal time laws along a path: first with bounds on velocity and acceleration, then with a bounded jerk.

The path has a parameter s, from 0 on, with knots at any distance. The bounded rows are quantities that depend on s
alone: joint angles, position and rotation of the tool, the arm angle. With x = s'^2 each row is linear in (x, s''):
|first s'' + second x| <= acceleration, and first^2 x <= velocity^2.

`fastest_squares` is the reachability analysis of Pham and Pham (TOPP-RA, IEEE T-RO 34(3), 2018): backward the largest
x from which the end can still be reached, forward the largest s''. Its accelerations jump; `smooth_law` takes their
mean over a few cycles, which neither moves the ends nor the distance, and makes every jerk finite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.motion.path_bounds import LEAST, PathBounds

_UNBOUND = 1e30
"""What is more than any x."""
_CHORDS = 8
"""Chords that approximate the bound on the next x as a function of x; they lose less than 0.1 % of the time."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeParametrization:
    """The way at every cycle, with its derivatives, each of shape (N,)."""

    s: Array
    ds: Array
    """[1/s]."""
    dds: Array
    """[1/s^2]; straight lines between the cycles."""


def fastest_squares(bounds: PathBounds) -> Array:
    """Returns the largest squares of s' between standstills, at the knots, shape (K + 1,), [1/s^2].

    Args:
        bounds: What the path allows.
    """
    return FastestLaw(bounds).slowed(np.ones(len(bounds.knots)))


class FastestLaw:
    """The fastest law along a path. After a local slowdown only the affected part is computed again.

    Args:
        bounds: What the path allows.
    """

    def __init__(self, bounds: PathBounds) -> None:
        # A step on, x has grown by 2 step s'', and each row bounds s'' by tilt * x -+ reserve: the most that x can
        # become, and the most that it can have been, are the least of many straight lines, hence concave in x.
        step = 2.0 * np.diff(bounds.knots)
        self._gain, self._factor = step * bounds.reserve[:, :-1], 1.0 + step * bounds.tilt[:, :-1]
        count = len(bounds.knots)
        # Where a row hardly depends on s'' (first is near 0), a large x leaves only an s'' that ends in a stop at the
        # next knot, or before it. There x stays where the row also allows s'' = 0.
        even = np.where(self._factor < 0.0, self._gain / (1.0 - np.minimum(self._factor, 0.0)), np.inf)
        self._most = np.minimum(bounds.most, np.append(even.min(axis=0), np.inf))
        self._slowdown = np.zeros(count)
        self._limits = [0.0] * count
        self._backward: list[list[float]] = [[]] * (count - 1)
        self._forward: list[list[float]] = [[]] * (count - 1)
        self._highest = [0.0] * count
        """From which the end can still be reached."""
        self._squares = [0.0] * count

    def slowed(self, factor: Array) -> Array:
        """Returns the squares of s' at the knots when each is passed that much slower, shape (K + 1,), [1/s^2].

        Args:
            factor: 1 or more, shape (K + 1,).
        """
        changed = factor != self._slowdown
        self._slowdown = factor.copy()
        last = len(changed) - 1
        is_stale = changed[:-1] | changed[1:]
        stale: list[int] = np.flatnonzero(is_stale).tolist()
        if stale:
            self._bound(np.flatnonzero(changed), np.flatnonzero(is_stale))
            self._look_back(stale)
            self._go_on(changed[:-1])
        squares = np.array(self._squares)
        squares[last] = 0.0
        return squares

    def _bound(self, knots: NDArray[np.intp], steps: NDArray[np.intp]) -> None:
        """Computes bounds at some knots, and over some steps between knots."""
        squares = self._slowdown**2
        most = self._most / squares
        for k, limit in zip(knots.tolist(), most[knots].tolist(), strict=True):
            self._limits[k] = limit
        gain, factor = self._gain[:, steps] / squares[steps], self._factor[:, steps]
        binds = factor > LEAST
        inverse = np.where(binds, 1.0 / np.maximum(factor, LEAST), 0.0)
        backward = _chords(np.where(binds, gain * inverse, _UNBOUND), inverse, most[steps + 1])
        forward = _chords(gain, factor, most[steps])
        for k, back, forth in zip(steps.tolist(), backward, forward, strict=True):
            self._backward[k], self._forward[k] = back, forth

    def _look_back(self, stale: list[int]) -> None:
        """Finds the largest x from which the end can be reached, from the last stale step down."""
        limits, backward, highest = self._limits, self._backward, self._highest
        self._lowered = set[int]()
        waiting = stale.copy()
        k = len(highest)
        moves = False
        while True:
            k = k - 1 if moves else min(k - 1, waiting[-1] if waiting else -1)
            if k < 0:
                return
            while waiting and waiting[-1] >= k:
                waiting.pop()
            x = min(limits[k], _along(backward[k], highest[k + 1] / limits[k + 1]))
            moves = x != highest[k]
            if moves:
                highest[k] = x
                self._lowered.add(k)

    def _go_on(self, is_changed: NDArray[np.bool_]) -> None:
        """Finds the largest x that can be had, from the first stale step up."""
        limits, forward, highest, squares = self._limits, self._forward, self._highest, self._squares
        is_stale = is_changed.copy()
        for k in self._lowered:
            if k:
                is_stale[k - 1] = True
        waiting: list[int] = np.flatnonzero(is_stale)[::-1].tolist()
        k, last = -1, len(highest) - 1
        moves = False
        while True:
            k = k + 1 if moves else max(k + 1, waiting[-1] if waiting else last)
            if k >= last:
                return
            while waiting and waiting[-1] <= k:
                waiting.pop()
            x = max(min(highest[k + 1], _along(forward[k], squares[k] / limits[k])), LEAST)
            moves = x != squares[k + 1]
            squares[k + 1] = x


def smooth_law(knots: Array, squares: Array, cycles: int) -> TimeParametrization:
    """Returns the law on the grid of cycles whose acceleration is the mean of the given one's over some cycles.

    It begins and ends at standstill without acceleration, takes `cycles` longer and less than a cycle more; its jerk
    is at most the largest jump of the given acceleration, divided by that time.

    Args:
        knots: Values of s, shape (K + 1,).
        squares: Squares of s' there, shape (K + 1,), [1/s^2].
        cycles: Over how many cycles to take the mean, 1 or more.
    """
    h = CYCLE_TIME
    times = _knot_times(knots, squares)
    count = max(math.ceil(times[-1] / h - 1e-9), 1)
    stretch = count * h / times[-1]
    grid = (np.arange(count + 2 * cycles + 1) - cycles) * h
    ds = np.interp(grid, times * stretch, np.sqrt(squares) / stretch)
    dds = (ds[cycles:] - ds[:-cycles]) / (cycles * h)
    ds = np.concatenate(([0.0], np.cumsum((dds[:-1] + dds[1:]) * (h / 2.0))))
    way = ds[:-1] * h + (2.0 * dds[:-1] + dds[1:]) * (h * h / 6.0)
    s = np.concatenate(([0.0], np.cumsum(way)))
    part = knots[-1] / s[-1]
    return TimeParametrization(np.minimum(s * part, knots[-1]), ds * part, dds * part)


def _chords(offset: Array, slope: Array, top: Array) -> list[list[float]]:
    """Returns the least of the lines offset + slope x of each step at even places from 0 to its top, as plain floats.

    The least of lines is concave, so what lies on the chords between these places is never more than it.
    """
    table = np.empty((len(top), _CHORDS + 1))
    for i in range(_CHORDS + 1):
        table[:, i] = (offset + slope * (top * (i / _CHORDS))).min(axis=0)
    return table.tolist()


def _along(chords: list[float], part: float) -> float:
    place = part * _CHORDS
    i = min(int(place), _CHORDS - 1)
    return chords[i] + (place - i) * (chords[i + 1] - chords[i])


def _knot_times(knots: Array, squares: Array) -> Array:
    speed = np.sqrt(squares)
    return np.concatenate(([0.0], np.cumsum(2.0 * np.diff(knots) / (speed[:-1] + speed[1:]))))
