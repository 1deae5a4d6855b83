"""Speed override of a running motion: the same path at another speed, or held and resumed.

The motion q(s) is sampled at s(t), where the rate s' is 1 as planned and 0 while the arm is held. Then

    dq = q_s rate,   ddq = q_ss rate^2 + q_s rate',   jerk = q_sss rate^3 + 3 q_ss rate rate' + q_s rate''

so at a constant rate up to 1 the motion is inside every limit that holds for the plan; only a change of the rate can
exceed one. The rate changes along a quintic from its current value and derivatives. Duration and start of the change
are found by trial: the backward differences of the commanded rows must be inside the joints' limits, so that a change
may be delayed while the plan uses a limit in full. The path does not change, nor do clearances and the safety box.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rcilab.core.arrays import Array, JointPath, as_number, make_readonly
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits
from rcilab.motion.hermite import quintic
from rcilab.motion.motion import Motion, stationary_motion
from rcilab.motion.piecewise import PiecewisePolynomial

MIN_SPEED_OVERRIDE = 0.1
"""Smallest override; for a lower speed, plan the motion again."""
PREVIOUS_ROWS = 3
"""Rows before a change that enter the differences of the first new rows."""

_RAMPS = (0.08, 0.12, 0.18, 0.26, 0.38, 0.55, 0.8, 1.2, 1.8, 2.7, 4.0)  # [s]
_DELAYS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0, 1.5, 2.5, 4.0)  # [s]
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Shift:
    """From a controller cycle on, a motion waits, or continues from another cycle."""

    now: int
    """Cycle of the controller since the first command."""
    cycle: int
    """Cycle of the motion."""
    is_waiting: bool
    """Whether the arm stands there until the next shift."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SpeedScaledMotion:
    """A motion with a speed override, row by row, one per controller cycle since its first command."""

    motion: Motion
    """The planned motion."""
    q: JointPath
    """Commanded joint angles, shape (N, n), [rad]; the last row is the goal, or the held position."""
    plan_time: Array
    """Time of each row in the plan, shape (N,), [s]."""
    rate: Array
    """Rate s', shape (N,)."""
    drate: Array
    """First derivative of the rate, shape (N,), [1/s]."""
    ddrate: Array
    """Second derivative of the rate, shape (N,), [1/s^2]."""
    override: float = 1.0
    """Rate after the last change; 0 is held."""
    changed: int = 0
    """Index of the first row of the last change."""

    @property
    def is_held(self) -> bool:
        """Whether the arm is held in the last row, short of the goal."""
        return self.override == 0.0 and float(self.plan_time[-1]) < self.motion.duration

    @property
    def duration(self) -> float:
        """Time until the last row, [s]."""
        return (len(self.q) - 1) * CYCLE_TIME

    def plan_time_at(self, cycle: int) -> float:
        """Returns the time in the plan at a cycle, [s]."""
        return float(self.plan_time[min(max(cycle, 0), len(self.plan_time) - 1)])

    def time_at(self, plan_time: float) -> float:
        """Returns the time at which a time in the plan is first reached, [s]; that of the last row if it never is."""
        return min(int(np.searchsorted(self.plan_time, plan_time - _ROUNDING)), len(self.plan_time) - 1) * CYCLE_TIME

    def shifted(self, shifts: Sequence[Shift]) -> SpeedScaledMotion:
        """Returns the motion as it was commanded, with its waits for inputs, and without what was left out.

        Args:
            shifts: In the order of their cycles.
        """
        if not shifts:
            return self
        taken = [np.arange(shifts[0].now)]
        for shift, following in zip(shifts, (*shifts[1:], None), strict=True):
            count = len(self.q) - shift.cycle if following is None else following.now - shift.now
            steps = np.zeros(count, dtype=np.intp) if shift.is_waiting and following is not None else np.arange(count)
            taken.append(shift.cycle + steps)
        rows = np.minimum(np.concatenate(taken), len(self.q) - 1)
        is_still = np.diff(rows, append=rows[-1]) == 0
        moving = np.where(is_still, 0.0, 1.0)
        return replace(
            self,
            q=make_readonly(self.q[rows]),
            plan_time=make_readonly(self.plan_time[rows]),
            rate=make_readonly(self.rate[rows] * moving),
            drate=make_readonly(self.drate[rows] * moving),
            ddrate=make_readonly(self.ddrate[rows] * moving),
            changed=max(self.changed, 1),
        )

    def as_motion(self) -> Motion:
        """Returns the commanded rows as a motion; the planned motion if nothing has changed.

        At the rows velocity and acceleration are those of the plan with this override, within rounding; between the
        rows it is quintic.
        """
        if not self.changed:
            return self.motion
        if len(self.q) == 1:
            return stationary_motion(self.q[0], law="samples", speed=self.motion.speed)
        rate, drate = self.rate[:, np.newaxis], self.drate[:, np.newaxis]
        slope, bend = (self.motion.polynomial.sample(self.plan_time, order) for order in (1, 2))
        v, a = slope * rate, bend * rate**2 + slope * drate
        v[-1] = a[-1] = 0.0
        h = CYCLE_TIME
        parts = quintic((self.q[:-1], v[:-1], a[:-1]), (self.q[1:], v[1:], a[1:]), h)
        pieces = np.stack([part / h**power for power, part in enumerate(parts)], axis=2)
        breaks = h * np.arange(len(self.q), dtype=np.float64)
        curve = PiecewisePolynomial(breaks, pieces)
        return Motion(polynomial=curve, goal=self.q[-1], law="samples", speed=self.motion.speed)


