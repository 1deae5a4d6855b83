"""Curves for a screen: few points, no spike lost, limits and violations as areas. No plotting library in here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from rcilab.arrays import Array
from rcilab.clock import CYCLE_TIME

if TYPE_CHECKING:
    from rcilab.limits import JointLimits
    from rcilab.motion import Motion

Quantity = Literal["q", "dq", "ddq", "jerk"]
QUANTITIES: tuple[Quantity, ...] = ("q", "dq", "ddq", "jerk")


_WIDENED = 3  # Points that a marked violation reaches to both sides: one bad cycle is still some pixels wide.
_FARTHEST = 3.0  # Multiple of the limit that a plot reaches at most; `rcilab.check` gives the number beyond.
_LEAST_ERROR = 0.01  # [deg or mm] Smallest range of a plot of errors, for its ticks to be readable. A choice.
_ROUND_ENDS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Curves:
    """Signals of the same kind over time."""

    t: Array
    """[s], increasing, shape (N,)."""
    values: Array
    """One column a signal, shape (N, k)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Frame:
    """What one plot shows: everything on one time axis, shape (M,) each."""

    t: Array
    """Two instants a bucket, [s]."""
    plan: tuple[Array, ...]
    actual: tuple[Array, ...]
    """Empty when nothing was recorded."""
    upper: float
    lower: float
    """The limit, in the unit of the curves."""
    violated: NDArray[np.bool_]
    """Where a planned curve is outside its limits, widened to what an eye can see, boolean."""
    bound: float
    """The plot reaches from -bound to bound; a curve far beyond its limit leaves it, so that the limit stays seen."""
    end: float
    """Where the time axis ends, [s]: a round number, so that the axis stands still while a plan is dragged."""


def decimate(curves: Curves, edges: Array) -> Array:
    """Returns the smallest and the largest value of every signal in every bucket, in the order they occur.

    No extreme value is lost: whatever a full plot would have shown as a spike is still there.

    Args:
        curves: What to thin out.
        edges: Times between the buckets, increasing, shape (B + 1,), [s].

    Returns:
        Two rows a bucket, shape (2 B, k). A bucket without samples repeats the value before it; before the first
        sample and from one bucket after the last on there is NaN.
    """
    buckets, signals = len(edges) - 1, curves.values.shape[1]
    thin = np.full((2 * buckets, signals), np.nan)
    starts = np.searchsorted(curves.t, edges[:-1], side="left")
    ends = np.append(starts[1:], np.searchsorted(curves.t, edges[-1], side="right"))
    last = int(np.searchsorted(edges, curves.t[-1], side="right")) - 1 if len(curves.t) else -1
    for bucket in range(min(buckets, last + 1)):
        a, b = starts[bucket], ends[bucket]
        if a == b:
            if a > 0:
                thin[2 * bucket : 2 * bucket + 2] = curves.values[a - 1]
            continue
        part = curves.values[a:b]
        low, high = part.argmin(axis=0), part.argmax(axis=0)
        smallest, largest = part.min(axis=0), part.max(axis=0)
        thin[2 * bucket] = np.where(low <= high, smallest, largest)
        thin[2 * bucket + 1] = np.where(low <= high, largest, smallest)
    return thin


def plan_curves(motion: Motion, quantity: Quantity) -> Curves:
    """Returns a planned signal, one column a joint."""
    return Curves(t=motion.times, values=getattr(motion, quantity))


def recorded_curves(t: Array, q: Array, q_c: Array, dq: Array, quantity: Quantity) -> Curves:
    """Returns a recorded signal: measured q and dq; ddq and jerk of the commands, as the controller computes them.

    Args:
        t: Time since the first command, [s], shape (N,).
        q: Measured joint angles, [rad], shape (N, n).
        q_c: Commanded joint angles, [rad], shape (N, n).
        dq: Measured joint velocities, [rad/s], shape (N, n).
        quantity: Which signal.
    """
    if quantity in ("q", "dq"):
        return Curves(t=t, values=q if quantity == "q" else dq)
    order = 2 if quantity == "ddq" else 3
    values = np.zeros_like(q_c)
    if len(q_c) > order:
        # A lost cycle makes a gap: differences across it would be no derivative, so they are left at zero.
        steps = np.rint(np.diff(t) / CYCLE_TIME)
        whole = np.ones(len(t) - order, dtype=bool)
        for shift in range(order):
            whole &= steps[shift : len(steps) - order + 1 + shift] == 1.0
        values[order:][whole] = np.diff(q_c, n=order, axis=0)[whole] / CYCLE_TIME**order
    return Curves(t=t, values=values)


