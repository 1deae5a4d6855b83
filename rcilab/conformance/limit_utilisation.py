"""How much of its limits a motion uses, cycle by cycle: the colours of a drawn path."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.condition import Condition

FREE = 0.8
"""Part of a joint's range, or of the distance to a face of the safety box, that counts as unused, so that
most of a path has one colour."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Usage:
    """The worst necessary condition of every cycle."""

    ratio: Array
    """How much of its bound is used, of a range only its outer part, shape (N,); from 1 on it is broken."""
    row: NDArray[np.intp]
    """Which condition, as a place in `conditions`, shape (N,)."""
    conditions: tuple[Condition, ...]
    """Those that hold throughout a motion and were evaluated."""

    def at_most(self, rows: Iterable[int]) -> Array:
        """Returns the largest ratio from each of these rows up to the next: what few points can show of many.

        Args:
            rows: Rows in rising order, each of them once or more; the last one stands for the rest.
        """
        starts = np.asarray(list(rows), dtype=np.intp)
        return np.maximum.reduceat(self.ratio, starts)


def near_bound(ratio: Array) -> Array:
    """Returns what a place in a range uses of it: nothing up to `FREE`, 1 at its ends, more beyond.

    A joint that stands at three quarters of its range is no nearer to a fault than one in the middle.
    """
    return np.maximum((ratio - FREE) / (1.0 - FREE), 0.0)


def worst_of(tables: Iterable[tuple[Condition, Array]]) -> Usage:
    """Returns the worst of several conditions in every cycle.

    Args:
        tables: Conditions, each with how much it uses of its bounds, shape (N,) or longer.
    """
    conditions: list[Condition] = []
    ratios: list[Array] = []
    for condition, ratio in tables:
        conditions.append(condition)
        ratios.append(ratio)
    count = min(len(ratio) for ratio in ratios)
    table = np.stack([ratio[:count] for ratio in ratios])
    row = table.argmax(axis=0)
    row.flags.writeable = False
    worst = np.take_along_axis(table, row[np.newaxis], axis=0)[0]
    return Usage(ratio=readonly_copy(worst), row=row, conditions=tuple(conditions))
