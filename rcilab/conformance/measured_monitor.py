"""Check of measured values of the arm, cycle by cycle, in plain floats."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rcilab.conformance.bounds_table import BoundsTable
from rcilab.conformance.common_conditions import ACCELERATION_CUTOFF, MEASURED_CONDITIONS
from rcilab.conformance.divided_differences import tool_norms
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box

_FILTER_GAIN = CYCLE_TIME / (CYCLE_TIME + 1.0 / (2.0 * math.pi * ACCELERATION_CUTOFF))
"""Gain of the first-order low-pass filter for a new difference in one cycle."""
_SMALLEST_THRESHOLD = 1e-3  # [N m] Divisor for a collision threshold of zero.


class MeasuredMonitor:
    """Checks the measured values of a moving arm once per cycle.

    Owned by the thread that runs the cycle. The bounds are the commanded ones with the allowances of
    `common_conditions`. Accelerations are low-pass filtered differences of the measured velocities; they are zero in
    the first step after a `reset`, and always if none is bounded.

    Attributes:
        acceleration: Filtered joint accelerations, n floats, [rad/s^2].
        tool_acceleration: Filtered acceleration of the tool, linear first, 6 floats, [m/s^2, rad/s^2].

    Args:
        limits: Bounds of the arm.
        box: The safety box; None, or an inactive box, is no bound; an `EntryBox` for a tool that starts outside.
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
        self._has_accelerations = bool(
            math.isfinite(limits.cartesian.translation_acceleration) or np.isfinite(limits.joint.acceleration).any()
        )
        self.reset([0.0] * self._n)

    @property
    def has_box(self) -> bool:
        """Whether there is a box; without one the tool's position is not needed."""
        return self._box is not None

    def reset(self, q: Sequence[float]) -> None:
        """Restarts the history at `q`; velocities follow from the next step.

        Args:
            q: Measured joint angles, n numbers, [rad].

        Raises:
            InvalidValueError: Not n numbers.
        """
        if len(q) != self._n:
            raise InvalidValueError("q", q, f"must be {self._n} numbers [rad]")
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
        """Checks the measurements of this cycle and returns their violations, in the order of the rows.

        Args:
            q: Joint angles, n numbers, [rad].
            dq: Joint velocities, n numbers, [rad/s].
            position: Position of the tool in base, 3 numbers, [m].
            twist: Velocity of the tool in base axes, linear first, 6 numbers, [m/s, rad/s]; None in joint
                motions, which do not bound it (manual 4.1).
            psi: Arm angle, [rad]; None is not checked.
        """
        if self._has_accelerations:
            self.acceleration = _filter_difference(self.acceleration, dq, self._dq)
            self.tool_acceleration = _filter_difference(self.tool_acceleration, twist, self._twist)
        speed = 0.0
        if psi is not None and self._psi is not None:
            speed = math.remainder(psi - self._psi, 2.0 * math.pi) / CYCLE_TIME if math.isfinite(psi) else math.nan
        self._dq, self._psi = list(dq), psi
        self._twist = None if twist is None else list(twist)
        excess = -1.0 if self._box is None else self._box.excess(position)
        velocity = (0.0, 0.0) if twist is None else tool_norms(twist)
        self._values = [*q, excess, speed, *dq, *velocity]
        if self._has_accelerations:
            self._values += [*self.acceleration, *tool_norms(self.tool_acceleration)]
        return self._rows.evaluate(self._values)

    def violations(self) -> list[LimitViolation]:
        """Returns the violations of the last step."""
        return self._rows.violations(self._values)


def _filter_difference(state: list[float], new: Sequence[float] | None, old: Sequence[float] | None) -> list[float]:
    """Returns the filtered difference one cycle later; zero if there is no previous or no new value."""
    if new is None or old is None:
        return [0.0] * len(state)
    triples = zip(state, new, old)  # noqa: B905  # As in `BoundsTable`.
    return [x + _FILTER_GAIN * ((a - b) / CYCLE_TIME - x) for x, a, b in triples]


def find_collision_joint(torques: Sequence[float], thresholds: Sequence[float]) -> int:
    """Returns the index of the joint whose external torque is farthest above its collision threshold, as a ratio.

    If no torque is above its threshold, it is the joint nearest to its threshold.

    Args:
        torques: External joint torques, n numbers, [N m].
        thresholds: Collision thresholds, n numbers, [N m].
    """
    ratios = [
        (abs(torque) > threshold, abs(torque) / max(threshold, _SMALLEST_THRESHOLD))
        for torque, threshold in zip(torques, thresholds, strict=True)
    ]
    return max(range(len(ratios)), key=ratios.__getitem__)
