"""Curves for a display: few points without losing spikes, limits and violations as areas. Needs no plotting library."""

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
    from rcilab.conformance.start import StartState
    from rcilab.core.limits import JointLimits
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion import Motion

Quantity = Literal["q", "dq", "ddq", "jerk", "tau"]
QUANTITIES: tuple[Quantity, ...] = ("q", "dq", "ddq", "jerk")
ORDERS: dict[Quantity, int] = {quantity: order for order, quantity in enumerate(QUANTITIES)}
"""Order of the time derivative of the joint angles; a torque needs an arm and its load instead."""

_WIDENED = 3  # Points added on both sides of a marked violation, so that a single cycle is some pixels wide.
_FARTHEST = 3.0  # Largest range of a plot, in multiples of the limit; `rcilab.check` gives the values beyond.
_LEAST_RANGE = 0.02  # Of a plot without limits, in the unit shown, for readable ticks.
_ROUND_ENDS = (
    0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0,
    30.0, 40.0, 50.0, 60.0,
)  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class Curves:
    """Signals of the same kind over time."""

    t: Array
    """[s], increasing, shape (N,)."""
    values: Array
    """One column per signal, shape (N, k)."""
    q: Array | None = None
    """Of joint velocities: the angles one cycle before, on which their limits may depend, shape (N, n), [rad]."""
    rounding: float = 0.0
    """By which values may be beyond a limit because of the rounding of what they are computed from."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Frame:
    """Content of one plot, on one time axis; arrays of shape (M,)."""

    t: Array
    """Two instants per bucket, [s]."""
    plan: tuple[Array, ...]
    actual: tuple[Array, ...]
    """Empty without a recording."""
    upper: Array
    lower: Array
    """The limit, in the unit of the curves; NaN without one."""
    violated: NDArray[np.bool_]
    """Where a curve is outside its limits, widened to be visible, boolean."""
    bound: float
    """The axis reaches from -bound to bound; a curve far beyond its limit leaves the plot."""
    end: float
    """End of the time axis, [s]: a round number, so that the axis does not move while a plan is dragged."""


def peak_of(frame: Frame) -> tuple[int, float, float] | None:
    """Returns the curve with the largest value, from 0, this value, in the unit of the curves, and its time, [s].

    Measured curves come before planned ones. None without a curve.
    """
    curves = frame.actual or frame.plan
    if not curves:
        return None
    sizes = np.abs(np.stack(curves))
    if np.isnan(sizes).all():
        return None
    curve, row = (int(index) for index in np.unravel_index(np.nanargmax(sizes), sizes.shape))
    return curve, float(curves[curve][row]), float(frame.t[row])


def mark_moment(frame: Frame, moment: float) -> Frame:
    """Returns a frame with an instant marked like a violation.

    Args:
        frame: The frame.
        moment: The instant, [s].
    """
    here = int(np.abs(frame.t - moment).argmin())
    marked = frame.violated.copy()
    marked[max(here - _WIDENED, 0) : here + _WIDENED + 1] = True
    return replace(frame, violated=marked)


def decimate(curves: Curves, edges: Array) -> Array:
    """Returns the smallest and the largest value of every signal in every bucket, in the order of their occurrence.

    Extreme values are retained, so that every spike is visible.

    Args:
        curves: The curves.
        edges: Times between the buckets, increasing, shape (B + 1,), [s].

    Returns:
        Two rows per bucket, shape (2 B, k). A bucket without samples repeats the value before it. NaN before the first
        sample and from one bucket after the last sample on.
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
    offsets = starts - ends[0]
    smallest, largest = np.minimum.reduceat(values, offsets), np.maximum.reduceat(values, offsets)
    rising = _first(values, smallest, offsets, counts[full]) <= _first(values, largest, offsets, counts[full])
    thin[2 * full] = np.where(rising, smallest, largest)
    thin[2 * full + 1] = np.where(rising, largest, smallest)
    last = int(np.searchsorted(edges, curves.t[-1], side="right")) - 1
    empty = np.flatnonzero((counts == 0) & (ends[:-1] > 0) & (np.arange(buckets) <= last))
    thin[2 * empty] = thin[2 * empty + 1] = curves.values[ends[empty] - 1]
    return thin


