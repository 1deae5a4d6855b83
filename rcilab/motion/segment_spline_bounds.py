"""Bounds at the knots of a segment spline."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.limits import JointLimits, Limits
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import LIMIT_MARGIN
from rcilab.motion.end_velocity import bounds_along
from rcilab.motion.path_bounds import MIN_SLOPE, POLYGON_FACTOR, PathBounds, half_planes, path_bounds
from rcilab.motion.segment_spline import SegmentSpline, knot_derivatives
from rcilab.motion.tool_velocity import TOOL_VELOCITY_PART

_STEP = 1e-6  # Of s, for differences.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ColumnLimits:
    """Bounds at speed 1, with `LIMIT_MARGIN`, of each joint, the arm angle, and the tool's translation and rotation."""

    velocity: Array
    """Shape (n + 3,), [rad/s]; of the translation [m/s]. The others likewise."""
    acceleration: Array
    jerk: Array
    ends: JointLimits | None
    """The joints' limits if their velocity bounds decrease towards the ends of the ranges; else None."""


def column_limits(limits: Limits) -> ColumnLimits:
    """Returns the bounds of an arm, by column."""
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
        ends=None if joint.near_ends is None else joint,
    )


def spline_bounds(spline: SegmentSpline, limits: ColumnLimits, model: RobotModel | None) -> PathBounds:
    """Returns the bounds of a segment spline.

    Args:
        spline: The spline.
        limits: The bounds.
        model: The arm if its tool is bounded by `Limits.joint_tool_velocity`; else None.
    """
    first, second, third = knot_derivatives(spline)
    n = spline.n
    speed = np.minimum(_at_knots(spline.speed, 1.0, np.minimum), 1.0)
    moves_tool = _at_knots(spline.moves_tool, 0.0, np.maximum)
    first_norms = _norms(first, n)
    third_norms = _norms(third, n)
    velocity = np.outer(speed, limits.velocity)
    for table in (first_norms, third_norms):
        table[:, n:] *= moves_tool[:, np.newaxis]
    with np.errstate(divide="ignore"):
        fastest = np.minimum(
            (velocity / first_norms).min(axis=1), (limits.jerk / third_norms).min(axis=1) ** (1.0 / 3.0)
        )
    if limits.ends is not None:
        slopes = first[:, :n]
        allowed = LIMIT_MARGIN * bounds_along(limits.ends, spline.values(spline.knots, slice(n)), slopes)
        np.minimum(fastest, (allowed / np.maximum(np.abs(slopes), MIN_SLOPE)).min(axis=1), out=fastest)
    if model is not None:
        ends = np.clip([spline.knots - _STEP, spline.knots + _STEP], 0.0, spline.knots[-1])
        before, after = (model.position_path(spline.values(s, slice(n))) for s in ends)
        slope = np.linalg.norm(after - before, axis=1) / (ends[1] - ends[0])
        allowed = TOOL_VELOCITY_PART * model.limits.joint_tool_velocity / np.maximum(slope, MIN_SLOPE)
        np.minimum(fastest, allowed, out=fastest)
    first[:, n:] *= moves_tool[:, np.newaxis]
    second[:, n:] *= moves_tool[:, np.newaxis]
    translation = half_planes(first[:, n + 1 : n + 4], second[:, n + 1 : n + 4])
    rotation = half_planes(first[:, n + 4 :], second[:, n + 4 :])
    sides = np.repeat(POLYGON_FACTOR * limits.acceleration[n + 1 :], len(translation[0]))
    acceleration = np.concatenate((limits.acceleration[: n + 1], sides))
    return path_bounds(
        spline.knots,
        np.vstack((first[:, : n + 1].T, translation[0], rotation[0])),
        np.vstack((second[:, : n + 1].T, translation[1], rotation[1])),
        np.outer(acceleration, speed),
        fastest,
    )


def _norms(table: Array, n: int) -> Array:
    """Returns the norms of joint, arm angle, translation and rotation columns, shape (K + 1, n + 3)."""
    tool = [np.sqrt((table[:, i : i + 3] ** 2).sum(axis=1)) for i in (n + 1, n + 4)]
    return np.column_stack((np.abs(table[:, : n + 1]), *tool))


def _at_knots(intervals: Array, outside: float, combine: np.ufunc) -> Array:
    """Returns the combined values of both intervals next to each knot, shape (K + 1,)."""
    return combine(np.concatenate(([outside], intervals)), np.concatenate((intervals, [outside])))
