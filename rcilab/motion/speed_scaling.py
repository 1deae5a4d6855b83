"""Speed override of a running motion: the same path, slower, faster again, or held and resumed.

The rows of a motion q(s) are played at s(t), where s' = rate is 1 as planned and 0 while the arm is held. Then

    dq = q_s rate,   ddq = q_ss rate^2 + q_s rate',   jerk = q_sss rate^3 + 3 q_ss rate rate' + q_s rate''

so a constant rate up to 1 keeps every limit that the motion keeps; only a change of the rate can exceed one. The rate
changes along a quintic from its present value and derivatives. Duration and start of the change are found by trial: the
backward differences of the rows to be commanded must keep the joints' limits, so that a change may have to wait while
the plan uses a limit in full. The path, and with it every distance and the safety box, is unchanged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointPath, as_number, make_readonly
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits
from rcilab.motion.hermite import quintic
from rcilab.motion.motion import Motion, standing
from rcilab.motion.piecewise import PiecewisePolynomial

MIN_SPEED_OVERRIDE = 0.1
"""Smallest override: for a lower speed, plan the motion again."""

_RAMPS = (0.08, 0.12, 0.18, 0.26, 0.38, 0.55, 0.8, 1.2, 1.8, 2.7, 4.0)  # [s]
_DELAYS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0, 1.5, 2.5, 4.0)  # [s]
_PAST = 3  # Rows before a change that the differences of the first new rows use.
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SpeedScaledMotion:
    """A motion with a speed override, row by row, one per controller cycle since its first command."""

    motion: Motion
    """As planned."""
    q: JointPath
    """Commanded joint angles, shape (N, n), [rad]; the last row is the goal, or where the arm is held."""
    place: Array
    """Time in the plan of each row, shape (N,), [s]."""
    rate: Array
    """s', shape (N,)."""
    drate: Array
    """[1/s], shape (N,)."""
    ddrate: Array
    """[1/s^2], shape (N,)."""
    override: float = 1.0
    """The rate after the last change; 0: held."""
    changed: int = 0
    """First row of the last change."""

    @property
    def holds(self) -> bool:
        """Whether the arm is held in the last row, before the goal."""
        return self.override == 0.0 and float(self.place[-1]) < self.motion.duration

    @property
    def duration(self) -> float:
        """Time until the last row, [s]."""
        return (len(self.q) - 1) * CYCLE_TIME

    def place_at(self, cycle: int) -> float:
        """Returns the time in the plan of a cycle, [s]."""
        return float(self.place[min(max(cycle, 0), len(self.place) - 1)])

    def time_at(self, place: float) -> float:
        """Returns when it first reaches a time in the plan, [s]; the time of the last row if it never does."""
        return min(int(np.searchsorted(self.place, place - _ROUNDING)), len(self.place) - 1) * CYCLE_TIME

    def as_motion(self) -> Motion:
        """Returns the commanded rows as a motion; the planned motion if nothing has changed.

        At its rows velocity and acceleration are those of the plan with this override, within rounding; between them
        it is quintic.
        """
        if not self.changed:
            return self.motion
        if len(self.q) == 1:
            return standing(self.q[0], law="samples")
        rate, drate = self.rate[:, np.newaxis], self.drate[:, np.newaxis]
        slope, bend = (self.motion.polynomial.sample(self.place, order) for order in (1, 2))
        v, a = slope * rate, bend * rate**2 + slope * drate
        v[-1] = a[-1] = 0.0
        h = CYCLE_TIME
        parts = quintic((self.q[:-1], v[:-1], a[:-1]), (self.q[1:], v[1:], a[1:]), h)
        pieces = np.stack([part / h**power for power, part in enumerate(parts)], axis=2)
        breaks = h * np.arange(len(self.q), dtype=np.float64)
        return Motion(polynomial=PiecewisePolynomial(breaks, pieces), goal=self.q[-1], law="samples")