def _first(values: Array, targets: Array, offsets: NDArray[np.intp], counts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Returns the row in which every bucket first has its target value."""
    rows = np.arange(len(values))[:, np.newaxis]
    is_target = values == np.repeat(targets, counts, axis=0)
    return np.minimum.reduceat(np.where(is_target, rows, len(values)), offsets)


def plan_curves(
    motion: Motion,
    quantity: Quantity,
    model: RobotModel | None = None,
    *,
    start: StartState | None = None,
    is_recorded: bool = False,
) -> Curves:
    """Returns a planned signal, one column per joint; for the torque, `model` with its load is needed.

    Velocity, acceleration and jerk are the backward differences that the controller computes and `check` compares,
    including those in the cycles after the end, which are drawn at the end.

    Args:
        motion: The motion.
        quantity: The signal.
        model: The arm with its load, for the torque.
        start: How the arm moves in the first row; None: it stands still.
        is_recorded: Whether it is what a client commanded: nothing is known of the cycles after the last row.
    """
    if quantity == "q":
        return Curves(t=motion.times, values=motion.q)
    hold = 0 if is_recorded else HOLD_SAMPLES
    t = np.append(motion.times, np.repeat(motion.times[-1:], hold))
    if quantity == "tau":
        assert model is not None
        rates = (planned_differences(motion.q, order, start, hold) for order in range(3))
        return Curves(t=t, values=model.torque(*rates).full)
    order = ORDERS[quantity]
    before = _extended(motion.q, 1, start, hold)[:-1] if quantity == "dq" else None
    return Curves(t=t, values=planned_differences(motion.q, order, start, hold), q=before)


def planned_differences(
    q: JointPath, order: int, start: StartState | None = None, hold: int = HOLD_SAMPLES
) -> JointPath:
    """Returns backward differences at 1 ms of commanded angles, with the cycles in which the controller holds the goal.

    Args:
        q: Joint angles, one row per cycle, shape (N, n), [rad].
        order: 0 returns the angles themselves, 1 velocity [rad/s], 2 acceleration, 3 jerk.
        start: How the arm moves in the first row; None: it stands still.
        hold: Number of cycles of the hold.

    Returns:
        Shape (N + hold, n).
    """
    return np.diff(_extended(q, order, start, hold), n=order, axis=0) / CYCLE_TIME**order


def _extended(q: JointPath, count: int, start: StartState | None, hold: int) -> JointPath:
    """Returns commanded angles with those of so many cycles before them, and of the hold after them."""
    before = np.repeat(q[:1], count, axis=0)
    if start is not None and start.moving:
        steps = start.dq - CYCLE_TIME * np.arange(count)[:, np.newaxis] * start.ddq
        before = q[0] - CYCLE_TIME * np.cumsum(steps, axis=0)[::-1]
    return np.concatenate((before, q, np.repeat(q[-1:], hold, axis=0)))


def streamed_curves(q: JointPath, quantity: Quantity, model: RobotModel | None = None) -> Curves:
    """Returns a signal of rows streamed one per cycle, as the controller computes it: by backward differences.

    A fitted curve would overshoot at a corner between two rows.

    Args:
        q: Commanded joint angles, shape (N, n), [rad].
        quantity: The signal.
        model: The arm with its load, for the torque.
    """
    t: Array = np.linspace(0.0, CYCLE_TIME * (len(q) - 1), len(q))
    if quantity == "q":
        return Curves(t=t, values=q)
    if quantity == "tau":
        assert model is not None
        rates = (backward_differences(t, q, order) for order in (1, 2))
        return Curves(t=t, values=model.torque(q, *rates).full)
    before = _shifted(q) if quantity == "dq" else None
    return Curves(t=t, values=backward_differences(t, q, ORDERS[quantity]), q=before)


def recorded_curves(t: Array, q: Array, q_c: Array, dq: Array, quantity: Quantity, *, rounding: float = 0.0) -> Curves:
    """Returns a recorded signal: measured q and dq, or ddq and jerk of the commands, as the controller computes them.

    Velocity limits that depend on the angles are those of commands, at commanded angles.

    Args:
        t: Time since the first command, [s], shape (N,).
        q: Measured joint angles, [rad], shape (N, n).
        q_c: Commanded joint angles, [rad], shape (N, n).
        dq: Measured joint velocities, [rad/s], shape (N, n).
        quantity: The signal.
        rounding: Largest rounding of the commanded angles, [rad].
    """
    if quantity == "q":
        return Curves(t=t, values=q)
    if quantity == "dq":
        return Curves(t=t, values=dq, q=_shifted(q_c))
    order = 2 if quantity == "ddq" else 3
    return Curves(t=t, values=backward_differences(t, q_c, order), rounding=rounding * (2.0 / CYCLE_TIME) ** order)


def _shifted(q: Array) -> Array:
    """Returns the row before each row; of the first one, itself."""
    return np.concatenate((q[:1], q[:-1]))


def backward_differences(t: Array, values: Array, order: int) -> Array:
    """Returns the derivative of a signal as the controller computes it; zero where an earlier cycle is missing."""
    found = np.zeros_like(values)
    if len(values) > order:
        # A difference across a lost cycle is not a derivative.
        steps = np.rint(np.diff(t) / CYCLE_TIME)
        every = max(steps.min(), 1.0)  # Cycles from one row to the next.
        whole = np.ones(len(t) - order, dtype=bool)
        for shift in range(order):
            whole &= steps[shift : len(steps) - order + 1 + shift] == every
        found[order:][whole] = np.diff(values, n=order, axis=0)[whole] / (every * CYCLE_TIME) ** order
    return found


def bounds_of(limits: JointLimits, quantity: Quantity) -> tuple[Array, Array]:
    """Returns lower and upper limit of a signal, each of shape (n,)."""
    if quantity == "q":
        return limits.lower, limits.upper
    upper = {"dq": limits.velocity, "ddq": limits.acceleration, "jerk": limits.jerk, "tau": limits.torque}[quantity]
    return -upper, upper


def build_error_frame(t: Array, errors: Array, last: float, least: float, buckets: int = 240) -> Frame:
    """Returns the content of a plot of errors, without limits and with an axis that reaches to the largest error.

    Args:
        t: Times of the errors, [s], shape (N,).
        errors: One column per curve, in the unit shown, shape (N, k).
        last: End of the other plots, [s], so that this plot fits below them.
        least: Smallest range of the axis to each side, in the unit shown; see `rcilab.i18n.plot_scale`.
        buckets: Number of time buckets.
    """
    edges, times = _time_axis(last, buckets)
    thin = decimate(Curves(t=t, values=errors), edges)
    largest = float(np.nanmax(np.abs(thin))) if np.isfinite(thin).any() else 0.0
    return Frame(
        t=times,
        plan=tuple(thin.T),
        actual=(),
        upper=np.full(len(times), np.nan),
        lower=np.full(len(times), np.nan),
        violated=np.zeros(len(times), dtype=bool),
        bound=max(1.12 * largest, least),
        end=float(times[-1]),
    )


def last_time(*curves: Curves | None) -> float:
    """Returns the end of the last of these curves, [s]; 1 without any."""
    return max([0.0] + [float(c.t[-1]) for c in curves if c is not None and len(c.t)]) or 1.0


def build_frame(
    plan: Curves | None,
    actual: Curves | None,
    limits: JointLimits,
    quantity: Quantity,
    joint: int,
    buckets: int = 240,
    factor: float = math.degrees(1.0),
    last: float | None = None,
) -> Frame:
    """Returns the content of a plot of one quantity of the joints.

    Args:
        plan: Planned curves of all joints, or None.
        actual: Recorded curves of all joints, or None.
        limits: The arm's limits; for the angles of a recovery from outside the range, the widened ones.
        quantity: The signal.
        joint: The joint to show in its own unit, from 1; 0 shows all, each in percent of its limit (of its range, with
            0 in the middle, for q).
        buckets: Number of time buckets.
        factor: Factor from the SI unit to the unit shown; to degrees by default.
        last: End of what the plots beside it show, [s]; None: that of these curves.
    """
    if quantity == "q" and plan is not None:  # As in `check`: a motion that starts outside may move back inside.
        limits = range_from(limits, plan.values[0], RECOVERY_RANGE)
    low, high = bounds_of(limits, quantity)
    is_curved = quantity == "dq" and limits.near_ends is not None

    def bounds(curves: Curves) -> tuple[Array, Array]:
        return limits.velocity_bounds(curves.q) if is_curved and curves.q is not None else (low, high)

    def usage(curves: Curves) -> Array:
        lower, upper = bounds(curves)
        if quantity == "q":
            return 100.0 * (2.0 * curves.values - lower - upper) / (upper - lower)
        return 100.0 * curves.values / np.where(curves.values > 0.0, upper, -lower)

    def shown(curves: Curves) -> Array:
        return factor * curves.values[:, joint - 1 : joint] if joint else usage(curves)

    def edges(curves: Curves) -> Array:
        return factor * np.stack([side[:, joint - 1] for side in bounds(curves)], axis=1)

    lower, upper = (factor * float(low[joint - 1]), factor * float(high[joint - 1])) if joint else (-100.0, 100.0)
    rounding = 0.0 if actual is None else actual.rounding * (factor if joint else 100.0 / float(high.min()))
    frame = _frame(plan, actual, shown, lower, upper, buckets, last, rounding)
    if not is_curved:
        return frame
    columns = slice(joint - 1, joint) if joint else slice(None)
    measured = None if actual is None else replace(actual, q=None)  # Their limits do not depend on the angles.
    used = _frame(plan, measured, lambda curves: usage(curves)[:, columns], -100.0, 100.0, buckets, last)
    frame = replace(frame, violated=used.violated)
    if not joint:
        return frame
    drawn = plan if plan is not None else actual
    return replace(frame, **_limit_curves(drawn, edges, frame))


def build_tool_frame(
    plan: Curves | None,
    actual: Curves | None,
    limit: float | None,
    factor: float,
    buckets: int = 240,
    last: float | None = None,
) -> Frame:
    """Returns the content of a plot of a signal of the tool or the elbow.

    Args:
        plan: Planned curve, one column, or None.
        actual: Recorded curve, one column, or None.
        limit: Limit, in the unit of the curves; None without one.
        factor: Factor from the SI unit to the unit shown.
        buckets: Number of time buckets.
        last: End of what the plots beside it show, [s]; None: that of these curves.
    """
    upper = np.nan if limit is None else factor * limit
    return _frame(plan, actual, lambda curves: factor * curves.values, np.nan, upper, buckets, last)


def _limit_curves(curves: Curves | None, edges: Callable[[Curves], Array], frame: Frame) -> dict[str, Array]:
    """Returns lower and upper limit of a frame along curves; before and after them those of their ends."""
    if curves is None or not len(curves.t):
        return {}
    at = np.clip(np.searchsorted(curves.t, frame.t, side="right") - 1, 0, len(curves.t) - 1)
    lower, upper = edges(curves)[at].T
    return {"lower": lower, "upper": upper}


def _frame(
    plan: Curves | None,
    actual: Curves | None,
    shown: Callable[[Curves], Array],
    lower: float,
    upper: float,
    buckets: int,
    last: float | None,
    rounding: float = 0.0,
) -> Frame:
    edges, t = _time_axis(last_time(plan, actual) if last is None else last, buckets)

    def thin(curves: Curves | None) -> tuple[Array, ...]:
        if curves is None or not len(curves.t):
            return ()
        return tuple(decimate(Curves(t=curves.t, values=shown(curves)), edges).T)

    planned, recorded = thin(plan), thin(actual)
    curves = np.array((*planned, *recorded)).reshape(-1, len(t))
    slack = np.repeat((0.0, rounding), (len(planned), len(recorded)))[:, None]
    outside = ((curves > upper + slack) | (curves < lower - slack)).any(axis=0)
    violated = np.convolve(outside, np.ones(2 * _WIDENED + 1), mode="same") > 0.5
    farthest = float(np.nanmax(np.abs(curves), initial=0.0))
    bounds = [abs(bound) for bound in (upper, lower) if np.isfinite(bound)]
    limit = max(bounds) if bounds else max(farthest, _LEAST_RANGE)
    return Frame(
        t=t,
        end=float(t[-1]),
        plan=planned,
        actual=recorded,
        upper=np.full(len(t), upper),
        lower=np.full(len(t), lower),
        violated=violated,
        bound=min(1.12 * max(limit, farthest), _FARTHEST * limit),
    )


def _time_axis(last: float, buckets: int) -> tuple[Array, Array]:
    """Returns the times between buckets that fill the time axis, empty end included, and two instants in each."""
    edges = np.linspace(0.0, _round_end(last), buckets + 1)
    t = np.repeat(edges[:-1], 2)
    t[1::2] = 0.5 * (edges[:-1] + edges[1:])
    t[-1] = edges[-1]
    return edges, t


def _round_end(last: float) -> float:
    return next((end for end in _ROUND_ENDS if end >= last - 1e-9), last)