def as_planned(motion: Motion) -> SpeedScaledMotion:
    """Returns a motion without an override."""
    count = len(motion)
    zeros = make_readonly(np.zeros(count))
    plan_time = make_readonly(np.minimum(motion.times, motion.duration))
    return SpeedScaledMotion(
        motion=motion, q=motion.q, plan_time=plan_time, rate=make_readonly(np.ones(count)), drate=zeros, ddrate=zeros
    )


def start_with_override(motion: Motion, override: float) -> SpeedScaledMotion:
    """Returns a motion with an override from its first row on.

    Args:
        motion: The motion; it begins and ends at standstill.
        override: Above 0, to 1.
    """
    if override == 1.0:
        return as_planned(motion)
    count = int(np.ceil(motion.duration / (override * CYCLE_TIME) - _ROUNDING)) + 1
    plan_time = np.minimum(override * CYCLE_TIME * np.arange(count), motion.duration)
    plan_time[-1] = motion.duration
    zeros = make_readonly(np.zeros(count))
    return SpeedScaledMotion(
        motion=motion,
        q=make_readonly(np.concatenate((motion.q[:1], _rows(motion, plan_time[1:])))),
        plan_time=make_readonly(plan_time),
        rate=make_readonly(np.full(count, override)),
        drate=zeros,
        ddrate=zeros,
        override=override,
        changed=1,
    )


def require_speed_override(override: object) -> float:
    """Returns a valid speed override.

    Raises:
        InvalidValueError: It is not a number from `MIN_SPEED_OVERRIDE` to 1.
    """
    number = as_number(override, "speed_override")
    if not MIN_SPEED_OVERRIDE <= number <= 1.0:
        raise InvalidValueError(
            "speed_override", override, f"must be from {MIN_SPEED_OVERRIDE:g} to 1: part of the planned speed"
        ).coded("span", low=f"{MIN_SPEED_OVERRIDE:g}", high="1")
    return number


def change_speed_override(
    scaled: SpeedScaledMotion, cycle: int, override: float, limits: JointLimits
) -> Iterator[SpeedScaledMotion]:
    """Yields motions with another override from a cycle on, in the order in which they reach it.

    Each is inside the joints' limits; the caller checks everything else and uses the first valid one.

    Args:
        scaled: The current motion.
        cycle: Index of the first row that may change.
        override: From 0 (held) to 1.
        limits: Bounds of the joints.
    """
    scaled = _continued(scaled, cycle + round(max(_DELAYS) / CYCLE_TIME) + 1)
    candidates = sorted((delay + ramp, delay, ramp) for delay in _DELAYS for ramp in _RAMPS)
    for _, delay, ramp in candidates:
        first = cycle + round(delay / CYCLE_TIME)
        if first >= len(scaled.q) - 1:
            continue  # The goal is reached before the change.
        law = _ramp(scaled, first, override, ramp)
        if law is not None and _keeps_limits(scaled, first, law, limits):
            yield _joined(scaled, first, law, override)


