"""The commanded motion of the arm: joint angles, their differences, and the single stop path."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import sub
from struct import Struct

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import JointLimits
from rcilab.motion.differences import derivatives_from_differences, differences_from_derivatives
from rcilab.motion.stop import plan_stop

STEADY = (
    0.01  # [rad/s^2] Below it a commanded velocity is constant: far above rounding, far below a motion's. Tuning value.
)
RESTING = 1e-5  # [rad/s] Of a compliant arm that settles after commands of single precision, about 1e-6.
JOIN_SHARE = 2.0  # Upper bound for the start of a stop, in units of the arm's limits; a tuning value.


class ReferenceTrajectory:
    """Commanded joint angles and their backward differences over one cycle. Owned by the virtual arm.

    Attributes:
        q: Commanded joint angles, n plain floats, [rad].
        dq: Their first backward difference, [rad/s].
        ddq: Their second, [rad/s^2].
        is_stationary: Whether nothing has moved for two cycles, so that both differences are exactly zero.
        version: Incremented with every change.

    Args:
        limits: Bounds of the joints, for stopping.
        q: Present joint angles, n numbers, [rad].
    """

    def __init__(self, limits: JointLimits, q: Sequence[float]) -> None:
        self._limits = limits
        self._max_velocity = JOIN_SHARE * limits.velocity
        self._max_acceleration = JOIN_SHARE * limits.acceleration
        self._acceleration: list[float] = limits.acceleration.tolist()
        self._jerk: list[float] = limits.jerk.tolist()
        self._pack = Struct(f"{3 * len(q)}d").pack
        self.version = 0
        self._arrays: tuple[JointVector, JointVector, JointVector] | None = None
        self._arrays_version = -1
        self.reset(q)

    @property
    def arrays(self) -> tuple[JointVector, JointVector, JointVector]:
        """q, dq and ddq as read-only arrays, created once per cycle and shared by all readers."""
        if self._arrays is None or self._arrays_version != self.version:
            n = len(self.q)
            rows = np.frombuffer(self._pack(*self.q, *self.dq, *self.ddq))  # Faster than np.array of a list.
            self._arrays, self._arrays_version = (rows[:n], rows[n : 2 * n], rows[2 * n :]), self.version
        return self._arrays

    @property
    def is_accelerating(self) -> bool:
        """Whether the commanded velocity of a joint changes by more than rounding."""
        return max(self.ddq) > STEADY or min(self.ddq) < -STEADY

    def reset(self, q: Sequence[float]) -> None:
        """Sets the commanded angles of a stationary arm."""
        self.q = list(q)
        self.dq = [0.0] * len(self.q)
        self.ddq = [0.0] * len(self.q)
        self.is_stationary = True
        self._stop: Iterator[list[float]] | None = None
        self.version += 1

    def move(self, q: list[float], differences: tuple[list[float], list[float]] | None = None) -> None:
        """Advances to the commanded angles of this cycle.

        Args:
            q: n plain floats, [rad].
            differences: Their first and second backward differences, [rad/s], [rad/s^2], if already known.
        """
        self._stop = None
        self._advance(q, differences)

    def stop(self) -> None:
        """Advances by one cycle of the fastest stop inside the limits, which the first call plans.

        If an immediate standstill is inside the limits, as at the end of a smooth motion, the arm stops at once.
        """
        if self._stop is None:
            self._stop = self._plan()
        self._advance(next(self._stop, self.q))

    def join(self, q: Sequence[float], dq: Sequence[float], ddq: Sequence[float]) -> None:
        """Sets the reference to the measured motion of a compliant arm, before a stop.

        Args:
            q: Measured joint angles, n plain floats, [rad].
            dq: Their velocities, [rad/s].
            ddq: Their accelerations, [rad/s^2]. Values above `JOIN_SHARE` times a limit are clipped. Below `RESTING`
                the arm is stationary.
        """
        if max(map(abs, dq)) < RESTING and max(map(abs, ddq)) * CYCLE_TIME < RESTING:
            self.reset(q)
            return
        velocity, acceleration = differences_from_derivatives(
            np.clip(dq, -self._max_velocity, self._max_velocity),
            np.clip(ddq, -self._max_acceleration, self._max_acceleration),
        )
        self.q, self.dq, self.ddq = list(q), velocity.tolist(), acceleration.tolist()
        self.is_stationary = not any(self.dq) and not any(self.ddq)
        self._stop = None
        self.version += 1

    def _advance(self, q: list[float], differences: tuple[list[float], list[float]] | None = None) -> None:
        dq, ddq = differences or self._differences(q)
        self.q, self.dq, self.ddq = q, dq, ddq
        self.is_stationary = not any(dq) and not any(ddq)
        self.version += 1

    def _differences(self, q: list[float]) -> tuple[list[float], list[float]]:
        h = CYCLE_TIME
        dq = [(new - old) / h for new, old in zip(q, self.q, strict=True)]
        return dq, [change / h for change in map(sub, dq, self.dq)]

    def _plan(self) -> Iterator[list[float]]:
        if self._can_stop_at_once():
            return iter(())
        dq, ddq = derivatives_from_differences(self.dq, self.ddq)
        # The response to a pause may accelerate far beyond the limits: within that of the jerk it would run away.
        dq = np.clip(dq, -self._max_velocity, self._max_velocity)
        ddq = np.clip(ddq, -self._max_acceleration, self._max_acceleration)
        return iter(plan_stop(self._limits, self.q, dq, ddq).q[1:].tolist())

    def _can_stop_at_once(self) -> bool:
        h = CYCLE_TIME
        bounds = zip(self.dq, self.ddq, self._acceleration, self._jerk, strict=True)
        return all(
            abs(dq / h) < acceleration and abs(dq / h + ddq) / h < jerk and abs(dq / h) / h < jerk
            for dq, ddq, acceleration, jerk in bounds
        )
