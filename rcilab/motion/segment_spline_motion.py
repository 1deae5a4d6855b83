"""The fastest motion along a segment spline: the time law is slowed down wherever a limit is exceeded."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits
from rcilab.model.robot_model import RobotModel
from rcilab.motion.bounds import limit_touched
from rcilab.motion.cycle_quintics import cycle_quintics, peak_derivatives
from rcilab.motion.end_velocity import end_excess, find_blocked
from rcilab.motion.rows import OVERCORRECTION, blocks, spread
from rcilab.motion.segment_spline import Rows, SegmentSpline
from rcilab.motion.segment_spline_bounds import ColumnLimits, column_limits, spline_bounds
from rcilab.motion.time_parametrization import FastestLaw, TimeParametrization, smooth_law
from rcilab.motion.tool_velocity import tool_excess

_ROUNDS = 12
"""Largest number of local slowdowns, and then of global ones. Observed: 1 to 4 local."""
_USUAL_ROUNDS = 4.0
"""Number of rounds that is reported as half of the progress. Tuning value."""
_MAX_SLOWDOWN = 50.0
"""A larger slowdown is required by a jump. Tuning value."""
_MIN_CHANGE = 1e-9
"""A larger relative change of a square of s' is not rounding."""


def plan_segment_spline(
    spline: SegmentSpline, model: RobotModel, report: Callable[[float], None]
) -> tuple[Array, list[float]]:
    """Returns the fastest curve along a spline, from standstill to standstill, and the times of the corners, [s].

    The curve has one quintic per cycle, with the position, velocity and acceleration of the spline at both ends: its
    coefficients, shape (N - 1, n, 6), in ascending powers of the time since the cycle began.

    Args:
        spline: The spline.
        model: The arm, with its tool.
        report: Called before every round with the approximate progress; an exception raised by it cancels planning.

    Raises:
        PlanningError: A joint limit or a singularity is in the way.
    """
    limits = model.limits
    tool_model = model if math.isfinite(limits.joint_tool_velocity) else None
    bounds = column_limits(limits)
    _require_approachable(spline, limits.joint)
    allowed = spline_bounds(spline, bounds, tool_model)
    finite = np.isfinite(bounds.acceleration)
    # From full deceleration to full acceleration, which is not reached below the largest velocity if jerks are small.
    velocity, acceleration, jerk = (table[finite] for table in (bounds.velocity, bounds.acceleration, bounds.jerk))
    times = np.minimum(acceleration / jerk, np.sqrt(velocity / jerk))
    reversal = 2.0 * float(spline.speed.max()) * float(times.max())
    cycles = max(2, math.ceil(reversal / CYCLE_TIME))
    fastest, slowdown = FastestLaw(allowed), np.ones(len(spline.knots))
    squares = np.zeros(len(spline.knots))
    worst = 0.0
    for attempt in range(2 * _ROUNDS):
        report(attempt / (attempt + _USUAL_ROUNDS))
        before, squares = squares, fastest.slowed(slowdown)
        law = smooth_law(spline.knots, squares, cycles)
        interval = spline.interval(law.s)
        changed = np.abs(squares - before) > _MIN_CHANGE * squares
        # Later rounds change the law in few places; the rest is checked again only at the end.
        is_checked = changed[interval] | changed[interval + 1]
        excess = _excess(spline, bounds, tool_model, law, interval, is_checked)
        if excess.max() <= 1.0 and not is_checked.all():
            excess = _excess(spline, bounds, tool_model, law, interval, np.ones_like(is_checked))
        if excess.max() <= 1.0:
            q, coefficients = _curve(spline, law)
            _require_inside(spline, q, law, limits.joint)
            corners = [int(np.searchsorted(law.s, corner)) * CYCLE_TIME for corner in spline.corners]
            return coefficients, corners
        worst = float(law.s[excess.argmax()])
        if attempt < _ROUNDS:
            factor = np.maximum(excess * excess * OVERCORRECTION, 1.0)
            slowdown *= spread(factor, law.s, spline.knots, cycles + 3)
        else:
            slowdown *= float(excess.max()) * OVERCORRECTION
        if slowdown.max() > _MAX_SLOWDOWN:
            break
    segment = spline.segment_at(worst)
    raise PlanningError(
        f"{spline.describe_position(worst)}: the joints would have to jump, because a singularity is close; "
        "move the tool around it",
        waypoint=segment.number,
    ).coded(
        "waypoint",
        number=segment.number,
        kind=segment.waypoint.type,
        reason=PlanningError("").coded("jump"),
    )


def _curve(spline: SegmentSpline, law: TimeParametrization) -> tuple[Array, Array]:
    """Returns the joint angles at N cycles, shape (N, n), and the coefficients between, shape (N - 1, n, 6)."""
    q, coefficients = np.empty((len(law.s), spline.n)), np.empty((len(law.s) - 1, spline.n, 6))
    for block in blocks(len(coefficients)):
        ends = slice(block.start, block.stop + 1)
        q[ends], powers = _quintics(spline, law, ends)
        coefficients[block] = np.stack(powers, axis=2)
    return q, coefficients


