"""Time-optimal laws along a path: first with bounds on velocity and acceleration, then with a bounded jerk.

The way is the share u of a path, 0 to 1, on evenly spaced knots. What is bounded are rows of quantities that depend on
u alone: joint angles, the tool's way and turn, the arm angle. With x = u'^2 each row is linear in (x, u''):
|first u'' + second x| <= acceleration, and first^2 x <= velocity^2.

`fastest_squares` is the reachability analysis of Pham and Pham (TOPP-RA, IEEE T-RO 34(3), 2018): backward the largest
x from which the end can still be reached, forward the largest u''. Its accelerations jump; `smooth_law` takes their
mean over a few cycles, which neither moves the ends nor the distance, and makes every jerk finite.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rcilab.arrays import Array
from rcilab.clock import CYCLE_TIME

_LEAST = 1e-12
"""A slope below which a row does not bound u'', and the least x."""
_STEEPEST = 1.0 / _LEAST
"""The slope of a row that, a share of the way back, does not bound x any more."""
_CLEARLY = 1.0 - 1e-12
"""A line that is lower only by less than this part of the value is not: rounding."""

_Line: TypeAlias = tuple[float, float]
"""Value at 0, and slope."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PathBounds:
    """What a path allows at M + 1 evenly spaced knots, for m bounded rows."""

    first: Array
    """Derivatives of the rows by u, shape (M + 1, m)."""
    second: Array
    """Second derivatives by u, shape (M + 1, m)."""
    velocity: Array
    """Bounds, shape (m,) or (M + 1, m), [unit/s]."""
    acceleration: Array
    """Bounds, shape (m,) or (M + 1, m), [unit/s^2]."""

    def slowed(self, factor: Array) -> PathBounds:
        """Returns what is left when each knot is passed that much slower: 1 or more, shape (M + 1,)."""
        slow = factor[:, np.newaxis]
        return PathBounds(
            first=self.first,
            second=self.second,
            velocity=self.velocity / slow,
            acceleration=self.acceleration / slow**2,
        )


@dataclass(frozen=True, slots=True, eq=False)
class TimeLaw:
    """The share of the way at every cycle, with its derivatives, each of shape (N,)."""

    u: Array
    du: Array
    """[1/s]."""
    ddu: Array
    """[1/s^2]; straight lines between the cycles."""


def fastest_squares(bounds: PathBounds) -> Array:
    """Returns the largest squares of u' from rest to rest, at the knots, shape (M + 1,), [1/s^2].

    Args:
        bounds: What the path allows.
    """
    step = 2.0 / (len(bounds.first) - 1)
    size = np.maximum(np.abs(bounds.first), _LEAST)
    reserve = bounds.acceleration / size
    tilt = -bounds.second / np.copysign(size, bounds.first)
    most = _ceiling(bounds.velocity / size, reserve, tilt).tolist()
    # A share of the way on, x has grown by step * u'', and each row bounds u'' by tilt * x -+ reserve.
    gain = step * reserve
    factor = 1.0 + step * tilt
    inverse = np.where(factor > _LEAST, 1.0 / np.maximum(factor, _LEAST), _STEEPEST)
    last = len(most) - 1
    highest = [0.0] * (last + 1)
    x = 0.0
    lines = _least_lines(gain * inverse, inverse, [*most[1:], 0.0])
    for k in range(last - 1, -1, -1):
        (a, f), (b, g), more = lines[k]
        x = highest[k] = min(most[k], a + x * f, b + x * g, *[c + x * h for c, h in more])
    x = 0.0
    squares = [0.0] * (last + 1)
    lines = _least_lines(gain, factor, most)
    for k in range(last):
        (a, f), (b, g), more = lines[k]
        x = squares[k + 1] = max(min(highest[k + 1], a + x * f, b + x * g, *[c + x * h for c, h in more]), _LEAST)
    squares[last] = 0.0
    return np.array(squares)


