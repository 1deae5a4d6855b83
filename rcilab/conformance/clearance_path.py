"""Distances along a whole motion: computed every 5 mm of travel, less often far from everything, more often near it.

No point of the arm moves farther than the joints turn times their levers, so a distance changes by no more than that
from one row to the next (conservative advancement, Mirtich 1996). After a query nothing can collide until the arm has
travelled the rest of the distance to the bound; 5 mm are allowed in any case. A row between two queries is then known
within bounds; where these leave it open whether a condition holds, or whether the smallest distance is there, it is
computed too. The verdict on every cycle is that of its own distance.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.clearance import LinkPair

MOST_TRAVEL = 5e-3  # [m]
"""How far any point of a link may move between two queries, unless the distance found leaves room for more."""
LONGEST_STEP = 2e-2  # [m]
"""Travel in one cycle, 20 m/s, beyond which only its end is computed: no arm can, and other rows refuse it."""

_ROUNDING = 1e-9  # [m] More than sums of travel are rounded by.


@dataclass(frozen=True, slots=True, eq=False)
class ClearancePath:
    """One distance in every cycle of a motion."""

    distance: Array
    """Shape (N,), [m]. Exact where it was computed; else between two queries, and on the right side of every bound.
    The smallest one is exact, and no other can be smaller by more than half of `MOST_TRAVEL`."""
    links: NDArray[np.intp]
    """The two links of the last query up to each cycle, shape (N, 2)."""
    queries: int
    """How many distances were computed."""


def clearance_path(
    query: Callable[[JointVector], tuple[float, LinkPair]],
    path: JointPath,
    before: JointVector,
    levers: Array,
    bounds: Sequence[float],
) -> ClearancePath:
    """Returns a distance along a motion.

    Args:
        query: Returns the distance in one configuration, [m], and its two links.
        path: Commanded joint angles in every cycle, shape (N, n), [rad].
        before: Those of the cycle before, shape (n,), [rad].
        levers: How far the arm reaches from each joint's axis, shape (n,), [m].
        bounds: Distances of which it must be known in every cycle whether it is larger, [m].
    """
    rows, cycles, travel = _in_between(np.ascontiguousarray(path), before, levers)
    distance, links = np.full(len(rows), np.nan), np.zeros((len(rows), 2), dtype=np.intp)

    def compute(row: int) -> float:
        distance[row], links[row] = found = query(rows[row])
        return found[0]

    computed = _advance(compute, travel, max(bounds))
    while True:
        between, low, high = _known(distance, travel, computed)
        unsure = low < distance[computed].min() - MOST_TRAVEL / 2.0 - _ROUNDING
        for bound in bounds:
            unsure |= (low <= bound) & (bound < high)
        found = np.flatnonzero(unsure)
        if not len(found):
            break
        _, first, count = np.unique(between[found], return_index=True, return_counts=True)
        chosen = found[first + count // 2]  # One in the middle of each gap; the next round has narrower bounds.
        for row in chosen.tolist():
            compute(row)
        computed = np.sort(np.concatenate((computed, chosen)))
    straight = np.clip(np.interp(np.arange(len(rows)), computed, distance[computed]), low, high)
    known = np.maximum(straight, np.nextafter(distance[computed].min(), np.inf))  # The smallest one is exact.
    known[computed] = distance[computed]
    return _by_cycle(known, links[computed[between]], cycles, len(computed))


def in_between(start: JointVector, end: JointVector, levers: Array) -> JointPath:
    """Returns the rows to compute in one cycle: its end, and points of its path where it is long; shape (m, n)."""
    return _in_between(end[np.newaxis], start, levers)[0]


def _in_between(path: JointPath, before: JointVector, levers: Array) -> tuple[JointPath, NDArray[np.intp], Array]:
    """Returns all rows that can be computed, the cycle of each, and how far any point has moved until then at most."""
    steps = np.diff(path, axis=0, prepend=before[np.newaxis])
    lengths = (np.abs(steps) * levers).sum(axis=1)  # A product with a matrix would round otherwise, row by row.
    parts = np.where(lengths <= LONGEST_STEP, np.maximum(np.ceil(lengths / MOST_TRAVEL), 1.0), 1.0).astype(np.intp)
    cycles = np.repeat(np.arange(len(path)), parts)
    if len(cycles) == len(path):
        return path, cycles, np.cumsum(lengths)
    remaining = np.cumsum(parts)[cycles] - 1 - np.arange(len(cycles))
    rows = path[cycles] - steps[cycles] * (remaining / parts[cycles])[:, np.newaxis]
    return rows, cycles, np.cumsum((lengths / parts)[cycles])


def _advance(compute: Callable[[int], float], travel: Array, bound: float) -> NDArray[np.intp]:
    """Computes the first row, the last one and others as far apart as each distance allows, and returns them."""
    marks, row, last = travel.tolist(), 0, len(travel) - 1
    rows = [row]
    while True:
        free = max(compute(row) - bound, MOST_TRAVEL)
        if row == last:
            return np.array(rows, dtype=np.intp)
        row = max(row + 1, bisect_right(marks, marks[row] + free) - 1)
        rows.append(row)


def _known(distance: Array, travel: Array, computed: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array, Array]:
    """Returns the last query up to each row, and the least and the largest distance that the row can have."""
    every: NDArray[np.intp] = np.arange(len(travel))
    between = np.searchsorted(computed, every, side="right") - 1
    a, b = computed[between], computed[np.minimum(between + 1, len(computed) - 1)]
    since, until = travel - travel[a] + _ROUNDING, np.maximum(travel[b] - travel, 0.0) + _ROUNDING
    low = np.maximum(distance[a] - since, distance[b] - until)
    high = np.minimum(distance[a] + since, distance[b] + until)
    low[computed] = high[computed] = distance[computed]
    return between, low, high


def _by_cycle(distance: Array, links: NDArray[np.intp], cycles: NDArray[np.intp], queries: int) -> ClearancePath:
    """Returns the smallest of each cycle's rows."""
    if cycles[-1] + 1 == len(cycles):
        return ClearancePath(distance, links, queries)
    first = np.flatnonzero(np.diff(cycles, prepend=-1))
    smallest = np.lexsort((distance, cycles))[first]  # Sorted within each cycle, which stay where they are.
    return ClearancePath(distance[smallest], links[smallest], queries)
