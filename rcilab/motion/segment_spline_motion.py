"""The fastest motion along a segment spline: the time law is slowed down where its motion exceeds a limit."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import PlanningError
from rcilab.core.limits import JointLimits, Limits
from rcilab.motion.bounds import limit_touched
from rcilab.motion.hermite import quintic
from rcilab.motion.rows import blocks, spread
from rcilab.motion.segment_spline import Rows, SegmentSpline
from rcilab.motion.segment_spline_bounds import ColumnLimits, chain_bounds, column_limits
from rcilab.motion.time_parametrization import FastestLaw, TimeParametrization, smooth_law

_ROUNDS = 12
"""How often to slow down in places, and then as often as a whole. Seen: 1 to 4 in places."""
_USUAL_ROUNDS = 4.0
"""Number of rounds that counts as half of the progress. Tuning value."""
_SLOWEST = 50.0
"""Beyond this a limit is passed by a jump. Tuning value."""
_INSTANTS = (0.25, 0.5, 0.75)
"""Where in a cycle the curve is looked at, besides its start, in cycles."""
_CHANGE = 1e-9
"""By what part of itself a square of s' has changed that is not rounding."""
_HASTE = 1.002
"""To slow down by the square of what was found, and this much more, also where it was closely under a limit, so that
few rounds do, and places that were good stay so when the cycles fall elsewhere. Tuning value."""


def plan_chain(chain: SegmentSpline, limits: Limits, report: Callable[[float], None]) -> tuple[Array, list[float]]:
    """Returns the fastest curve along a spline between standstills, and when it passes each corner, [s].

    A quintic a cycle, through the chain at every cycle with its velocity and acceleration there: its coefficients,
    shape (N - 1, n, 6), ascending powers of the time since the cycle began.

    Args:
        chain: The chain.
        limits: Of the arm.
        report: Called before every round with the approximate progress; an exception that it raises ends the planning.

    Raises:
        PlanningError: A joint limit or a singularity is in the way.
    """
    bounds = column_limits(limits)
    allowed = chain_bounds(chain, bounds)
    finite = np.isfinite(bounds.acceleration)
    # From full deceleration to full acceleration.
    reversal = 2.0 * float(chain.speed.max()) * float((bounds.acceleration[finite] / bounds.jerk[finite]).max())
    cycles = max(2, math.ceil(reversal / CYCLE_TIME))
    fastest, slowdown = FastestLaw(allowed), np.ones(len(chain.knots))
    squares = np.zeros(len(chain.knots))
    worst = 0.0
    for round_ in range(2 * _ROUNDS):
        report(round_ / (round_ + _USUAL_ROUNDS))
        before, squares = squares, fastest.slowed(slowdown)
        law = smooth_law(chain.knots, squares, cycles)
        interval = chain.interval(law.s)
        changed = np.abs(squares - before) > _CHANGE * squares
        # Few places make the later rounds; where the law is as it was, it is looked at again only in the end.
        looked_at = changed[interval] | changed[interval + 1]
        excess = _excess(chain, bounds, law, interval, looked_at)
        if excess.max() <= 1.0 and not looked_at.all():
            excess = _excess(chain, bounds, law, interval, np.ones_like(looked_at))
        if excess.max() <= 1.0:
            q, coefficients = _curve(chain, law)
            _require_inside(chain, q, law, limits.joint)
            corners = [int(np.searchsorted(law.s, middle)) * CYCLE_TIME for middle in chain.middles]
            return coefficients, corners
        worst = float(law.s[excess.argmax()])
        if round_ < _ROUNDS:
            factor = np.maximum(excess * excess * _HASTE, 1.0)
            slowdown *= spread(factor, law.s, chain.knots, cycles + 3)
        else:
            slowdown *= float(excess.max()) * _HASTE
        if slowdown.max() > _SLOWEST:
            break
    raise PlanningError(
        f"{chain.place(worst)}: the joints would have to jump, because a singularity is close; lead the tool around it",
        waypoint=chain.segment_at(worst).number,
    ).coded(
        "waypoint",
        number=chain.segment_at(worst).number,
        kind=chain.segment_at(worst).waypoint.type,
        reason=PlanningError("").coded("jump"),
    )


def _curve(chain: SegmentSpline, law: TimeParametrization) -> tuple[Array, Array]:
    """Returns the joint angles at N cycles, shape (N, n), and the coefficients between, shape (N - 1, n, 6)."""
    q, coefficients = np.empty((len(law.s), chain.n)), np.empty((len(law.s) - 1, chain.n, 6))
    for block in blocks(len(coefficients)):
        ends = slice(block.start, block.stop + 1)
        q[ends], powers = _quintics(chain, law, ends)
        coefficients[block] = np.stack(powers, axis=2)
    return q, coefficients


