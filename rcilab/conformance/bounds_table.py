"""Conditions as a monitor asks them in every cycle: one value and two bounds for each axis, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rcilab.conformance.condition import AnyLimits, Condition
from rcilab.conformance.limit_violation import LimitViolation, faults_of
from rcilab.core.faults import Fault


class BoundsTable:
    """Conditions with their bounds, spread over the axes that each of them judges.

    Args:
        rows: The conditions, in the order of the values that `judge` is given.
        limits: Where their bounds come from.
    """

    def __init__(self, rows: Iterable[Condition], limits: AnyLimits) -> None:
        self._rows: list[tuple[Condition, int]] = []
        self._lower: list[float] = []
        self._upper: list[float] = []
        for row in rows:
            lower, upper = row.bounds(limits)
            self._rows += [(row, axis if row.is_per_joint else 0) for axis in range(1, len(lower) + 1)]
            self._lower += lower.tolist()
            self._upper += upper.tolist()

    def judge(self, values: Sequence[float]) -> tuple[Fault, ...]:
        """Returns the faults that values raise, in wire order; every value has to be strictly between its bounds.

        No NaN is. Every cycle asks this of some ninety numbers: one loop with both bounds is faster than two maps, and
        a keyword of `zip` takes as long as five comparisons.
        """
        for lower, value, upper in zip(self._lower, values, self._upper):  # noqa: B905
            if not lower < value < upper:
                return faults_of(self.broken(values))
        return ()

    def broken(self, values: Sequence[float]) -> list[LimitViolation]:
        """Returns what values break; no values break nothing."""
        bounds = zip(self._rows, values, self._lower, self._upper, strict=False)
        return [
            LimitViolation(row, axis, value, low if value <= low else high)
            for (row, axis), value, low, high in bounds
            if not low < value < high
        ]
