"""The conditions on what the moving arm does, cycle by cycle, in plain floats."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rcilab.conformance.bounds_table import BoundsTable
from rcilab.conformance.common_conditions import ACCELERATION_CUTOFF, MEASURED_CONDITIONS
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box

_SHARE = CYCLE_TIME / (CYCLE_TIME + 1.0 / (2.0 * math.pi * ACCELERATION_CUTOFF))
"""How much of a new difference the first-order low pass takes in one cycle."""


class MeasuredMonitor:
    """Checks what the sensors of a moving arm measure, once a cycle.

    Owned by the thread that runs the cycle. The bounds are the commanded ones with the allowances of
    `common_conditions`. Accelerations are low-passed differences of the measured velocities; the first step after a
    `reset` has none.

    Attributes:
        acceleration: Low-passed joint accelerations, n floats, [rad/s^2].
        tool_acceleration: Low-passed acceleration of the tool, linear first, 6 floats, [m/s^2, rad/s^2].

    Args:
        limits: Bounds of the arm.
        box: Where the tool shall stay; None, or one that is not active, bounds nothing; an `EntryBox` for a
            tool that starts outside.
        rows: The conditions, in the order of `MEASURED_CONDITIONS`; see `JointMonitor`.
    """

    def __init__(
        self,
        limits: Limits,
        box: SafetyBox | EntryBox | None = None,
        rows: Sequence[Condition] = MEASURED_CONDITIONS,
    ) -> None:
        self._n = len(limits.joint.velocity)
        self._box = box if isinstance(box, EntryBox) else active_box(box)
        self._rows = BoundsTable(rows, limits)
        self.reset([0.0] * self._n)

    @property
    def has_box(self) -> bool:
        """Whether there is a box at all: without one the tool's position is not needed."""
        return self._box is not None

    def reset(self, q: Sequence[float]) -> None:
        """Restarts the history: the arm is at `q`, and its motion shows in the next step.

        Args:
            q: Measured joint angles, n numbers, [rad].

        Raises:
            InvalidValueError: Not n numbers.
        """
        if len(q) != self._n:
            raise InvalidValueError("q", q, f"needs {self._n} numbers [rad]")
        self._dq: list[float] | None = None
        self._twist: list[float] | None = None
        self._psi: float | None = None
        self.acceleration = [0.0] * self._n
        self.tool_acceleration = [0.0] * 6
        self._values: list[float] = []

    def step(
        self,
        q: Sequence[float],
        dq: Sequence[float],
        position: Sequence[float],
        twist: Sequence[float] | None,
        psi: float | None,
    ) -> list[LimitViolation]:
        """Takes the measurements of this cycle and returns what they break, in the order of the rows.

        Args:
            q: Joint angles, n numbers, [rad].
            dq: Joint velocities, n numbers, [rad/s].
            position: The tool in the base, 3 numbers, [m].
            twist: Velocity of the tool in base axes, linear first, 6 numbers, [m/s, rad/s]; None in motions of the
                joints, which may move the tool as fast as they like (manual 4.1).
            psi: Arm angle, [rad]; None is not checked.
        """
        self.acceleration = _low_passed(self.acceleration, dq, self._dq)
        self.tool_acceleration = _low_passed(self.tool_acceleration, twist, self._twist)
        speed = 0.0
        if psi is not None and self._psi is not None:
            speed = math.remainder(psi - self._psi, 2.0 * math.pi) / CYCLE_TIME if math.isfinite(psi) else math.nan
        self._dq, self._psi = list(dq), psi
        self._twist = None if twist is None else list(twist)
        outside = -1.0 if self._box is None else self._box.excess(position)
        velocity = (0.0, 0.0) if twist is None else _norms(twist)
        acceleration = _norms(self.tool_acceleration)
        self._values = [*q, outside, speed, *dq, *velocity, *self.acceleration, *acceleration]
        return self._rows.evaluate(self._values)

    def broken(self) -> list[LimitViolation]:
        """Returns what the last step broke."""
        return self._rows.broken(self._values)


def _low_passed(state: list[float], new: Sequence[float] | None, old: Sequence[float] | None) -> list[float]:
    """Returns the filtered difference one cycle later; zero when there is nothing to take a difference of."""
    if new is None or old is None:
        return [0.0] * len(state)
    triples = zip(state, new, old)  # noqa: B905  # As in `BoundsTable`.
    return [x + _SHARE * ((a - b) / CYCLE_TIME - x) for x, a, b in triples]


def _norms(values: Sequence[float]) -> tuple[float, float]:
    a, b, c, d, e, f = values
    return math.sqrt(a * a + b * b + c * c), math.sqrt(d * d + e * e + f * f)
