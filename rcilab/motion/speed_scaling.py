"""Another pace for a motion under way: the same way, run through slower, faster again, or held and gone on with.

The rows of a motion q(s) are played at s(t), where s' = rate is 1 as planned and 0 while the arm is held. Then

    dq = q_s rate,   ddq = q_ss rate^2 + q_s rate',   jerk = q_sss rate^3 + 3 q_ss rate rate' + q_s rate''

so a constant rate up to 1 keeps every limit that the motion keeps, and what costs is the change. Here the rate changes
along a quintic, from whatever rate, rate' and rate'' it has; how long that takes, and whether it has to wait until a
stretch is over where the plan uses all of a limit, is found by trying: the backward differences of the very rows that
will be commanded have to keep the joints' limits. The way itself, and with it every distance and the box, stays.
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

SLOWEST_PACE = 0.1
"""Tuning value: what is slower is better planned anew."""

_RAMPS = (0.08, 0.12, 0.18, 0.26, 0.38, 0.55, 0.8, 1.2, 1.8, 2.7, 4.0)  # [s]
_DELAYS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0, 1.5, 2.5, 4.0)  # [s]
_PAST = 3  # Rows before a change that the differences of the first new ones reach back to.
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SpeedScaledMotion:
    """A motion and how it is run through, row by row, one a controller cycle since its first command."""

    motion: Motion
    """As planned."""
    q: JointPath
    """What is commanded, shape (N, n), [rad]; the last row is the goal, or where the arm is held."""
    place: Array
    """When the plan is there, shape (N,), [s]."""
    rate: Array
    """s', shape (N,)."""
    drate: Array
    """[1/s], shape (N,)."""
    ddrate: Array
    """[1/s^2], shape (N,)."""
    pace: float = 1.0
    """The rate that it goes on with; 0: it is held."""
    changed: int = 0
    """First row of the last change."""

    @property
    def holds(self) -> bool:
        """Whether the last row is no goal but a place to wait at."""
        return self.pace == 0.0 and float(self.place[-1]) < self.motion.duration

    @property
    def duration(self) -> float:
        """Until the last row, [s]."""
        return (len(self.q) - 1) * CYCLE_TIME

    def place_at(self, cycle: int) -> float:
        """Returns where in the plan a cycle is, [s]."""
        return float(self.place[min(max(cycle, 0), len(self.place) - 1)])

    def time_at(self, place: float) -> float:
        """Returns when it is at a place in the plan for the first time, [s]; the last row's time where it never is."""
        return min(int(np.searchsorted(self.place, place - _ROUNDING)), len(self.place) - 1) * CYCLE_TIME

    def as_motion(self) -> Motion:
        """Returns what is commanded as a motion of its own; the one that was planned as long as nothing has changed.

        At its rows velocity and acceleration are those of the plan at this pace, to rounding; between them it runs as
        quintics.
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
    """Returns a motion at the pace it was planned with."""
    count = len(motion)
    still = make_readonly(np.zeros(count))
    place = make_readonly(np.minimum(motion.times, motion.duration))
    return SpeedScaledMotion(
        motion=motion, q=motion.q, place=place, rate=make_readonly(np.ones(count)), drate=still, ddrate=still
    )


def begun_at(motion: Motion, pace: float) -> SpeedScaledMotion:
    """Returns a motion that runs at a pace from its first row on; as planned at 1.

    Args:
        motion: The motion; it begins and ends at rest.
        pace: Above 0, to 1.
    """
    if pace == 1.0:
        return as_planned(motion)
    count = int(np.ceil(motion.duration / (pace * CYCLE_TIME) - _ROUNDING)) + 1
    place = np.minimum(pace * CYCLE_TIME * np.arange(count), motion.duration)
    place[-1] = motion.duration
    still = make_readonly(np.zeros(count))
    return SpeedScaledMotion(
        motion=motion,
        q=make_readonly(np.concatenate((motion.q[:1], _rows(motion, place[1:])))),
        place=make_readonly(place),
        rate=make_readonly(np.full(count, pace)),
        drate=still,
        ddrate=still,
        pace=pace,
        changed=1,
    )


def require_pace(pace: object) -> float:
    """Returns a pace if it is one.

    Raises:
        InvalidValueError: It is no number from `SLOWEST_PACE` to 1.
    """
    number = as_number(pace, "pace")
    if not SLOWEST_PACE <= number <= 1.0:
        raise InvalidValueError("pace", pace, f"must be from {SLOWEST_PACE:g} to 1: part of the planned speed").coded(
            "span", low=f"{SLOWEST_PACE:g}", high="1"
        )
    return number


def changed_pace(paced: SpeedScaledMotion, cycle: int, pace: float, limits: JointLimits) -> Iterator[SpeedScaledMotion]:
    """Yields motions that go on with another pace from a cycle on, those that have it soonest first.

    Each keeps the joints' limits; what else is to be checked is up to the caller, who takes the first that will do.

    Args:
        paced: How it is run through so far.
        cycle: The first row that may differ.
        pace: From 0, to be held, to 1.
        limits: Bounds of the joints.
    """
    paced = _continued(paced, cycle + round(max(_DELAYS) / CYCLE_TIME) + 1)
    ways = sorted((delay + ramp, delay, ramp) for delay in _DELAYS for ramp in _RAMPS)
    for _, delay, ramp in ways:
        first = cycle + round(delay / CYCLE_TIME)
        if first >= len(paced.q) - 1:
            continue  # It has arrived by then.
        law = _ramp(paced, first, pace, ramp)
        if law is not None and _keeps_limits(paced, first, law, limits):
            yield _joined(paced, first, law, pace)


def _continued(paced: SpeedScaledMotion, count: int) -> SpeedScaledMotion:
    """Returns a held motion with as many rows as that: it waits in its last row."""
    more = count - len(paced.q)
    if not paced.holds or more <= 0:
        return paced
    return SpeedScaledMotion(
        motion=paced.motion,
        q=np.concatenate((paced.q, np.repeat(paced.q[-1:], more, axis=0))),
        place=np.concatenate((paced.place, np.repeat(paced.place[-1:], more))),
        rate=np.concatenate((paced.rate, np.zeros(more))),
        drate=np.concatenate((paced.drate, np.zeros(more))),
        ddrate=np.concatenate((paced.ddrate, np.zeros(more))),
        pace=paced.pace,
        changed=paced.changed,
    )


def _ramp(paced: SpeedScaledMotion, first: int, pace: float, ramp: float) -> Array | None:
    """Returns place, rate, rate' and rate'' until the change is over, shape (4, K); None: there is no such ramp."""
    count = round(ramp / CYCLE_TIME)
    rate, drate, ddrate = float(paced.rate[first]), float(paced.drate[first]), float(paced.ddrate[first])
    T = count * CYCLE_TIME
    v, a, rise = drate * T, ddrate * T * T, pace - rate
    c = (rate, v, a / 2, 10 * rise - 6 * v - 1.5 * a, -15 * rise + 8 * v + 1.5 * a, 6 * rise - 3 * v - 0.5 * a)
    u = np.arange(1, count + 1) / count
    rates = np.polynomial.polynomial.Polynomial(c)
    law = np.stack(
        (paced.place[first] + T * rates.integ()(u), rates(u), rates.deriv()(u) / T, rates.deriv(2)(u) / T**2)
    )
    if law[1].min() < -_ROUNDING or law[1].max() > 1.0 + _ROUNDING:
        return None
    law[1:, -1] = pace, 0.0, 0.0  # But for rounding it is so already.
    return law


