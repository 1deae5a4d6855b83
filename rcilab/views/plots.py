"""Curves for a screen: few points, no spike lost, limits and violations as areas. No plotting library in here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from rcilab.conformance.signals import HOLD_SAMPLES
from rcilab.core.arrays import Array, JointPath
from rcilab.core.clock import CYCLE_TIME
from rcilab.motion.bounds import RECOVERY_RANGE, range_from

if TYPE_CHECKING:
    from rcilab.core.limits import JointLimits
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion

Quantity = Literal["q", "dq", "ddq", "jerk", "tau"]
QUANTITIES: tuple[Quantity, ...] = ("q", "dq", "ddq", "jerk")
ORDERS: dict[Quantity, int] = {quantity: order for order, quantity in enumerate(QUANTITIES)}
"""How many times the angles are differentiated for a signal."""
"""What a motion has of every joint; a torque takes an arm and its load as well."""

_WIDENED = 3  # Points that a marked violation reaches to both sides: one bad cycle is still some pixels wide.
_FARTHEST = 3.0  # Multiple of the limit that a plot reaches at most; `rcilab.check` gives the number beyond.
_LEAST_RANGE = 0.02  # Of a plot without limits, in the unit shown, for its ticks to be readable.
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
    """Where a curve is outside its limits, widened to what an eye can see, boolean."""
    bound: float
    """The plot reaches from -bound to bound; a curve far beyond its limit leaves it, so that the limit stays seen."""
    end: float
    """Where the time axis ends, [s]: a round number, so that the axis stands still while a plan is dragged."""


def mark_moment(frame: Frame, moment: float) -> Frame:
    """Returns a frame with an instant marked as a violation is, whatever the curves do there.

    Args:
        frame: What to mark.
        moment: When, [s].
    """
    here = int(np.abs(frame.t - moment).argmin())
    marked = frame.violated.copy()
    marked[max(here - _WIDENED, 0) : here + _WIDENED + 1] = True
    return replace(frame, violated=marked)


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
    ends = np.searchsorted(curves.t, edges, side="left")
    ends[-1] = np.searchsorted(curves.t, edges[-1], side="right")
    counts = np.diff(ends)
    full = np.flatnonzero(counts)
    if not full.size:
        return thin
    starts, values = ends[full], curves.values[ends[0] : ends[-1]]
    places = starts - ends[0]
    smallest, largest = np.minimum.reduceat(values, places), np.maximum.reduceat(values, places)
    rising = _first(values, smallest, places, counts[full]) <= _first(values, largest, places, counts[full])
    thin[2 * full] = np.where(rising, smallest, largest)
    thin[2 * full + 1] = np.where(rising, largest, smallest)
    last = int(np.searchsorted(edges, curves.t[-1], side="right")) - 1
    empty = np.flatnonzero((counts == 0) & (ends[:-1] > 0) & (np.arange(buckets) <= last))
    thin[2 * empty] = thin[2 * empty + 1] = curves.values[ends[empty] - 1]
    return thin


def _first(values: Array, wanted: Array, places: NDArray[np.intp], counts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Returns the row in which every bucket first has its wanted value."""
    rows = np.arange(len(values))[:, np.newaxis]
    is_it = values == np.repeat(wanted, counts, axis=0)
    return np.minimum.reduceat(np.where(is_it, rows, len(values)), places)


def plan_curves(motion: Motion, quantity: Quantity, model: RobotModel | None = None) -> Curves:
    """Returns a planned signal, one column a joint; the torque that it takes `model` with its load.

    Velocity, acceleration and jerk are the backward differences that the controller computes and `check` compares, in
    the cycles behind the end, too: what those show is drawn at the end.
    """
    if quantity == "q":
        return Curves(t=motion.times, values=motion.q)
    held = np.repeat(motion.q[-1:], HOLD_SAMPLES, axis=0)
    t, path = np.append(motion.times, np.repeat(motion.times[-1:], HOLD_SAMPLES)), np.concatenate((motion.q, held))
    if quantity == "tau":
        assert model is not None
        return Curves(t=t, values=model.torque(path, _differences(path, 1), _differences(path, 2)).full)
    return Curves(t=t, values=_differences(path, ORDERS[quantity]))


def _differences(path: JointPath, order: int) -> JointPath:
    """Returns the backward differences of rows that follow on standing still, one a cycle."""
    return np.diff(np.concatenate((np.repeat(path[:1], order, axis=0), path)), n=order, axis=0) / CYCLE_TIME**order


def streamed_curves(q: JointPath, quantity: Quantity, model: RobotModel | None = None) -> Curves:
    """Returns a signal of rows that are streamed one a cycle, as the controller computes it: by backward differences.

    What a fitted curve would make of a corner between two rows is more than the controller sees of it.

    Args:
        q: Commanded joint angles, shape (N, n), [rad].
        quantity: Which signal.
        model: The arm with its load, for the torque.
    """
    t: Array = np.linspace(0.0, CYCLE_TIME * (len(q) - 1), len(q))
    if quantity == "q":
        return Curves(t=t, values=q)
    if quantity == "tau":
        assert model is not None
        rates = (backward_differences(t, q, order) for order in (1, 2))
        return Curves(t=t, values=model.torque(q, *rates).full)
    return Curves(t=t, values=backward_differences(t, q, ORDERS[quantity]))


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
    return Curves(t=t, values=backward_differences(t, q_c, 2 if quantity == "ddq" else 3))