def _continued(scaled: SpeedScaledMotion, count: int) -> SpeedScaledMotion:
    """Returns a held motion extended to `count` rows by repeating the last one."""
    added = count - len(scaled.q)
    if not scaled.is_held or added <= 0:
        return scaled
    return SpeedScaledMotion(
        motion=scaled.motion,
        q=np.concatenate((scaled.q, np.repeat(scaled.q[-1:], added, axis=0))),
        plan_time=np.concatenate((scaled.plan_time, np.repeat(scaled.plan_time[-1:], added))),
        rate=np.concatenate((scaled.rate, np.zeros(added))),
        drate=np.concatenate((scaled.drate, np.zeros(added))),
        ddrate=np.concatenate((scaled.ddrate, np.zeros(added))),
        override=scaled.override,
        changed=scaled.changed,
    )


def _ramp(scaled: SpeedScaledMotion, first: int, override: float, ramp: float) -> Array | None:
    """Returns plan time, rate, rate' and rate'' until the change is complete, shape (4, K), or None if impossible."""
    count = round(ramp / CYCLE_TIME)
    rate, drate, ddrate = float(scaled.rate[first]), float(scaled.drate[first]), float(scaled.ddrate[first])
    T = count * CYCLE_TIME
    v, a, rise = drate * T, ddrate * T * T, override - rate
    c = (rate, v, a / 2, 10 * rise - 6 * v - 1.5 * a, -15 * rise + 8 * v + 1.5 * a, 6 * rise - 3 * v - 0.5 * a)
    u = np.arange(1, count + 1) / count
    rates = np.polynomial.polynomial.Polynomial(c)
    law = np.stack(
        (scaled.plan_time[first] + T * rates.integ()(u), rates(u), rates.deriv()(u) / T, rates.deriv(2)(u) / T**2)
    )
    if law[1].min() < -_ROUNDING or law[1].max() > 1.0 + _ROUNDING:
        return None
    law[1:, -1] = override, 0.0, 0.0  # Removes rounding.
    return law


def _keeps_limits(scaled: SpeedScaledMotion, first: int, law: Array, limits: JointLimits) -> bool:
    q = np.concatenate((scaled.q[max(first + 1 - PREVIOUS_ROWS, 0) : first + 1], _rows(scaled.motion, law[0])))
    if first + 1 < PREVIOUS_ROWS:  # The arm was at standstill before.
        q = np.concatenate((np.repeat(q[:1], PREVIOUS_ROWS, axis=0), q))
    if law[1, -1] == 0.0:
        q = np.concatenate((q, np.repeat(q[-1:], PREVIOUS_ROWS, axis=0)))
    for bound in (limits.velocity, limits.acceleration, limits.jerk):
        q = np.diff(q, axis=0) / CYCLE_TIME
        if not (np.abs(q).max(axis=0) < bound).all():
            return False
    return True


def _joined(scaled: SpeedScaledMotion, first: int, law: Array, override: float) -> SpeedScaledMotion:
    """Returns all rows: those so far, the change, and the rest of the path with the new override."""
    end = scaled.motion.duration
    if override > 0.0 and law[0, -1] < end:
        rest = int(np.ceil((end - law[0, -1]) / (override * CYCLE_TIME) - _ROUNDING))
        plan_time = law[0, -1] + override * CYCLE_TIME * np.arange(1, rest + 1)
        law = np.concatenate(
            (law, np.stack((plan_time, np.full(rest, override), np.zeros(rest), np.zeros(rest)))), axis=1
        )
    arrived = np.flatnonzero(law[0] >= end - _ROUNDING * CYCLE_TIME)
    if arrived.size:
        law = law[:, : int(arrived[0]) + 1]
        law[0, -1] = end
    kept_count = first + 1
    plan_time, rate, drate, ddrate = (
        make_readonly(np.concatenate((before[:kept_count], after)))
        for before, after in zip((scaled.plan_time, scaled.rate, scaled.drate, scaled.ddrate), law, strict=True)
    )
    q = make_readonly(np.concatenate((scaled.q[:kept_count], _rows(scaled.motion, law[0]))))
    return SpeedScaledMotion(
        motion=scaled.motion,
        q=q,
        plan_time=plan_time,
        rate=rate,
        drate=drate,
        ddrate=ddrate,
        override=override,
        changed=kept_count,
    )


def _rows(motion: Motion, plan_time: Array) -> JointPath:
    rows = motion.polynomial.sample(plan_time)
    rows[plan_time >= motion.duration] = motion.goal
    return rows
