"""How fast a section may be passed: bounds on its share, from what the joints and the tool do along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.limits import CartesianLimits, JointLimits
from rcilab.motion.bounds import LIMIT_MARGIN
from rcilab.sim.planner.target import JointSpeed, ToolSpeed

_CURVATURE = 0.5  # Part of an acceleration bound for the curvature of the path; the rest is for speeding up.
_JERK_PART = 0.3  # Part of a jerk bound for each of the two terms with the curvature.
_SAMPLED = 0.95  # Part of the bounds that is used where the path is known from samples.
_LEVEL = 2.0  # A stretch of its own begins where the bound on the velocity changes by this factor; a tuning value.
_TINY = 1e-12


class ShareBounds(NamedTuple):
    """Bounds on the share of a section up to a share."""

    end: float
    velocity: float
    """[1/s]."""
    acceleration: float
    """[1/s^2]."""
    jerk: float
    """[1/s^3]."""


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Velocity, acceleration and jerk of quantities, each of shape (m,)."""

    velocity: Array
    acceleration: Array
    jerk: Array


def joint_bounds(limits: JointLimits, speed: JointSpeed) -> Bounds:
    """Returns the bounds of the joints for a speed of a target, inside the limits."""
    return Bounds(
        *(
            LIMIT_MARGIN * limit if wanted is None else np.minimum(LIMIT_MARGIN * limit, wanted)
            for limit, wanted in (
                (limits.velocity, speed.velocity),
                (limits.acceleration, speed.acceleration),
                (limits.jerk, speed.jerk),
            )
        )
    )


def tool_bounds(limits: CartesianLimits, speed: ToolSpeed) -> Bounds:
    """Returns the bounds of the tool's translation and rotation for a speed of a target, inside the limits."""
    table = (
        (limits.translation_velocity, speed.velocity, limits.rotation_velocity, speed.rotation_velocity),
        (
            limits.translation_acceleration,
            speed.acceleration,
            limits.rotation_acceleration,
            speed.rotation_acceleration,
        ),
        (limits.translation_jerk, speed.jerk, limits.rotation_jerk, speed.rotation_jerk),
    )
    return Bounds(*(np.array([_inside(a, x), _inside(b, y)]) for a, x, b, y in table))


def _inside(limit: float, wanted: float | None) -> float:
    return LIMIT_MARGIN * limit if wanted is None else min(LIMIT_MARGIN * limit, wanted)


def strictest(bounds: Sequence[Bounds], size: int = 2) -> Bounds:
    """Returns the smallest of several bounds of the same quantities; infinite ones of a size without any."""
    none = np.full(size, np.inf)
    return Bounds(
        np.minimum.reduce([none, *(bound.velocity for bound in bounds)]),
        np.minimum.reduce([none, *(bound.acceleration for bound in bounds)]),
        np.minimum.reduce([none, *(bound.jerk for bound in bounds)]),
    )


def bounds_of_line(distances: Sequence[float], bounds: Bounds) -> ShareBounds:
    """Returns the bounds of a straight line.

    Args:
        distances: How far each quantity moves from share 0 to 1, m numbers, not all zero.
        bounds: Of these quantities.
    """
    sizes = np.abs(np.array(distances))
    with np.errstate(divide="ignore"):
        v, a, j = ((bound / sizes).min() for bound in (bounds.velocity, bounds.acceleration, bounds.jerk))
    return ShareBounds(1.0, float(v), float(a), float(j))


def bounds_of_samples(
    rows: Array, bounds: Bounds, cap: float, tool: tuple[Array, Bounds] | None = None
) -> list[ShareBounds]:
    """Returns the bounds of a curve in stretches.

    With d1, d2, d3 the derivatives by the share s, the quantities accelerate by d1 s'' + d2 s'^2, and their jerk is
    d1 s''' + 3 d2 s' s'' + d3 s'^3. The terms of the curvature get fixed parts of each bound.

    Args:
        rows: Joint angles at even shares, shape (N + 1, n), N >= 1.
        bounds: Of the joints.
        cap: Largest velocity of the share, [1/s].
        tool: Position and turned angles of the tool, shape (N + 1, 6), and the bounds of both; None: not bounded.
    """
    columns = [_derivatives(rows)]
    limits = [Bounds(*(_SAMPLED * bound for bound in (bounds.velocity, bounds.acceleration, bounds.jerk)))]
    if tool is not None:
        values, tool_limits = tool
        for part, column in ((slice(0, 3), slice(0, 1)), (slice(3, 6), slice(1, 2))):
            columns.append([np.linalg.norm(d, axis=1, keepdims=True) for d in _derivatives(values[:, part])])
            velocity, acceleration, jerk = (
                bound[column] for bound in (tool_limits.velocity, tool_limits.acceleration, tool_limits.jerk)
            )
            limits.append(Bounds(velocity, _SAMPLED * acceleration, _SAMPLED * jerk))
    d1, d2, d3 = (np.maximum(np.concatenate([group[order] for group in columns], axis=1), _TINY) for order in range(3))
    V, A, J = (
        np.concatenate(parts)
        for parts in zip(*((limit.velocity, limit.acceleration, limit.jerk) for limit in limits), strict=True)
    )
    v = np.minimum(V / d1, np.sqrt(_CURVATURE * A / d2))
    v = np.minimum(np.minimum(v, np.cbrt(_JERK_PART * J / d3)).min(axis=1), cap)
    n = len(v)
    stretches: list[ShareBounds] = []
    for first, last in _runs(v):
        part = slice(first, last)
        speed = float(v[part].min())
        a = np.minimum((A - d2[part] * speed**2) / d1[part], _JERK_PART * J / (3.0 * d2[part] * speed)).min()
        j = ((J - 3.0 * d2[part] * speed * a - d3[part] * speed**3) / d1[part]).min()
        stretches.append(ShareBounds(last / n, speed, float(a), float(j)))
    return stretches


def _derivatives(rows: Array) -> list[Array]:
    """Returns the sizes of three derivatives by the share, each the largest around an interval, shape (N, m)."""
    n = len(rows) - 1
    table = [np.abs(np.diff(rows, axis=0)) * n]
    for order in (2, 3):
        table.append(np.zeros_like(table[0]))
        differences = np.abs(np.diff(rows, order, axis=0)) * n**order
        for shift in range(order):  # Each difference is over `order` intervals.
            target = table[-1][shift : shift + len(differences)]
            np.maximum(target, differences, out=target)
    return table


def _runs(v: Array) -> list[tuple[int, int]]:
    """Returns the intervals, first and past the last, in which a bound stays within a factor."""
    runs: list[tuple[int, int]] = []
    first, low, high = 0, float(v[0]), float(v[0])
    for i, value in enumerate(v.tolist()):
        low_now, high_now = min(low, value), max(high, value)
        if high_now > _LEVEL * low_now:
            runs.append((first, i))
            first, low_now, high_now = i, value, value
        low, high = low_now, high_now
    return [*runs, (first, len(v))]


def slower(a: Sequence[ShareBounds], b: ShareBounds) -> list[ShareBounds]:
    """Returns bounds inside both."""
    return [
        ShareBounds(x.end, min(x.velocity, b.velocity), min(x.acceleration, b.acceleration), min(x.jerk, b.jerk))
        for x in a
    ]
