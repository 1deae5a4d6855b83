"""Check of commanded torques, cycle by cycle, in plain floats."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.conformance.bounds_table import BoundsTable
from rcilab.conformance.common_conditions import TORQUE_CONDITIONS
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import Condition
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import JointLimits


class TorqueMonitor:
    """Checks one commanded torque per cycle: its range, and its backward difference.

    Owned by the thread that runs the cycle. Commanded torques are added to gravity and friction, which the controller
    compensates.

    Attributes:
        tau: Last commanded torques, [N m].
        dtau: Their backward difference, [N m/s].

    Args:
        limits: Bounds of the joints. The monitor starts at zero torque.
        rows: The conditions, rate before range; see `JointMonitor`.
    """

    def __init__(self, limits: JointLimits, rows: Sequence[Condition] = TORQUE_CONDITIONS) -> None:
        self._n = len(limits.torque)
        self._rows = BoundsTable(rows, limits)
        self.reset([0.0] * self._n)

    def reset(self, tau: Sequence[float]) -> None:
        """Restarts the history at these commanded torques.

        Args:
            tau: Joint torques, n numbers, [N m].

        Raises:
            InvalidValueError: Not n numbers.
        """
        if len(tau) != self._n:
            raise InvalidValueError("tau", tau, f"must be {self._n} numbers [N m]")
        self.tau = [float(value) for value in tau]
        self.dtau = [0.0] * self._n

    def step(self, tau: Sequence[float], cycles: int = 1) -> list[LimitViolation]:
        """Checks the commanded torques of this cycle and returns their violations, in the order of the rows.

        NaN violates both conditions. The history advances in any case.

        Args:
            tau: Joint torques, at least n numbers, [N m]; a 6-axis arm ignores the protocol's seventh.
            cycles: Cycles since the last step, 1 or more; the rate is the mean over them.
        """
        h = cycles * CYCLE_TIME
        new = list(tau[: self._n])
        self.dtau = [(value - old) / h for value, old in zip(new, self.tau, strict=True)]
        self.tau = new
        return self._rows.evaluate([*self.dtau, *new])

    def violations(self) -> list[LimitViolation]:
        """Returns the violations of the last step."""
        return self._rows.violations((*self.dtau, *self.tau))
