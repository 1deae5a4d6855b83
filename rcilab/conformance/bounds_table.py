"""Conditions as a table of bounds, which a monitor evaluates in every cycle."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.condition import AnyLimits, Condition


class BoundsTable:
    """Conditions with their bounds, one entry for each axis of each condition.

    Args:
        rows: The conditions, in the order of the values passed to `evaluate`.
        limits: Limits that define their bounds.
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

    def set_bounds(self, first: int, lower: Sequence[float], upper: Sequence[float]) -> None:
        """Changes the bounds of values from an index on of those passed to `evaluate`."""
        end = first + len(lower)
        self._lower[first:end], self._upper[first:end] = lower, upper

    def evaluate(self, values: Sequence[float]) -> list[LimitViolation]:
        """Returns the violations; every value must be strictly between its bounds, which NaN never is.

        Every cycle evaluates about ninety numbers: one loop with both bounds is faster than two maps, and the keyword
        argument of `zip` takes as long as five comparisons.
        """
        for lower, value, upper in zip(self._lower, values, self._upper):  # noqa: B905
            if not lower < value < upper:
                return self.violations(values)
        return []

    def violations(self, values: Sequence[float]) -> list[LimitViolation]:
        """Returns the violations of all values; missing values at the end are not checked."""
        bounds = zip(self._rows, values, self._lower, self._upper, strict=False)
        return [
            LimitViolation(row, axis, value, low if value <= low else high)
            for (row, axis), value, low, high in bounds
            if not low < value < high
        ]
