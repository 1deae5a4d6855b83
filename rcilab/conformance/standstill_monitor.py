"""Check of standstill at both ends of a motion, cycle by cycle, by the recommended rows of `check`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.conformance.standstill import resolution
from rcilab.core.condition import Condition
from rcilab.core.limits import Limits


class StandstillMonitor:
    """Checks that a motion starts and ends at standstill, with the differences of other monitors.

    Owned by the thread that runs the cycle. A velocity needs two commands, an acceleration three, so at the start they
    are checked with the second and the third command, and at the end with the last one.

    Args:
        limits: Bounds of the arm.
        rows: The rows on velocity and acceleration at the start and the end.
    """

    def __init__(self, limits: Limits, rows: Sequence[Condition]) -> None:
        self._limits = limits
        self._rows = [(row, *row.bounds(limits)) for row in rows]
        self.reset(False)

    def reset(self, is_moving: bool) -> None:
        """Restarts the history.

        Args:
            is_moving: Whether the arm is moving and thus already has its first command.
        """
        self._passed = 0 if is_moving else -1

    def step(
        self, differences: Callable[[Condition], Sequence[float]], cycles: int, *, is_last: bool
    ) -> list[LimitViolation]:
        """Checks the differences of this cycle and returns their violations at an end of the motion.

        Args:
            differences: Returns the velocities or accelerations for a row, one per joint, or one norm of the tool.
            cycles: Cycles since the last command, 1 or more.
            is_last: Whether this command ends the motion.
        """
        before = self._passed
        self._passed = before + cycles if before >= 0 else 0
        found: list[LimitViolation] = []
        for row, lower, upper in self._rows:
            if not (is_last if row.stage == "end" else before < row.order <= self._passed):
                continue
            more = 0.0  # By which differences over several cycles are coarser.
            if cycles > 1:
                one, several = (resolution(row.signal, row.order, self._limits, count) for count in (1, cycles))
                more = several - one
            bounds = zip(differences(row), (lower - more).tolist(), (upper + more).tolist(), strict=True)
            for axis, (value, low, high) in enumerate(bounds, 1):
                if not low < value < high:
                    found.append(
                        LimitViolation(row, axis if row.is_per_joint else 0, value, low if value <= low else high)
                    )
        return found
