"""The commanded motion of the arm: where it is told to be, how that changes, and the one way to bring it to rest."""

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

JOIN_SHARE = 2.0  # Of the arm's limits: what a stop starts from at most, however hard the arm was thrown; a choice.


class ReferenceTrajectory:
    """Commanded joint angles and their backward differences over one cycle. Owned by the controller's cycle.

    Attributes:
        q: Commanded joint angles, n plain floats, [rad].
        dq: Their first backward difference, [rad/s].
        ddq: Their second, [rad/s^2].
        is_at_rest: Whether nothing has moved for two cycles, so that both differences are exactly zero.
        version: Rises with every change.

    Args:
        limits: Bounds of the joints, for coming to rest.
        q: Where the arm stands, n numbers, [rad].
    """

    def __init__(self, limits: JointLimits, q: Sequence[float]) -> None:
        self._limits = limits
        self._fastest = JOIN_SHARE * limits.velocity
        self._hardest = JOIN_SHARE * limits.acceleration
        self._acceleration: list[float] = limits.acceleration.tolist()
        self._jerk: list[float] = limits.jerk.tolist()
        self._pack = Struct(f"{3 * len(q)}d").pack
        self.version = 0
        self._arrays: tuple[JointVector, JointVector, JointVector] | None = None
        self._arrays_version = -1
        self.place(q)

    @property
    def arrays(self) -> tuple[JointVector, JointVector, JointVector]:
        """q, dq and ddq as read-only arrays, made once a cycle for all who compute with them."""
        if self._arrays is None or self._arrays_version != self.version:
            n = len(self.q)
            rows = np.frombuffer(self._pack(*self.q, *self.dq, *self.ddq))  # numpy looks at each float of a list twice.
            self._arrays, self._arrays_version = (rows[:n], rows[n : 2 * n], rows[2 * n :]), self.version
        return self._arrays

    def place(self, q: Sequence[float]) -> None:
        """Puts the commanded angles somewhere, at rest: while the brakes or a person's hand decide where the arm is."""
        self.q = list(q)
        self.dq = [0.0] * len(self.q)
        self.ddq = [0.0] * len(self.q)
        self.is_at_rest = True
        self._stop: Iterator[list[float]] | None = None
        self.version += 1

    def move(self, q: list[float], differences: tuple[list[float], list[float]] | None = None) -> None:
        """Takes the commanded angles of this cycle.

        Args:
            q: n plain floats, [rad].
            differences: Their first and second backward difference, [rad/s], [rad/s^2], from whoever took them already.
        """
        self._stop = None
        self._advance(q, differences)

    def come_to_rest(self) -> None:
        """Takes one cycle of the fastest stop inside the limits; planned at the first call, repeated calls play it.

        When standing still at once is itself inside the limits, as at the end of any decent motion, it stands still.
        """
        if self._stop is None:
            self._stop = self._plan()
        self._advance(next(self._stop, self.q))

    def join(self, q: Sequence[float], dq: Sequence[float], ddq: Sequence[float]) -> None:
        """Puts the commanded angles on an arm that moves by itself, and along with it: before it is brought to rest.

        Args:
            q: Measured joint angles, n plain floats, [rad].
            dq: Their velocities, [rad/s].
            ddq: Their accelerations, [rad/s^2]; beyond the largest ones that a stop starts from, those are taken.
        """
        velocity, acceleration = differences_from_derivatives(
            np.clip(dq, -self._fastest, self._fastest), np.clip(ddq, -self._hardest, self._hardest)
        )
        self.q, self.dq, self.ddq = list(q), velocity.tolist(), acceleration.tolist()
        self.is_at_rest = not any(self.dq) and not any(self.ddq)
        self._stop = None
        self.version += 1

    def _advance(self, q: list[float], differences: tuple[list[float], list[float]] | None = None) -> None:
        dq, ddq = differences or self._differences(q)
        self.q, self.dq, self.ddq = q, dq, ddq
        self.is_at_rest = not any(dq) and not any(ddq)
        self.version += 1

    def _differences(self, q: list[float]) -> tuple[list[float], list[float]]:
        h = CYCLE_TIME
        dq = [(new - old) / h for new, old in zip(q, self.q, strict=True)]
        return dq, [change / h for change in map(sub, dq, self.dq)]

    def _plan(self) -> Iterator[list[float]]:
        if self._may_stand_still():
            return iter(())
        dq, ddq = derivatives_from_differences(self.dq, self.ddq)
        return iter(plan_stop(self._limits, self.q, dq, ddq).q[1:].tolist())

    def _may_stand_still(self) -> bool:
        h = CYCLE_TIME
        bounds = zip(self.dq, self.ddq, self._acceleration, self._jerk, strict=True)
        return all(
            abs(dq / h) < acceleration and abs(dq / h + ddq) / h < jerk and abs(dq / h) / h < jerk
            for dq, ddq, acceleration, jerk in bounds
        )