def _keeps_limits(paced: SpeedScaledMotion, first: int, law: Array, limits: JointLimits) -> bool:
    q = np.concatenate((paced.q[max(first + 1 - _PAST, 0) : first + 1], _rows(paced.motion, law[0])))
    if first + 1 < _PAST:  # The arm stood there before.
        q = np.concatenate((np.repeat(q[:1], _PAST, axis=0), q))
    if law[1, -1] == 0.0:
        q = np.concatenate((q, np.repeat(q[-1:], _PAST, axis=0)))
    for bound in (limits.velocity, limits.acceleration, limits.jerk):
        q = np.diff(q, axis=0) / CYCLE_TIME
        if not (np.abs(q).max(axis=0) < bound).all():
            return False
    return True


def _joined(paced: SpeedScaledMotion, first: int, law: Array, pace: float) -> SpeedScaledMotion:
    """Returns all rows: those so far, the change, and the rest of the way at the new pace."""
    end = paced.motion.duration
    if pace > 0.0 and law[0, -1] < end:
        rest = int(np.ceil((end - law[0, -1]) / (pace * CYCLE_TIME) - _ROUNDING))
        place = law[0, -1] + pace * CYCLE_TIME * np.arange(1, rest + 1)
        law = np.concatenate((law, np.stack((place, np.full(rest, pace), np.zeros(rest), np.zeros(rest)))), axis=1)
    arrived = np.flatnonzero(law[0] >= end - _ROUNDING * CYCLE_TIME)
    if arrived.size:
        law = law[:, : int(arrived[0]) + 1]
        law[0, -1] = end
    keep = first + 1
    place, rate, drate, ddrate = (
        make_readonly(np.concatenate((before[:keep], after)))
        for before, after in zip((paced.place, paced.rate, paced.drate, paced.ddrate), law, strict=True)
    )
    q = make_readonly(np.concatenate((paced.q[:keep], _rows(paced.motion, law[0]))))
    return SpeedScaledMotion(
        motion=paced.motion, q=q, place=place, rate=rate, drate=drate, ddrate=ddrate, pace=pace, changed=keep
    )


def _rows(motion: Motion, place: Array) -> JointPath:
    rows = motion.polynomial.sample(place)
    rows[place >= motion.duration] = motion.goal
    return rows
