"""The bounds at the knots of a segment spline."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.limits import Limits
from rcilab.motion.bounds import LIMIT_MARGIN
from rcilab.motion.path_bounds import ROUNDNESS, PathBounds, half_planes, path_bounds
from rcilab.motion.segment_spline import SegmentSpline, derivatives_at_knots


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ColumnLimits:
    """Bounds at speed 1, with the margin, of each joint, the arm angle, and the tool's translation and rotation."""

    velocity: Array
    """Shape (n + 3,), [rad/s], the translation's [m/s]."""
    acceleration: Array
    jerk: Array


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


def chain_bounds(chain: SegmentSpline, limits: ColumnLimits) -> PathBounds:
    """Returns the bounds of a segment spline."""
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
        fastest = np.minimum((velocity / lengths).min(axis=1), (limits.jerk / thirds).min(axis=1) ** (1.0 / 3.0))
    first[:, n:] *= leads[:, np.newaxis]
    second[:, n:] *= leads[:, np.newaxis]
    translation = half_planes(first[:, n + 1 : n + 4], second[:, n + 1 : n + 4])
    rotation = half_planes(first[:, n + 4 :], second[:, n + 4 :])
    sides = np.repeat(ROUNDNESS * limits.acceleration[n + 1 :], len(translation[0]))
    acceleration = np.concatenate((limits.acceleration[: n + 1], sides))
    return path_bounds(
        chain.knots,
        np.vstack((first[:, : n + 1].T, translation[0], rotation[0])),
        np.vstack((second[:, : n + 1].T, translation[1], rotation[1])),
        np.outer(acceleration, speed),
        fastest,
    )


def _norms(table: Array, n: int) -> Array:
    """Returns the sizes of joint, arm angle, translation and rotation, shape (K + 1, n + 3)."""
    tool = [np.sqrt((table[:, i : i + 3] ** 2).sum(axis=1)) for i in (n + 1, n + 4)]
    return np.column_stack((np.abs(table[:, : n + 1]), *tool))


def _at_knots(intervals: Array, outside: float, join: np.ufunc) -> Array:
    """Returns what both intervals beside each knot say, joined, shape (K + 1,)."""
    return join(np.concatenate(([outside], intervals)), np.concatenate((intervals, [outside])))