def bounds_of(limits: JointLimits, quantity: Quantity) -> tuple[Array, Array]:
    """Returns lower and upper limit of a signal, each of shape (n,)."""
    if quantity == "q":
        return limits.lower, limits.upper
    upper = {"dq": limits.velocity, "ddq": limits.acceleration, "jerk": limits.jerk}[quantity]
    return -upper, upper


def build_error_frame(t: Array, errors: Array, last: float, buckets: int = 240) -> Frame:
    """Returns what a plot of errors shows: no limits, and an axis that reaches as far as the largest of them.

    Args:
        t: Times of the errors, [s], shape (N,).
        errors: One column a curve, in the unit to be shown, shape (N, k).
        last: Where the other plots end, [s], so that this one fits below them.
        buckets: Number of buckets the time is cut into.
    """
    edges = np.linspace(0.0, last, buckets + 1)
    times = np.repeat(edges[:-1], 2)
    times[1::2] = 0.5 * (edges[:-1] + edges[1:])
    times[-1] = last
    end = max(_round_end(last), last)
    times = np.append(times, end)
    thin = decimate(Curves(t=t, values=errors), edges)
    largest = float(np.nanmax(np.abs(thin))) if np.isfinite(thin).any() else 0.0
    return Frame(
        t=times,
        plan=tuple(np.append(column, np.nan) for column in thin.T),
        actual=(),
        upper=np.nan,
        lower=np.nan,
        violated=np.zeros(len(times), dtype=bool),
        bound=max(1.12 * largest, _LEAST_ERROR),
        end=float(end),
    )


def last_time(*curves: Curves | None) -> float:
    """Returns when the last of these curves ends, [s]; 1 without any."""
    return max([0.0] + [float(c.t[-1]) for c in curves if c is not None and len(c.t)]) or 1.0


def build_frame(
    plan: Curves | None, actual: Curves | None, limits: JointLimits, quantity: Quantity, joint: int, buckets: int = 240
) -> Frame:
    """Returns what a plot of one quantity shows.

    Args:
        plan: Planned curves of all joints, or None.
        actual: Recorded curves of all joints, or None.
        limits: The arm's limits.
        quantity: Which signal.
        joint: The joint to show in its own unit, [deg] and its derivatives, from 1; 0 shows all, each in percent of
            its limit (of its range, with 0 in the middle, for q).
        buckets: Number of buckets the time is cut into.
    """
    low, high = bounds_of(limits, quantity)
    last = last_time(plan, actual)
    end = _round_end(last)
    edges = np.linspace(0.0, last, buckets + 1)
    t = np.repeat(edges[:-1], 2)
    t[1::2] = 0.5 * (edges[:-1] + edges[1:])
    t[-1] = last
    t = np.append(t, max(end, last))  # One more point, so that the limits run on to the end of the axis.

    def thin(curves: Curves | None) -> tuple[Array, ...]:
        if curves is None or not len(curves.t):
            return ()
        if joint:
            shown = Curves(t=curves.t, values=np.degrees(curves.values[:, joint - 1 : joint]))
        else:
            shown = Curves(t=curves.t, values=100.0 * (2.0 * curves.values - low - high) / (high - low))
        return tuple(np.append(column, np.nan) for column in decimate(shown, edges).T)

    lower, upper = (-100.0, 100.0)
    if joint:
        lower, upper = float(np.degrees(low[joint - 1])), float(np.degrees(high[joint - 1]))
    planned, recorded = thin(plan), thin(actual)
    curves = np.nan_to_num(np.array(planned)) if planned else np.zeros((1, len(t)))
    outside = ((curves > upper) | (curves < lower)).any(axis=0)
    violated = np.convolve(outside, np.ones(2 * _WIDENED + 1), mode="same") > 0.5
    violated[-2:] = False  # The last two points span the empty rest of the axis.
    limit = max(abs(upper), abs(lower))
    return Frame(
        t=t,
        end=float(t[-1]),
        plan=planned,
        actual=recorded,
        upper=upper,
        lower=lower,
        violated=violated,
        bound=min(1.12 * max(limit, float(np.abs(curves).max())), _FARTHEST * limit),
    )


def _round_end(last: float) -> float:
    return next((end for end in _ROUND_ENDS if end >= last - 1e-9), last)
