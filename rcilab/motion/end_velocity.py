"""Planning with velocity bounds that decrease towards the ends of the joints' ranges (`JointLimits.near_ends`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector, readonly_copy
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import LIMIT_MARGIN, angle_text
from rcilab.motion.piecewise import PiecewisePolynomial
from rcilab.motion.tool_velocity import tool_excess

_LOWEST_PART = 0.02
"""A slower motion is refused. Tuning value: it would last fifty times as long."""
_PRECISION = 2e-3
"""Relative tolerance of the part of the speed."""
_LEAST_STEP = 1.05
"""Least factor from one attempt to the next. Tuning value."""
_END_ROOM = 0.03  # [rad] Before the angle where the bound is zero. Tuning value: less needs gentler braking.
_STILL = 1e-9  # [rad] A smaller step is rounding.


def end_excess(limits: JointLimits, path: JointPath) -> Array:
    """Returns the used share of the velocity bounds, with `LIMIT_MARGIN`, from each row to the next, shape (N - 1,).

    Args:
        limits: Limits of the joints.
        path: Joint angles in consecutive cycles, shape (N, n), [rad].
    """
    dq = np.diff(path, axis=0) / CYCLE_TIME
    lower, upper = limits.checked_velocity_bounds(path[:-1])
    return (dq / (LIMIT_MARGIN * np.where(dq < 0.0, lower, upper))).max(axis=1)


def bounds_along(limits: JointLimits, path: JointPath, slopes: Array) -> Array:
    """Returns the velocity bounds of joints that move in the direction of `slopes`, shape (N, n), [rad/s]."""
    lower, upper = limits.checked_velocity_bounds(path)
    return np.where(slopes < 0.0, -lower, upper)


def find_blocked(limits: JointLimits, path: JointPath) -> tuple[int, PlanningError] | None:
    """Returns the first row in which a joint moves towards an end that it may not approach, and the error; or None.

    Args:
        limits: Limits of the joints.
        path: Joint angles along a path, shape (N, n), [rad].
    """
    if limits.near_ends is None:
        return None
    steps = np.diff(path, axis=0)
    allowed = bounds_along(limits, path[1:], steps)
    found = np.argwhere((allowed <= limits.near_ends.rounding) & (np.abs(steps) > _STILL))
    if not found.size:
        return None
    row, joint = found[0].tolist()
    return row + 1, _blocked(limits, joint, float(path[row + 1, joint]), bool(steps[row, joint] > 0.0))


def require_approachable(limits: JointLimits, start: JointVector, goal: JointVector) -> None:
    """Requires a goal at which the joints may still move towards the ends of their ranges.

    Raises:
        PlanningError: A joint may not.
    """
    blocked = find_blocked(limits, np.stack((start, goal)))
    if blocked is not None:
        raise blocked[1]


def plan_within_velocity(
    limits: JointLimits, plan: Callable[[float], PiecewisePolynomial], model: RobotModel | None
) -> PiecewisePolynomial:
    """Returns the fastest curve that keeps the velocity bounds near the ends of the ranges, and that of the tool.

    Args:
        limits: Limits of the joints.
        plan: Plans with a part of the speed, above 0, to 1.
        model: The arm, with its tool, if `Limits.joint_tool_velocity` bounds it; else None.

    Raises:
        PlanningError: No speed keeps them.
    """
    curve = plan(1.0)
    if limits.near_ends is None and model is None:
        return curve
    low = high = 1.0
    while (excess := _worst_excess(limits, model, curve)) > 1.0:
        high, low = low, low / max(excess, _LEAST_STEP)
        if low < _LOWEST_PART:
            if model is not None:
                raise PlanningError(
                    "the tool starts faster than motions in joint angles may move it; stop first and plan from "
                    "standstill"
                ).coded("start_tool_velocity")
            raise PlanningError(
                "no motion keeps the velocity bounds near the ends of the joints' ranges: a joint starts too fast "
                "towards one, or ends too close to one; stop first and plan from standstill, or choose a goal farther "
                "inside"
            ).coded("end_velocity")
        curve = plan(low)
    while high > low * (1.0 + _PRECISION):
        middle = (low * high) ** 0.5
        found = plan(middle)
        if _worst_excess(limits, model, found) <= 1.0:
            low, curve = middle, found
        else:
            high = middle
    return curve


def braking_limits(limits: JointLimits) -> tuple[JointLimits, Array]:
    """Returns limits with which every stop at some distance from the ends keeps the velocity bounds there.

    A stop from speed v with at most the acceleration a takes at least v^2 / (2 a). So a joint that can always stop at
    that distance is never faster than sqrt(2 a x), x before it, which is below the bound.

    Returns:
        The limits, with lower accelerations, and the distance from the ends, shape (n,), [rad]; 0 without such bounds.
    """
    ends = limits.near_ends
    if ends is None:
        return limits, np.zeros(len(limits.velocity))
    offset, twice = ends.offset, 2.0 * ends.deceleration
    distance = offset**2 / twice + _END_ROOM
    x = np.geomspace(1e-4, np.pi, 200)[:, np.newaxis]
    allowed = np.minimum(np.sqrt(twice * (x + distance)) - offset, limits.velocity)
    slowest = np.where(allowed < limits.velocity, allowed**2 / (2.0 * x), np.inf).min(axis=0)
    acceleration = readonly_copy(np.minimum(limits.acceleration, slowest))
    return replace(limits, acceleration=acceleration), distance


def followable_bounds(limits: JointLimits, acceleration: Array, q: JointVector) -> tuple[Array, Array]:
    """Returns the velocity bounds at joint angles, decreasing no faster than a joint can brake, shape (n,), [rad/s].

    Towards an end the bound decreases with deceleration v / (v + offset), v being the bound itself. Above the velocity
    at which that is the given acceleration, it is replaced by the velocity from which a joint brakes to it.

    Args:
        limits: Limits of the joints, with `near_ends`.
        acceleration: Used for braking, shape (n,), [rad/s^2].
        q: Joint angles, shape (n,), [rad].
    """
    ends, own = limits.near_ends, limits if limits.own is None else limits.own
    lower, upper = limits.checked_velocity_bounds(q)
    assert ends is not None
    excess = ends.deceleration - acceleration
    velocity = np.where(excess > 0.0, acceleration * ends.offset / np.maximum(excess, _STILL), np.inf)
    distance = (velocity + ends.offset) ** 2 / (2.0 * ends.deceleration)
    down, up = (
        np.where(room > distance, np.sqrt(velocity**2 + 2.0 * acceleration * np.maximum(room - distance, 0.0)), np.inf)
        for room in (q - own.lower, own.upper - q)
    )
    return np.maximum(lower, -down), np.minimum(upper, up)


def _worst_excess(limits: JointLimits, model: RobotModel | None, curve: PiecewisePolynomial) -> float:
    path = curve.sample(np.arange(0.0, curve.duration + CYCLE_TIME, CYCLE_TIME))
    excess = 0.0
    if limits.near_ends is not None:
        excess = float(end_excess(limits, path).max(initial=0.0))
    return excess if model is None else max(excess, float(tool_excess(model, path).max(initial=0.0)))


def _blocked(limits: JointLimits, joint: int, angle: float, is_up: bool) -> PlanningError:
    """Returns the error for a joint, from 0, that would come too close to an end of its range."""
    own, ends = limits if limits.own is None else limits.own, limits.near_ends
    assert ends is not None
    distance = float((ends.offset[joint] + ends.rounding[joint]) ** 2 / (2.0 * ends.deceleration[joint]))
    end = float((own.upper if is_up else own.lower)[joint])
    last = end - distance if is_up else end + distance
    return PlanningError(
        f"joint {joint + 1}: {angle_text(angle)} is too close to its limit {angle_text(end)}: the arm allows no "
        f"velocity towards it beyond {angle_text(last)}; stay before that"
    ).coded("near_end", joint=joint + 1, angle=angle, end=end, last=last)
