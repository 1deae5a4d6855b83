"""How fast a chain may be run through: bounds at its knots, and the law on the grid of cycles.

As in `time_law`, with knots at any distance: reachability analysis (Pham and Pham, TOPP-RA, IEEE T-RO 34(3), 2018) for
the largest squares of s', then the mean over a few cycles for a bounded jerk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rcilab.arrays import Array
from rcilab.clock import CYCLE_TIME
from rcilab.limits import Limits
from rcilab.motion.chain import Chain, derivatives_at_knots
from rcilab.motion.margin import LIMIT_MARGIN

_LEAST = 1e-12
"""A slope below which a row does not bound s'', and the least square of s'."""
_UNBOUND = 1e30
"""What is more than any square of s'."""
_SIDES = 8
"""Half-planes on each side in place of the round bounds on the tool's acceleration; they lose 1.9 %."""
_CHORDS = 8
"""Chords in place of the bound on the next x as a function of x. A choice: they lose less than 0.1 % of the time."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ColumnLimits:
    """Bounds at speed 1, with the margin, of each joint, the arm angle, and the tool's translation and rotation."""

    velocity: Array
    """Shape (n + 3,), [rad/s], the translation's [m/s]."""
    acceleration: Array
    jerk: Array


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ChainBounds:
    """What a chain allows at its K + 1 knots, for m bounded rows: each linear in (x, s'') with x = s'^2."""

    knots: Array
    first: Array
    """Shape (m, K + 1): what follows is the least or the largest over the rows, knot by knot."""
    second: Array
    """Shape (m, K + 1)."""
    acceleration: Array
    """Shape (m, K + 1)."""
    most: Array
    """Largest x that velocities and jerks allow, shape (K + 1,)."""


@dataclass(frozen=True, slots=True, eq=False)
class ChainLaw:
    """s at every cycle, with its derivatives, each of shape (N,)."""

    s: Array
    ds: Array
    """[1/s]."""
    dds: Array
    """[1/s^2]; straight lines between the cycles."""


def column_limits(limits: Limits) -> ColumnLimits:
    """Returns the bounds of an arm."""
    joint, tool, elbow = limits.joint, limits.cartesian, limits.arm_angle
    extra = [
        (math.inf,) * 3 if elbow is None else (elbow.velocity, elbow.acceleration, elbow.jerk),
        (tool.translation_velocity, tool.translation_acceleration, tool.translation_jerk),
        (tool.rotation_velocity, tool.rotation_acceleration, tool.rotation_jerk),
    ]
    velocity, acceleration, jerk = np.array(extra).T
    return ColumnLimits(
        velocity=LIMIT_MARGIN * np.concatenate((joint.velocity, velocity)),
        acceleration=LIMIT_MARGIN * np.concatenate((joint.acceleration, acceleration)),
        jerk=LIMIT_MARGIN * np.concatenate((joint.jerk, jerk)),
    )


def chain_bounds(chain: Chain, limits: ColumnLimits) -> ChainBounds:
    """Returns what a chain allows."""
    first, second, third = derivatives_at_knots(chain)
    n = chain.n
    speed = np.minimum(_at_knots(chain.speed, 1.0, np.minimum), 1.0)
    leads = _at_knots(chain.leads_tool, 0.0, np.maximum)
    lengths = _norms(first, n)
    thirds = _norms(third, n)
    velocity = np.outer(speed, limits.velocity)
    for table in (lengths, thirds):
        table[:, n:] *= leads[:, np.newaxis]
    with np.errstate(divide="ignore"):
        most = np.minimum((velocity / lengths).min(axis=1) ** 2, (limits.jerk / thirds).min(axis=1) ** (2.0 / 3.0))
    first[:, n:] *= leads[:, np.newaxis]
    second[:, n:] *= leads[:, np.newaxis]
    translation = _half_planes(first[:, n + 1 : n + 4], second[:, n + 1 : n + 4])
    rotation = _half_planes(first[:, n + 4 :], second[:, n + 4 :])
    most_flat = math.cos(math.pi / (2.0 * _SIDES))
    sides = (most_flat * limits.acceleration[n + 1], most_flat * limits.acceleration[n + 2])
    acceleration = np.concatenate((limits.acceleration[: n + 1], np.repeat(sides, _SIDES)))
    return ChainBounds(
        knots=chain.knots,
        first=np.vstack((first[:, : n + 1].T, translation[0], rotation[0])),
        second=np.vstack((second[:, : n + 1].T, translation[1], rotation[1])),
        acceleration=np.outer(acceleration, speed),
        most=most,
    )