def duration_of(squares: Array) -> float:
    """Returns how long the law with these squares of u' lasts, u'' constant from knot to knot, [s]."""
    return float(_knot_times(squares)[-1])


def smooth_law(squares: Array, cycles: int) -> TimeLaw:
    """Returns the law on the grid of cycles whose acceleration is the mean of the given one's over some cycles.

    It begins and ends at rest and without acceleration, takes `cycles` longer and less than a cycle more, and its jerk
    is at most the largest jump of the given acceleration, divided by that time.

    Args:
        squares: Squares of u' at evenly spaced knots, shape (M + 1,), [1/s^2].
        cycles: Over how many cycles to take the mean, 1 or more.
    """
    h = CYCLE_TIME
    knots = _knot_times(squares)
    count = max(int(np.ceil(knots[-1] / h - 1e-9)), 1)
    stretch = count * h / knots[-1]
    times = (np.arange(count + 2 * cycles + 1) - cycles) * h
    du = np.interp(times, knots * stretch, np.sqrt(squares) / stretch)
    ddu = (du[cycles:] - du[:-cycles]) / (cycles * h)
    mean = (ddu[:-1] + ddu[1:]) / 2.0
    speed = np.concatenate(([0.0], np.cumsum(mean * h)))
    way = speed[:-1] * h + (2.0 * ddu[:-1] + ddu[1:]) * (h * h / 6.0)
    u = np.concatenate(([0.0], np.cumsum(way)))
    total = u[-1]
    return TimeLaw(u / total, speed / total, ddu / total)


def _least_lines(at_zero: Array, slope: Array, longest: list[float]) -> list[tuple[_Line, _Line, list[_Line]]]:
    """Returns the lines at_zero + slope x that are ever the least ones at each knot, for x from 0 to `longest`.

    That is the one at 0, the one at `longest`, and at the few knots where yet another is below both between them, all.

    Args:
        at_zero: Of m lines a knot, shape (M + 1, m).
        slope: Shape (M + 1, m).
        longest: Of M + 1 knots.
    """
    knots = np.arange(len(longest))
    first, last = at_zero.argmin(axis=1), (at_zero + slope * np.array(longest)[:, np.newaxis]).argmin(axis=1)
    low, high, steep, flat = at_zero[knots, first], at_zero[knots, last], slope[knots, first], slope[knots, last]
    # Where both cross, is another one below?
    is_two = steep > flat
    cross = np.where(is_two, (high - low) / np.where(is_two, steep - flat, 1.0), 0.0)
    least = low + steep * cross
    is_more = (at_zero + slope * cross[:, np.newaxis] < (least * _CLEARLY)[:, np.newaxis]).any(axis=1)
    more: list[list[_Line]] = [[]] * len(longest)
    for k in np.flatnonzero(is_more).tolist():
        more[k] = list(zip(at_zero[k].tolist(), slope[k].tolist(), strict=True))
    ones = zip(low.tolist(), steep.tolist(), strict=True)
    others = zip(high.tolist(), flat.tolist(), strict=True)
    return list(zip(ones, others, more, strict=True))


def _ceiling(velocity: Array, reserve: Array, tilt: Array) -> Array:
    """Returns the largest x at each knot at which some u'' keeps every row, shape (M + 1,)."""
    # Where two rows leave no u'' between them: tilt_i x - reserve_i = tilt_j x + reserve_j.
    most = np.full(len(tilt), _LEAST)
    for i in range(tilt.shape[1]):
        pairs = (tilt[:, i, np.newaxis] - tilt) / (reserve[:, i, np.newaxis] + reserve)
        np.maximum(most, pairs.max(axis=1), out=most)
    return np.minimum(1.0 / most, (velocity**2).min(axis=1))


def _knot_times(squares: Array) -> Array:
    speed = np.sqrt(squares)
    way = 1.0 / (len(squares) - 1)
    return np.concatenate(([0.0], np.cumsum(2.0 * way / (speed[:-1] + speed[1:]))))