def _excess(
    spline: SegmentSpline,
    limits: ColumnLimits,
    model: RobotModel | None,
    law: TimeParametrization,
    interval: Rows,
    is_checked: Array,
) -> Array:
    """Returns the slowdown that each row needs to be inside every bound, shape (N,); 0 in blocks that are not checked.

    Args:
        spline: The spline.
        limits: The bounds.
        model: The arm if its tool is bounded by `Limits.joint_tool_velocity`; else None.
        law: The time law.
        interval: Interval of each row, shape (N,).
        is_checked: Rows to check, shape (N,); whole blocks are checked.
    """
    last = len(law.s) - 1
    excess = np.zeros(last + 1)
    for block in blocks(last):
        ends = slice(block.start, block.stop + 1)
        if is_checked[ends].any():
            q, powers = _quintics(spline, law, ends)
            excess[block] = _joint_excess(spline, limits, powers, interval[ends])
            if limits.ends is not None:
                np.maximum(excess[block], end_excess(limits.ends, q), out=excess[block])
            if model is not None:
                np.maximum(excess[block], tool_excess(model, q), out=excess[block])
            np.maximum(excess[ends], _tool_excess(spline, limits, law, interval, ends), out=excess[ends])
    return excess


def _quintics(spline: SegmentSpline, law: TimeParametrization, rows: slice) -> tuple[Array, list[Array]]:
    """Returns the joint angles at N cycles, shape (N, n), and the coefficients by power, shape (N - 1, n) each."""
    path = spline.sample(law.s[rows], slice(spline.n))
    return path[0], cycle_quintics(path, law, rows)


def _joint_excess(spline: SegmentSpline, limits: ColumnLimits, powers: list[Array], interval: Rows) -> Array:
    """Returns the slowdown that each cycle needs to be inside the joints' bounds, shape (N - 1,)."""
    speed = np.maximum(spline.speed[interval[:-1]], spline.speed[interval[1:]])
    tables = zip(_tables(limits, slice(spline.n)), (speed, speed, 1.0), peak_derivatives(powers), strict=True)
    excess = np.zeros(len(powers[0]))
    for order, (limit, scale, largest) in enumerate(tables, start=1):
        ratio = ((largest / limit).max(axis=1) / scale) ** (1.0 / order)
        np.maximum(excess, ratio, out=excess)
    return excess


def _tool_excess(
    spline: SegmentSpline, limits: ColumnLimits, law: TimeParametrization, interval: Rows, rows: slice
) -> Array:
    """Returns the slowdown that each of some rows needs to be inside the bounds on tool and arm angle.

    Checked by backward differences at 1 ms, as by the controller, with standstill before and after; the last row
    includes the three that follow it.
    """
    n, last = spline.n, len(law.s) - 1
    end = rows.stop + 3 if rows.stop > last else rows.stop
    # With the three previous rows; before the first and after the last row there are three cycles of standstill.
    clamped = np.clip(np.arange(rows.start - 3, end), 0, last)
    moves_tool = _with_previous(spline.moves_tool[interval[clamped]], np.minimum) > 0.0
    excess = np.zeros(end - rows.start)
    if moves_tool.any():
        speed = _with_previous(spline.speed[interval[clamped]], np.maximum)
        table = spline.values(law.s[clamped], slice(n, None)).T.copy()
        for order, limit in enumerate(_tables(limits, slice(n, None)), start=1):
            table = np.diff(table) / CYCLE_TIME
            squares = table * table
            ratio = np.abs(table[0]) / limit[0]
            np.maximum(ratio, np.sqrt(squares[1:4].sum(axis=0)) / limit[1], out=ratio)
            np.maximum(ratio, np.sqrt(squares[4:7].sum(axis=0)) / limit[2], out=ratio)
            excess_ratio = ratio[3 - order :]
            excess_ratio = np.where(moves_tool, excess_ratio if order == 3 else excess_ratio / speed, 0.0)
            np.maximum(excess, excess_ratio ** (1.0 / order), out=excess)
    count = rows.stop - rows.start
    excess[count - 1] = excess[count - 1 :].max()
    return excess[:count]


def _tables(limits: ColumnLimits, columns: slice) -> tuple[Array, Array, Array]:
    return limits.velocity[columns], limits.acceleration[columns], limits.jerk[columns]


def _with_previous(values: Array, combine: np.ufunc) -> Array:
    """Returns the combined values of each row from the fourth on and the three before it, shape (N - 3,)."""
    return combine(combine(values[3:], values[2:-1]), combine(values[1:-2], values[:-3]))


def _require_approachable(spline: SegmentSpline, limits: JointLimits) -> None:
    blocked = find_blocked(limits, spline.values(spline.knots, slice(spline.n)))
    if blocked is not None:
        row, error = blocked
        s = float(spline.knots[row])
        segment = spline.segment_at(s)
        raise PlanningError(f"{spline.describe_position(s)}: {error}", waypoint=segment.number).coded(
            "waypoint", number=segment.number, kind=segment.waypoint.type, reason=error
        )


def _require_inside(spline: SegmentSpline, q: Array, law: TimeParametrization, limits: JointLimits) -> None:
    outside = np.argwhere(~((limits.lower < q) & (q < limits.upper)))
    if outside.size:
        row, joint = outside[0].tolist()
        segment = spline.segment_at(float(law.s[row]))
        advice = "a smaller blend radius stays closer to the waypoints"
        limit_error = limit_touched(limits, joint + 1, float(q[row, joint]), advice)
        raise PlanningError(
            f"{spline.describe_position(float(law.s[row]))}: {limit_error}", waypoint=segment.number
        ).coded(
            "waypoint",
            number=segment.number,
            kind=segment.waypoint.type,
            reason=limit_error,
        )