def fastest_law(bounds: ChainBounds, slowdown: Array, cycles: int) -> ChainLaw:
    """Returns the fastest law from rest to rest on the grid of cycles, its acceleration the mean over some cycles.

    Args:
        bounds: What the chain allows.
        slowdown: How much slower each knot is to be passed, 1 or more, shape (K + 1,).
        cycles: Over how many cycles to take the mean, 1 or more.
    """
    return _smooth(bounds.knots, _fastest_squares(bounds, slowdown), cycles)


def _fastest_squares(bounds: ChainBounds, slowdown: Array) -> Array:
    size = np.maximum(np.abs(bounds.first), _LEAST)
    reserve = bounds.acceleration / slowdown**2 / size
    tilt = -bounds.second / np.copysign(size, bounds.first)
    most = np.minimum(_ceiling(reserve, tilt), bounds.most / slowdown**2)
    # A step on, x has grown by 2 step s'', and each row bounds s'' by tilt * x -+ reserve: the most that x can become,
    # and the most that it can have been, are the least of many straight lines, hence concave in x.
    step = 2.0 * np.diff(bounds.knots)
    gain, factor = step * reserve[:, :-1], 1.0 + step * tilt[:, :-1]
    binds = factor > _LEAST
    inverse = np.where(binds, 1.0 / np.maximum(factor, _LEAST), 0.0)
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
        x = squares[k + 1] = max(min(highest[k + 1], _along(forward[k], x / limits[k])), _LEAST)
    squares[last] = 0.0
    return np.array(squares)


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


def _smooth(knots: Array, squares: Array, cycles: int) -> ChainLaw:
    h = CYCLE_TIME
    speed = np.sqrt(squares)
    times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(knots) / (speed[:-1] + speed[1:]))))
    count = max(math.ceil(times[-1] / h - 1e-9), 1)
    stretch = count * h / times[-1]
    grid = (np.arange(count + 2 * cycles + 1) - cycles) * h
    ds = np.interp(grid, times * stretch, speed / stretch)
    dds = (ds[cycles:] - ds[:-cycles]) / (cycles * h)
    ds = np.concatenate(([0.0], np.cumsum((dds[:-1] + dds[1:]) * (h / 2.0))))
    way = ds[:-1] * h + (2.0 * dds[:-1] + dds[1:]) * (h * h / 6.0)
    s = np.concatenate(([0.0], np.cumsum(way)))
    part = knots[-1] / s[-1]
    return ChainLaw(np.minimum(s * part, knots[-1]), ds * part, dds * part)


def _ceiling(reserve: Array, tilt: Array) -> Array:
    """Returns the largest x at each knot at which some s'' keeps every row, shape (K + 1,)."""
    # Where two rows leave no s'' between them: tilt_i x - reserve_i = tilt_j x + reserve_j.
    most = np.full(tilt.shape[1], _LEAST)
    for i in range(len(tilt) - 1):
        pairs = np.abs(tilt[i] - tilt[i + 1 :]) / (reserve[i] + reserve[i + 1 :])
        np.maximum(most, pairs.max(axis=0), out=most)
    return 1.0 / most


def _half_planes(first: Array, second: Array) -> tuple[Array, Array]:
    """Returns rows whose bounds stand for a round one on first s'' + second x, each of shape (_SIDES, K + 1)."""
    length = np.sqrt((first * first).sum(axis=1))
    along = first / np.maximum(length, _LEAST)[:, np.newaxis]
    forward = (along * second).sum(axis=1)
    aside = second - forward[:, np.newaxis] * along
    across = np.sqrt((aside * aside).sum(axis=1))
    angles = np.arange(_SIDES) * math.pi / _SIDES - math.pi / 2.0
    c, s = np.cos(angles), np.sin(angles)
    return np.outer(c, length), np.outer(c, forward) + np.outer(s, across)


def _norms(table: Array, n: int) -> Array:
    """Returns the sizes of joint, arm angle, translation and rotation, shape (K + 1, n + 3)."""
    tool = [np.sqrt((table[:, i : i + 3] ** 2).sum(axis=1)) for i in (n + 1, n + 4)]
    return np.column_stack((np.abs(table[:, : n + 1]), *tool))


def _at_knots(intervals: Array, outside: float, join: np.ufunc) -> Array:
    """Returns what both intervals beside each knot say, joined, shape (K + 1,)."""
    return join(np.concatenate(([outside], intervals)), np.concatenate((intervals, [outside])))
