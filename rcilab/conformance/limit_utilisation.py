"""Utilisation of the limits by a motion, cycle by cycle: the colours of a drawn path."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.condition import Condition

UNUSED_PART = 0.8
"""Part of a joint's range, or of the distance to a face of the safety box, that counts as unused. Reason: most of a
path then has one colour."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Usage:
    """The worst necessary condition in every cycle."""

    ratio: Array
    """Used part of its bound, of a range only of its outer part, shape (N,); violated from 1 on."""
    row: NDArray[np.intp]
    """Index of the condition in `conditions`, shape (N,)."""
    conditions: tuple[Condition, ...]
    """The evaluated conditions."""

    def at_most(self, rows: Iterable[int]) -> Array:
        """Returns the largest ratio from each of these rows up to the next, to draw many rows as few points.

        Args:
            rows: Indices in ascending order; the last one includes the rest.
        """
        starts = np.asarray(list(rows), dtype=np.intp)
        return np.maximum.reduceat(self.ratio, starts)


def near_bound(ratio: Array) -> Array:
    """Returns the used part of a range: 0 up to `UNUSED_PART`, 1 at its ends, more beyond.

    A joint at three quarters of its range is no closer to a fault than one in the middle.
    """
    return np.maximum((ratio - UNUSED_PART) / (1.0 - UNUSED_PART), 0.0)


def worst_of(tables: Iterable[tuple[Condition, Array]]) -> Usage:
    """Returns the worst of several conditions in every cycle.

    Args:
        tables: Conditions, each with the used part of its bound, shape (N,) or longer.
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
