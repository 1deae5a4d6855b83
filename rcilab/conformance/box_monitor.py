"""Check of the safety box, cycle by cycle, for modes without commanded tool poses."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.conformance.common_conditions import BOX_TOLERANCE, CARTESIAN_POSITION
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.condition import Condition
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box


class BoxMonitor:
    """Checks the tool position at commanded joint angles by the row "cartesian.position".

    Owned by the thread that runs the cycle.

    Attributes:
        excess: Distance of the tool outside the box in the last step, [m]; negative inside.

    Args:
        box: The safety box; None, or an inactive box, is no bound; an `EntryBox` for a tool that starts outside.
        row: The condition; see `JointMonitor`.
    """

    def __init__(self, box: SafetyBox | EntryBox | None, row: Condition = CARTESIAN_POSITION) -> None:
        self._row = row
        self._box = box if isinstance(box, EntryBox) else active_box(box)
        self.excess = -1.0

    @property
    def is_active(self) -> bool:
        """Whether there is a box; without one the tool's position is not needed."""
        return self._box is not None

    def step(self, position: Sequence[float]) -> list[LimitViolation]:
        """Checks the commanded tool position of this cycle and returns its violations.

        Args:
            position: Position of the tool in base, three numbers, [m].
        """
        if self._box is not None:
            self.excess = self._box.excess(position)
        return self.violations()

    def violations(self) -> list[LimitViolation]:
        """Returns the violations of the last step."""
        if self.excess < BOX_TOLERANCE:
            return []
        return [LimitViolation(self._row, 0, self.excess, BOX_TOLERANCE)]