def backward_differences(t: Array, values: Array, order: int) -> Array:
    """Returns the derivative of a signal as the controller computes it; zero where a cycle before is missing."""
    found = np.zeros_like(values)
    if len(values) > order:
        # A lost cycle makes a gap: differences across it would be no derivative.
        steps = np.rint(np.diff(t) / CYCLE_TIME)
        whole = np.ones(len(t) - order, dtype=bool)
        for shift in range(order):
            whole &= steps[shift : len(steps) - order + 1 + shift] == 1.0
        found[order:][whole] = np.diff(values, n=order, axis=0)[whole] / CYCLE_TIME**order
    return found


def bounds_of(limits: JointLimits, quantity: Quantity) -> tuple[Array, Array]:
    """Returns lower and upper limit of a signal, each of shape (n,)."""
    if quantity == "q":
        return limits.lower, limits.upper
    upper = {"dq": limits.velocity, "ddq": limits.acceleration, "jerk": limits.jerk, "tau": limits.torque}[quantity]
    return -upper, upper


def build_error_frame(t: Array, errors: Array, last: float, least: float, buckets: int = 240) -> Frame:
    """Returns what a plot of errors shows: no limits, and an axis that reaches as far as the largest of them.

    Args:
        t: Times of the errors, [s], shape (N,).
        errors: One column a curve, in the unit to be shown, shape (N, k).
        last: Where the other plots end, [s], so that this one fits below them.
        least: Smallest range of the axis to each side, in the unit to be shown; see `rcilab.i18n.plot_scale`.
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
        bound=max(1.12 * largest, least),
        end=float(end),
    )


def last_time(*curves: Curves | None) -> float:
    """Returns when the last of these curves ends, [s]; 1 without any."""
    return max([0.0] + [float(c.t[-1]) for c in curves if c is not None and len(c.t)]) or 1.0


def build_frame(
    plan: Curves | None,
    actual: Curves | None,
    limits: JointLimits,
    quantity: Quantity,
    joint: int,
    buckets: int = 240,
    factor: float = math.degrees(1.0),
) -> Frame:
    """Returns what a plot of one quantity of the joints shows.

    Args:
        plan: Planned curves of all joints, or None.
        actual: Recorded curves of all joints, or None.
        limits: The arm's limits; of the angles of a plan that leads back from outside its range, as far as it does.
        quantity: Which signal.
        joint: The joint to show in its own unit, from 1; 0 shows all, each in percent of its limit (of its range, with
            0 in the middle, for q).
        buckets: Number of buckets the time is cut into.
        factor: How many of the unit to be shown one SI unit is; degrees as a rule.
    """
    if quantity == "q" and plan is not None:  # As `check` does: a motion that starts outside may lead back.
        limits = range_from(limits, plan.values[0], RECOVERY_RANGE)
    low, high = bounds_of(limits, quantity)

    def shown(values: Array) -> Array:
        return factor * values[:, joint - 1 : joint] if joint else 100.0 * (2.0 * values - low - high) / (high - low)

    lower, upper = (factor * float(low[joint - 1]), factor * float(high[joint - 1])) if joint else (-100.0, 100.0)
    return _frame(plan, actual, shown, lower, upper, buckets)


def build_tool_frame(
    plan: Curves | None, actual: Curves | None, limit: float | None, factor: float, buckets: int = 240
) -> Frame:
    """Returns what a plot of a signal of the tool or the elbow shows.

    Args:
        plan: Planned, one column, or None.
        actual: Recorded, likewise.
        limit: Its largest value, in the unit of the curves; None where it has none.
        factor: How many of the unit to be shown one SI unit is.
        buckets: Number of buckets the time is cut into.
    """
    upper = np.nan if limit is None else factor * limit
    return _frame(plan, actual, lambda values: factor * values, np.nan, upper, buckets)


def _frame(
    plan: Curves | None,
    actual: Curves | None,
    shown: Callable[[Array], Array],
    lower: float,
    upper: float,
    buckets: int,
) -> Frame:
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
        return tuple(
            np.append(column, np.nan) for column in decimate(Curves(t=curves.t, values=shown(curves.values)), edges).T
        )

    planned, recorded = thin(plan), thin(actual)
    curves = np.nan_to_num(np.array((*planned, *recorded))) if planned or recorded else np.zeros((1, len(t)))
    outside = ((curves > upper) | (curves < lower)).any(axis=0)
    violated = np.convolve(outside, np.ones(2 * _WIDENED + 1), mode="same") > 0.5
    violated[-2:] = False  # The last two points span the empty rest of the axis.
    farthest = float(np.abs(curves).max())
    bounds = [abs(bound) for bound in (upper, lower) if np.isfinite(bound)]
    limit = max(bounds) if bounds else max(farthest, _LEAST_RANGE)
    return Frame(
        t=t,
        end=float(t[-1]),
        plan=planned,
        actual=recorded,
        upper=upper,
        lower=lower,
        violated=violated,
        bound=min(1.12 * max(limit, farthest), _FARTHEST * limit),
    )


def _round_end(last: float) -> float:
    return next((end for end in _ROUND_ENDS if end >= last - 1e-9), last)