def as_planned(motion: Motion) -> SpeedScaledMotion:
    """Returns a motion without an override."""
    count = len(motion)
    still = make_readonly(np.zeros(count))
    place = make_readonly(np.minimum(motion.times, motion.duration))
    return SpeedScaledMotion(
        motion=motion, q=motion.q, place=place, rate=make_readonly(np.ones(count)), drate=still, ddrate=still
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
    place = np.minimum(override * CYCLE_TIME * np.arange(count), motion.duration)
    place[-1] = motion.duration
    still = make_readonly(np.zeros(count))
    return SpeedScaledMotion(
        motion=motion,
        q=make_readonly(np.concatenate((motion.q[:1], _rows(motion, place[1:])))),
        place=make_readonly(place),
        rate=make_readonly(np.full(count, override)),
        drate=still,
        ddrate=still,
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
    """Yields motions with another override from a cycle on, those that reach it soonest first.

    Each keeps the joints' limits; the caller checks everything else and takes the first valid one.

    Args:
        scaled: The motion so far.
        cycle: The first row that may differ.
        override: From 0 (held) to 1.
        limits: Bounds of the joints.
    """
    scaled = _continued(scaled, cycle + round(max(_DELAYS) / CYCLE_TIME) + 1)
    ways = sorted((delay + ramp, delay, ramp) for delay in _DELAYS for ramp in _RAMPS)
    for _, delay, ramp in ways:
        first = cycle + round(delay / CYCLE_TIME)
        if first >= len(scaled.q) - 1:
            continue  # It reaches the goal before.
        law = _ramp(scaled, first, override, ramp)
        if law is not None and _keeps_limits(scaled, first, law, limits):
            yield _joined(scaled, first, law, override)


def _continued(scaled: SpeedScaledMotion, count: int) -> SpeedScaledMotion:
    """Returns a held motion extended to `count` rows by repeating the last one."""
    more = count - len(scaled.q)
    if not scaled.holds or more <= 0:
        return scaled
    return SpeedScaledMotion(
        motion=scaled.motion,
        q=np.concatenate((scaled.q, np.repeat(scaled.q[-1:], more, axis=0))),
        place=np.concatenate((scaled.place, np.repeat(scaled.place[-1:], more))),
        rate=np.concatenate((scaled.rate, np.zeros(more))),
        drate=np.concatenate((scaled.drate, np.zeros(more))),
        ddrate=np.concatenate((scaled.ddrate, np.zeros(more))),
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
        (scaled.place[first] + T * rates.integ()(u), rates(u), rates.deriv()(u) / T, rates.deriv(2)(u) / T**2)
    )
    if law[1].min() < -_ROUNDING or law[1].max() > 1.0 + _ROUNDING:
        return None
    law[1:, -1] = override, 0.0, 0.0  # Removes rounding.
    return law


def _keeps_limits(scaled: SpeedScaledMotion, first: int, law: Array, limits: JointLimits) -> bool:
    q = np.concatenate((scaled.q[max(first + 1 - _PAST, 0) : first + 1], _rows(scaled.motion, law[0])))
    if first + 1 < _PAST:  # The arm was at standstill before.
        q = np.concatenate((np.repeat(q[:1], _PAST, axis=0), q))
    if law[1, -1] == 0.0:
        q = np.concatenate((q, np.repeat(q[-1:], _PAST, axis=0)))
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
        place = law[0, -1] + override * CYCLE_TIME * np.arange(1, rest + 1)
        law = np.concatenate((law, np.stack((place, np.full(rest, override), np.zeros(rest), np.zeros(rest)))), axis=1)
    arrived = np.flatnonzero(law[0] >= end - _ROUNDING * CYCLE_TIME)
    if arrived.size:
        law = law[:, : int(arrived[0]) + 1]
        law[0, -1] = end
    keep = first + 1
    place, rate, drate, ddrate = (
        make_readonly(np.concatenate((before[:keep], after)))
        for before, after in zip((scaled.place, scaled.rate, scaled.drate, scaled.ddrate), law, strict=True)
    )
    q = make_readonly(np.concatenate((scaled.q[:keep], _rows(scaled.motion, law[0]))))
    return SpeedScaledMotion(
        motion=scaled.motion, q=q, place=place, rate=rate, drate=drate, ddrate=ddrate, override=override, changed=keep
    )


def _rows(motion: Motion, place: Array) -> JointPath:
    rows = motion.polynomial.sample(place)
    rows[place >= motion.duration] = motion.goal
    return rows
