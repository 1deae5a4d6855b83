"""The safety box, cycle by cycle, for motions that command no tool pose."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.conformance.common_conditions import BOX_TOLERANCE, CARTESIAN_POSITION
from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.condition import Condition
from rcilab.core.safety_box import EntryBox, SafetyBox, active_box


class BoxMonitor:
    """Checks where commanded joint angles bring the tool: the row "cartesian.position" alone.

    Owned by the thread that runs the cycle.

    Attributes:
        excess: How far the tool was outside in the last step, [m]; below zero inside.

    Args:
        box: Where the tool shall stay; None, or one that is not active, bounds nothing; an `EntryBox` for a
            tool that starts outside.
        row: The condition; see `JointMonitor`.
    """

    def __init__(self, box: SafetyBox | EntryBox | None, row: Condition = CARTESIAN_POSITION) -> None:
        self._row = row
        self._box = box if isinstance(box, EntryBox) else active_box(box)
        self.excess = -1.0

    @property
    def is_active(self) -> bool:
        """Whether there is a box at all: without one the tool's position is not needed."""
        return self._box is not None

    def step(self, position: Sequence[float]) -> list[LimitViolation]:
        """Takes the commanded tool of this cycle and returns what it breaks.

        Args:
            position: Origin of the tool in the base, three numbers, [m].
        """
        if self._box is not None:
            self.excess = self._box.excess(position)
        return self.broken()

    def broken(self) -> list[LimitViolation]:
        """Returns what the last step broke."""
        if self.excess < BOX_TOLERANCE:
            return []
        return [LimitViolation(self._row, 0, self.excess, BOX_TOLERANCE)]
