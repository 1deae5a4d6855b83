"""Distances along a whole motion: computed every 5 mm of travel, less often if they are large, more often if small.

No point of the arm moves farther than the rotations of the joints times their levers, so a distance changes by at most
that from one row to the next (conservative advancement, Mirtich 1996). After a query no collision is possible until the
arm has travelled the rest of the distance to the bound; the next query is at least 5 mm later. The distance of a row
between two queries is then known within a bracket. If the bracket contains a bound, or could contain the smallest
distance, the row is computed too. The result for every cycle is thus that of its own distance.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.clearance import LinkPair

MAX_TRAVEL = 5e-3  # [m]
"""Largest travel of any point of a link between two queries, unless the distance allows more."""
MAX_STEP = 2e-2  # [m]
"""Travel in one cycle, 20 m/s, beyond which only its end is computed; it violates other conditions anyway."""

_ROUNDING = 1e-9  # [m] More than the rounding of sums of travel.


@dataclass(frozen=True, slots=True, eq=False)
class ClearancePath:
    """One distance in every cycle of a motion."""

    distance: Array
    """Distance in every cycle, shape (N,), [m]. Exact if computed; otherwise interpolated, on the correct side of every
    bound. The smallest one is exact; the real minimum between queries is at most half of `MAX_TRAVEL` smaller."""
    links: NDArray[np.intp]
    """The two links of the last query at or before each cycle, shape (N, 2)."""
    queries: int
    """Number of computed distances."""


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
        before: Joint angles of the previous cycle, shape (n,), [rad].
        levers: Largest distance of the arm from each joint's axis, shape (n,), [m].
        bounds: Bounds that every distance must be compared with exactly, [m].
    """
    rows, cycles, travel = _sample(np.ascontiguousarray(path), before, levers)
    distance, links = np.full(len(rows), np.nan), np.zeros((len(rows), 2), dtype=np.intp)

    def compute(row: int) -> float:
        value, pair = query(rows[row])
        distance[row], links[row] = value, pair[:2]
        return value

    computed = _advance(compute, travel, max(bounds))
    while True:
        between, low, high = _bracket(distance, travel, computed)
        is_open = low < distance[computed].min() - MAX_TRAVEL / 2.0 - _ROUNDING
        for bound in bounds:
            is_open |= (low <= bound) & (bound < high)
        found = np.flatnonzero(is_open)
        if not len(found):
            break
        _, first, count = np.unique(between[found], return_index=True, return_counts=True)
        chosen = found[first + count // 2]  # One in the middle of each gap; it narrows the brackets.
        for row in chosen.tolist():
            compute(row)
        computed = np.sort(np.concatenate((computed, chosen)))
    interpolated = np.clip(np.interp(np.arange(len(rows)), computed, distance[computed]), low, high)
    result = np.maximum(interpolated, np.nextafter(distance[computed].min(), np.inf))  # The smallest one is exact.
    result[computed] = distance[computed]
    return _by_cycle(result, links[computed[between]], cycles, len(computed))


def sample_cycle(start: JointVector, end: JointVector, levers: Array) -> JointPath:
    """Returns the rows to compute in one cycle: its end, and points on the path if it is long, shape (m, n), [rad]."""
    return _sample(end[np.newaxis], start, levers)[0]


def _sample(path: JointPath, before: JointVector, levers: Array) -> tuple[JointPath, NDArray[np.intp], Array]:
    """Returns all rows that can be computed, the cycle of each, and the largest travel of any point up to it, [m]."""
    steps = np.diff(path, axis=0, prepend=before[np.newaxis])
    lengths = (np.abs(steps) * levers).sum(axis=1)  # A matrix product would round differently in each row.
    parts = np.where(lengths <= MAX_STEP, np.maximum(np.ceil(lengths / MAX_TRAVEL), 1.0), 1.0).astype(np.intp)
    cycles = np.repeat(np.arange(len(path)), parts)
    if len(cycles) == len(path):
        return path, cycles, np.cumsum(lengths)
    remaining = np.cumsum(parts)[cycles] - 1 - np.arange(len(cycles))
    rows = path[cycles] - steps[cycles] * (remaining / parts[cycles])[:, np.newaxis]
    return rows, cycles, np.cumsum((lengths / parts)[cycles])


def _advance(compute: Callable[[int], float], travel: Array, bound: float) -> NDArray[np.intp]:
    """Computes the first and the last row and others as far apart as each distance allows, and returns them."""
    travelled, row, last = travel.tolist(), 0, len(travel) - 1
    rows = [row]
    while True:
        allowance = max(compute(row) - bound, MAX_TRAVEL)
        if row == last:
            return np.array(rows, dtype=np.intp)
        row = max(row + 1, bisect_right(travelled, travelled[row] + allowance) - 1)
        rows.append(row)


def _bracket(distance: Array, travel: Array, computed: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array, Array]:
    """Returns the last query at or before each row, and the smallest and the largest possible distance of the row."""
    rows: NDArray[np.intp] = np.arange(len(travel))
    between = np.searchsorted(computed, rows, side="right") - 1
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
    smallest = np.lexsort((distance, cycles))[first]  # Sorted within each cycle.
    return ClearancePath(distance[smallest], links[smallest], queries)
