"""`auto_limit` of setJointLimit: commanded angles stop just inside the soft limits instead of raising a fault.

Each joint follows its command as long as a stop with limited jerk would end inside the soft limits. The first command
after which it would not is rejected: the joint stops just before the limit. From then on it approaches its command, as
far as that is inside, and follows it again after reaching it.

    following --stop would end outside--> stopping --standstill--> approaching --command reached--> following
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from math import copysign, sqrt
from typing import NamedTuple

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import JointLimits

MARGIN = 1e-3  # [rad] Distance from the soft limit at which a joint stops; a tuning value.
SHARE = 0.9  # Share of the velocity, acceleration and jerk limits in use: the rest is for rounding.
_GAIN = 8.0  # [1/s] Gain of the approach; critically damped with the one below.
_DAMPING = 4.0 * _GAIN  # [1/s]
_FAR = 100.0  # [rad] Largest command beyond a limit; keeps extreme numbers finite.
_REACHED = 1e-8  # [rad] Distance at which the command counts as reached: a jerk of 10 rad/s^3.


class _Mode(Enum):
    FOLLOWING = "following"
    STOPPING = "stopping"
    APPROACHING = "approaching"


class SoftLimitGovernor:
    """Stops commanded joint angles inside soft limits. Owned by a motion generator.

    Args:
        limits: Bounds of the joints, with the soft limits as position bounds.
        q: Joint angles of the stationary arm, n plain floats, [rad].
    """

    def __init__(self, limits: JointLimits, q: Sequence[float]) -> None:
        columns = zip(
            limits.lower.tolist(),
            limits.upper.tolist(),
            limits.velocity.tolist(),
            limits.acceleration.tolist(),
            limits.jerk.tolist(),
            q,
            strict=True,
        )
        self._joints = [_Joint(*column) for column in columns]

    @property
    def holds(self) -> tuple[int, ...]:
        """Numbers (from 1) of the joints that are not at their command."""
        return tuple(number for number, joint in enumerate(self._joints, 1) if not joint.is_following)

    def step(self, q: Sequence[float]) -> list[float]:
        """Returns the angles to follow for the commanded angles of this cycle, [rad]."""
        return [joint.step(angle) for joint, angle in zip(self._joints, q, strict=True)]


class StopProfile(NamedTuple):
    """The fastest stop from a velocity v >= 0: three phases of constant jerk, down to -peak and back to zero."""

    times: tuple[float, float, float]
    """Duration of each phase, [s]."""
    distance: float
    """Distance, [rad]."""


def plan_fastest_stop(v: float, a: float, acceleration: float, jerk: float) -> StopProfile:
    """Returns the fastest stop with limited jerk from a velocity upwards.

    A deceleration that is already too large for the velocity (v < a^2 / 2 jerk) is reduced at once; the joint then
    reverses slightly, which counts as zero distance.

    Args:
        v: Velocity, 0 or more, [rad/s].
        a: Acceleration, [rad/s^2].
        acceleration: Its bound, [rad/s^2].
        jerk: Its bound, [rad/s^3].
    """
    if a < 0.0 and v <= a * a / (2.0 * jerk):
        return StopProfile((0.0, 0.0, -a / jerk), 0.0)
    peak = sqrt(jerk * v + 0.5 * a * a)
    hold = 0.0
    if peak > acceleration:
        peak = max(acceleration, -a)
        hold = (v + (a * a - 2.0 * peak * peak) / (2.0 * jerk)) / peak
    first, last = max(0.0, (a + peak) / jerk), peak / jerk
    times = (first, max(0.0, hold), last)
    return StopProfile(times, _along(times, sum(times), v, a, jerk)[0])


def _along(times: tuple[float, float, float], t: float, v: float, a: float, jerk: float) -> tuple[float, float]:
    """Returns distance and velocity at time t of a stop that begins with velocity v and acceleration a."""
    x = 0.0
    for duration, rate in zip(times, (-jerk, 0.0, jerk), strict=True):
        dt = min(duration, t)
        x += dt * (v + dt * (a / 2.0 + dt * rate / 6.0))
        v += dt * (a + dt * rate / 2.0)
        a += dt * rate
        t -= dt
    return x, v


class _Joint:
    """The governor of one joint; x, v and a are its output and the backward differences."""

    def __init__(
        self, lower: float, upper: float, velocity: float, acceleration: float, jerk: float, start: float
    ) -> None:
        self._lower, self._upper = lower + MARGIN, upper - MARGIN
        self._velocity, self._acceleration, self._jerk = SHARE * velocity, SHARE * acceleration, SHARE * jerk
        self._mode = _Mode.FOLLOWING
        self._x, self._v, self._a = start, 0.0, 0.0
        self._u, self._du = start, 0.0
        self._plan: tuple[StopProfile, float, float, float, float] | None = None
        self._elapsed = 0.0

    @property
    def is_following(self) -> bool:
        return self._mode is _Mode.FOLLOWING

    def step(self, u: float) -> float:
        h = CYCLE_TIME
        u = min(max(u, self._lower - _FAR), self._upper + _FAR)
        du = (u - self._u) / h
        ddu = (du - self._du) / h
        self._u, self._du = u, du
        if self._mode is _Mode.STOPPING:
            return self._continue_stop()
        x = u if self._mode is _Mode.FOLLOWING else self._approach(u, du, ddu)
        if self._can_stop_from(x):
            self._advance(x)
            if abs(x - u) < _REACHED and abs(self._v - du) * h < _REACHED:
                self._mode = _Mode.FOLLOWING
            return x
        self._begin_stop()
        return self._continue_stop()

    def _advance(self, x: float) -> None:
        v = (x - self._x) / CYCLE_TIME
        self._a, self._x, self._v = (v - self._v) / CYCLE_TIME, x, v

    def _can_stop_from(self, x: float) -> bool:
        """Returns whether the joint could still stop inside the limits from x."""
        h = CYCLE_TIME
        v = (x - self._x) / h
        a = (v - self._v) / h
        up = v + a * h / 2.0  # The velocity at x; the difference over the last cycle lags behind it.
        room = self._upper - x if up > 0.0 else x - self._lower
        speed = abs(up)
        if room > speed * (0.5 * speed / self._acceleration + 2.0 * self._acceleration / self._jerk + 0.01):
            return True
        return plan_fastest_stop(speed, copysign(1.0, up) * a, self._acceleration, self._jerk).distance <= room

    def _begin_stop(self) -> None:
        h = CYCLE_TIME
        up = self._v + self._a * h / 2.0
        sign = copysign(1.0, up)
        speed, a = abs(up), sign * self._a
        stop = plan_fastest_stop(speed, a, self._acceleration, self._jerk)
        self._plan = (stop, self._x, sign, speed, a)
        self._elapsed = 0.0
        self._mode = _Mode.STOPPING

    def _continue_stop(self) -> float:
        assert self._plan is not None
        stop, start, sign, v, a = self._plan
        self._elapsed += CYCLE_TIME
        distance, _ = _along(stop.times, self._elapsed, v, a, self._jerk)
        self._advance(start + sign * distance)
        if self._elapsed > sum(stop.times) + 3.0 * CYCLE_TIME:
            self._mode = _Mode.APPROACHING
        return self._x

    def _approach(self, u: float, du: float, ddu: float) -> float:
        """Returns the next angle of the approach: velocity from the distance, acceleration from the velocity."""
        h = CYCLE_TIME
        goal = min(max(u, self._lower), self._upper)
        if goal != u:
            du = ddu = 0.0
        v_desired = _clip(du + _GAIN * (goal - self._x), self._velocity)
        a_desired = _clip(ddu + _DAMPING * (v_desired - self._v), self._acceleration)
        a = self._a + _clip(a_desired - self._a, self._jerk * h)
        return self._x + h * (self._v + h * a)


def _clip(value: float, bound: float) -> float:
    return min(max(value, -bound), bound)