def _excess(
    chain: SegmentSpline, limits: ColumnLimits, law: TimeParametrization, interval: Rows, looked_at: Array
) -> Array:
    """Returns how much slower each row must be passed to keep every bound, shape (N,), in blocks that are looked at.

    Args:
        chain: The chain.
        limits: What to keep.
        law: How fast it is run through.
        interval: In which interval each row is, shape (N,).
        looked_at: Which rows to look at, shape (N,); the others of their blocks are looked at as well.
    """
    last = len(law.s) - 1
    excess = np.zeros(last + 1)
    for block in blocks(last):
        ends = slice(block.start, block.stop + 1)
        if looked_at[ends].any():
            powers = _quintics(chain, law, ends)[1]
            excess[block] = _joint_excess(chain, limits, powers, interval[ends])
            np.maximum(excess[ends], _tool_excess(chain, limits, law, interval, ends), out=excess[ends])
    return excess


def _quintics(chain: SegmentSpline, law: TimeParametrization, rows: slice) -> tuple[Array, list[Array]]:
    """Returns the joint angles at N cycles, shape (N, n), and the curve's coefficients by power, each (N - 1, n)."""
    h = CYCLE_TIME
    q, first, second = chain.sample(law.s[rows], slice(chain.n))
    ds, dds = law.ds[rows, np.newaxis], law.dds[rows, np.newaxis]
    v = first * ds
    a = second * ds**2 + first * dds
    if rows.start == 0:
        v[0] = a[0] = 0.0
    if rows.stop == len(law.s):
        v[-1] = a[-1] = 0.0
    parts = quintic((q[:-1], v[:-1], a[:-1]), (q[1:], v[1:], a[1:]), h)
    return q, [part / h**power for power, part in enumerate(parts)]


def _joint_excess(chain: SegmentSpline, limits: ColumnLimits, powers: list[Array], interval: Rows) -> Array:
    """Returns how much slower each cycle must be to keep the joints' bounds in it, shape (N - 1,)."""
    n = chain.n
    speed = np.maximum(chain.speed[interval[:-1]], chain.speed[interval[1:]])
    scales = speed, speed, np.ones_like(speed)
    excess = np.zeros(len(powers[0]))
    for order, (limit, scale) in enumerate(zip(_tables(limits, slice(n)), scales, strict=True), start=1):
        powers = [float(p) * powers[p] for p in range(1, len(powers))]
        largest = np.abs(powers[0])
        for part in _INSTANTS:
            value = powers[-1]
            for coefficient in reversed(powers[:-1]):
                value = value * (part * CYCLE_TIME) + coefficient
            np.maximum(largest, np.abs(value), out=largest)
        ratio = ((largest / limit).max(axis=1) / scale) ** (1.0 / order)
        np.maximum(excess, ratio, out=excess)
    return excess


def _tool_excess(
    chain: SegmentSpline, limits: ColumnLimits, law: TimeParametrization, interval: Rows, rows: slice
) -> Array:
    """Returns how much slower each of some rows must be to keep the bounds on tool and arm angle.

    By backward differences at 1 ms, as the controller checks them, with standstill before and after: the last row
    includes the three that follow it.
    """
    n, last = chain.n, len(law.s) - 1
    end = rows.stop + 3 if rows.stop > last else rows.stop
    # With the three rows before; the first one has stood, and the last one stands, for three more cycles.
    held = np.clip(np.arange(rows.start - 3, end), 0, last)
    leads = _looking_back(chain.leads_tool[interval[held]], np.minimum) > 0.0
    excess = np.zeros(end - rows.start)
    if leads.any():
        speed = _looking_back(chain.speed[interval[held]], np.maximum)
        table = chain.values(law.s[held], slice(n, None)).T.copy()
        for order, limit in enumerate(_tables(limits, slice(n, None)), start=1):
            table = np.diff(table) / CYCLE_TIME
            squares = table * table
            ratio = np.abs(table[0]) / limit[0]
            np.maximum(ratio, np.sqrt(squares[1:4].sum(axis=0)) / limit[1], out=ratio)
            np.maximum(ratio, np.sqrt(squares[4:7].sum(axis=0)) / limit[2], out=ratio)
            seen = ratio[3 - order :]
            seen = np.where(leads, seen if order == 3 else seen / speed, 0.0)
            np.maximum(excess, seen ** (1.0 / order), out=excess)
    count = rows.stop - rows.start
    excess[count - 1] = excess[count - 1 :].max()
    return excess[:count]


def _tables(limits: ColumnLimits, columns: slice) -> tuple[Array, Array, Array]:
    return limits.velocity[columns], limits.acceleration[columns], limits.jerk[columns]


def _looking_back(values: Array, join: np.ufunc) -> Array:
    """Returns what each row from the fourth on and the three before it say, joined, shape (N - 3,)."""
    return join(join(values[3:], values[2:-1]), join(values[1:-2], values[:-3]))


def _require_inside(chain: SegmentSpline, q: Array, law: TimeParametrization, limits: JointLimits) -> None:
    outside = np.argwhere(~((limits.lower < q) & (q < limits.upper)))
    if outside.size:
        row, joint = outside[0].tolist()
        segment = chain.segment_at(float(law.s[row]))
        advice = "a smaller blend radius stays closer to the waypoints"
        touched = limit_touched(limits, joint + 1, float(q[row, joint]), advice)
        raise PlanningError(f"{chain.place(float(law.s[row]))}: {touched}", waypoint=segment.number).coded(
            "waypoint",
            number=segment.number,
            kind=segment.waypoint.type,
            reason=touched,
        )
