"""A chain run through as fast as the limits allow: the law is slowed down where its motion passes a limit."""

from __future__ import annotations

import math

import numpy as np

from rcilab.arrays import Array
from rcilab.clock import CYCLE_TIME
from rcilab.errors import PlanningError
from rcilab.limits import JointLimits, Limits
from rcilab.motion.blocks import blocks
from rcilab.motion.chain import Chain, Rows
from rcilab.motion.chain_law import ChainLaw, ColumnLimits, chain_bounds, column_limits, fastest_law
from rcilab.motion.hermite import quintic

_ROUNDS = 12
"""How often to slow down in places, and then as often as a whole. Seen: 1 to 4 in places."""
_SLOWEST = 50.0
"""Beyond this a limit is passed by a jump. A choice."""
_INSTANTS = (0.25, 0.5, 0.75)
"""Where in a cycle the curve is looked at, besides its start, in cycles."""
_HASTE = 1.001
"""To slow down by the square of what was found, and this much more, so that few rounds do. A choice."""


def plan_chain(chain: Chain, limits: Limits) -> tuple[Array, list[float]]:
    """Returns the fastest curve along a chain from rest to rest, and when it passes each corner, [s].

    A quintic a cycle, through the chain at every cycle with its velocity and acceleration there: its coefficients,
    shape (N - 1, n, 6), ascending powers of the time since the cycle began.

    Args:
        chain: The chain.
        limits: Of the arm.

    Raises:
        PlanningError: A joint limit or a singularity is in the way.
    """
    bounds = column_limits(limits)
    allowed = chain_bounds(chain, bounds)
    finite = np.isfinite(bounds.acceleration)
    # From full deceleration to full acceleration.
    reversal = 2.0 * float(chain.speed.max()) * float((bounds.acceleration[finite] / bounds.jerk[finite]).max())
    cycles = max(2, math.ceil(reversal / CYCLE_TIME))
    slowdown = np.ones(len(chain.knots))
    worst = 0.0
    for round_ in range(2 * _ROUNDS):
        law = fastest_law(allowed, slowdown, cycles)
        interval = chain.interval(law.s)
        q, coefficients = np.empty((len(law.s), chain.n)), np.empty((len(law.s) - 1, chain.n, 6))
        excess = _tool_excess(chain, bounds, law, interval)
        for block in blocks(len(coefficients)):
            ends = slice(block.start, block.stop + 1)
            q[ends], powers = _curve(chain, law, ends)
            coefficients[block] = np.stack(powers, axis=2)
            joints = _joint_excess(chain, bounds, powers, interval[ends])
            np.maximum(excess[block], joints, out=excess[block])
        if excess.max() <= 1.0:
            _require_inside(chain, q, law, limits.joint)
            corners = [int(np.searchsorted(law.s, middle)) * CYCLE_TIME for middle in chain.middles]
            return coefficients, corners
        worst = float(law.s[excess.argmax()])
        somewhere = round_ < _ROUNDS
        slowdown *= _spread(excess, law.s, chain.knots, cycles) if somewhere else float(excess.max()) * _HASTE
        if slowdown.max() > _SLOWEST:
            break
    raise PlanningError(
        f"{chain.place(worst)}: the joints would have to jump, because a singularity is close; lead the tool around it",
        waypoint=chain.segment_at(worst).number,
    )


def _curve(chain: Chain, law: ChainLaw, rows: slice) -> tuple[Array, list[Array]]:
    """Returns the joint angles at N cycles, shape (N, n), and their coefficients by power, each (N - 1, n)."""
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


def _joint_excess(chain: Chain, limits: ColumnLimits, powers: list[Array], interval: Rows) -> Array:
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


def _tool_excess(chain: Chain, limits: ColumnLimits, law: ChainLaw, interval: Rows) -> Array:
    """Returns how much slower each row must be passed to keep the bounds on tool and arm angle, shape (N,).

    By backward differences at 1 ms, as the controller judges them, with rest before and after.
    """
    n, last = chain.n, len(law.s) - 1
    speed = _looking_back(chain.speed[interval], np.maximum)
    leads = _looking_back(chain.leads_tool[interval], np.minimum) > 0.0
    excess = np.zeros(last + 4)
    if not leads.any():
        return excess[: last + 1]
    for block in blocks(len(excess)):
        # With the three rows before; the first one has stood, and the last one stands, for three more cycles.
        rows = np.clip(np.arange(block.start - 3, block.stop), 0, last)
        here = rows[3:]
        table = chain.values(law.s[rows], slice(n, None)).T.copy()
        for order, limit in enumerate(_tables(limits, slice(n, None)), start=1):
            table = np.diff(table) / CYCLE_TIME
            squares = table * table
            ratio = np.abs(table[0]) / limit[0]
            np.maximum(ratio, np.sqrt(squares[1:4].sum(axis=0)) / limit[1], out=ratio)
            np.maximum(ratio, np.sqrt(squares[4:7].sum(axis=0)) / limit[2], out=ratio)
            seen = ratio[3 - order :]
            seen = np.where(leads[here], seen if order == 3 else seen / speed[here], 0.0)
            np.maximum(excess[block], seen ** (1.0 / order), out=excess[block])
    excess[last] = excess[last:].max()
    return excess[: last + 1]


def _tables(limits: ColumnLimits, columns: slice) -> tuple[Array, Array, Array]:
    return limits.velocity[columns], limits.acceleration[columns], limits.jerk[columns]


def _looking_back(values: Array, join: np.ufunc) -> Array:
    """Returns what a row and the three before it say, joined, shape (N,)."""
    wide = np.concatenate((np.repeat(values[:1], 3), values))
    return join(join(wide[3:], wide[2:-1]), join(wide[1:-2], wide[:-3]))


def _spread(excess: Array, s: Array, knots: Array, cycles: int) -> Array:
    """Returns by how much to slow down at each knot, given by how much each row is too fast."""
    reach = cycles + 3
    wide = np.pad(np.where(excess > 1.0, excess * excess * _HASTE, 1.0), reach, constant_values=1.0)
    factor = np.lib.stride_tricks.sliding_window_view(wide, 2 * reach + 1).max(axis=1)
    result = np.interp(knots, s, factor)
    below = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(knots) - 2)
    np.maximum.at(result, below, factor)
    np.maximum.at(result, below + 1, factor)
    return result


def _require_inside(chain: Chain, q: Array, law: ChainLaw, limits: JointLimits) -> None:
    outside = np.argwhere(~((limits.lower < q) & (q < limits.upper)))
    if outside.size:
        row, joint = outside[0].tolist()
        raise PlanningError(
            f"{chain.place(float(law.s[row]))}: joint {joint + 1} would touch its limit at "
            f"{math.degrees(q[row, joint]):.2f} deg ({math.degrees(limits.lower[joint]):.0f} to "
            f"{math.degrees(limits.upper[joint]):.0f} deg); a smaller blend radius stays closer to the waypoints",
            waypoint=chain.segment_at(float(law.s[row])).number,
        )
