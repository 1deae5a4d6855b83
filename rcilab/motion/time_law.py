"""Time-optimal laws along a path: first with bounds on velocity and acceleration, then with a bounded jerk.

The way is a parameter s of the path, from 0 on, on knots at any distance. What is bounded are rows of quantities that
depend on s alone: joint angles, the tool's way and turn, the arm angle. With x = s'^2 each row is linear in (x, s''):
|first s'' + second x| <= acceleration, and first^2 x <= velocity^2.

`fastest_squares` is the reachability analysis of Pham and Pham (TOPP-RA, IEEE T-RO 34(3), 2018): backward the largest
x from which the end can still be reached, forward the largest s''. Its accelerations jump; `smooth_law` takes their
mean over a few cycles, which neither moves the ends nor the distance, and makes every jerk finite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rcilab.arrays import Array
from rcilab.clock import CYCLE_TIME
from rcilab.motion.path_bounds import LEAST, PathBounds

_UNBOUND = 1e30
"""What is more than any x."""
_CHORDS = 8
"""Chords in place of the bound on the next x as a function of x. A choice: they lose less than 0.1 % of the time."""


@dataclass(frozen=True, slots=True, eq=False)
class TimeLaw:
    """The way at every cycle, with its derivatives, each of shape (N,)."""

    s: Array
    ds: Array
    """[1/s]."""
    dds: Array
    """[1/s^2]; straight lines between the cycles."""


def fastest_squares(bounds: PathBounds) -> Array:
    """Returns the largest squares of s' from rest to rest, at the knots, shape (K + 1,), [1/s^2].

    Args:
        bounds: What the path allows.
    """
    reserve, tilt, most = bounds.reserve, bounds.tilt, bounds.most
    # A step on, x has grown by 2 step s'', and each row bounds s'' by tilt * x -+ reserve: the most that x can become,
    # and the most that it can have been, are the least of many straight lines, hence concave in x.
    step = 2.0 * np.diff(bounds.knots)
    gain, factor = step * reserve[:, :-1], 1.0 + step * tilt[:, :-1]
    binds = factor > LEAST
    inverse = np.where(binds, 1.0 / np.maximum(factor, LEAST), 0.0)
    backward = _chords(np.where(binds, gain * inverse, _UNBOUND), inverse, most[1:])
    forward = _chords(gain, factor, most[:-1])
    limits = most.tolist()
    last = len(limits) - 1
    highest = [0.0] * (last + 1)
    x = 0.0
    for k in range(last - 1, -1, -1):
        x = highest[k] = min(limits[k], _along(backward[k], x / limits[k + 1]))
    x = 0.0
    squares = [0.0] * (last + 1)
    for k in range(last):
        x = squares[k + 1] = max(min(highest[k + 1], _along(forward[k], x / limits[k])), LEAST)
    squares[last] = 0.0
    return np.array(squares)


def duration_of(knots: Array, squares: Array) -> float:
    """Returns how long the law with these squares of s' lasts, s'' constant from knot to knot, [s]."""
    return float(_knot_times(knots, squares)[-1])


def smooth_law(knots: Array, squares: Array, cycles: int) -> TimeLaw:
    """Returns the law on the grid of cycles whose acceleration is the mean of the given one's over some cycles.

    It begins and ends at rest and without acceleration, takes `cycles` longer and less than a cycle more, and its jerk
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
    return TimeLaw(np.minimum(s * part, knots[-1]), ds * part, dds * part)


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
