"""Distances along a whole motion: computed every 5 mm of travel, less often far from everything, more often near it.

No point of the arm moves farther than the joints turn times their levers, so a distance changes by no more than that
from one row to the next (conservative advancement, Mirtich 1996). After a look nothing can happen until the arm has
travelled what is left to the bound; 5 mm are allowed in any case. A row between two looks is then known within bounds;
where these leave it open whether a condition holds, or whether the smallest distance is there, it is looked at, too.
The verdict on every cycle is that of its own distance.
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
"""How far any point of a link may move between two looks, unless the distance found leaves room for more."""
LONGEST_STEP = 2e-2  # [m]
"""Travel in one cycle, 20 m/s, beyond which only its end is looked at: no arm can, and other rows refuse it."""

_ROUNDING = 1e-9  # [m] More than sums of travel are rounded by.


@dataclass(frozen=True, slots=True, eq=False)
class ClearancePath:
    """One distance in every cycle of a motion."""

    distance: Array
    """Shape (N,), [m]. That of the cycle where it was looked at; else between two looks, and on the right side of every
    bound. The smallest one is a look's, and none can be smaller by more than half of `MOST_TRAVEL`."""
    links: NDArray[np.intp]
    """Whose distance that is in the last look up to each cycle, shape (N, 2)."""
    looks: int
    """How often it was looked at."""


def clearance_path(
    query: Callable[[JointVector], tuple[float, LinkPair]],
    path: JointPath,
    before: JointVector,
    levers: Array,
    bounds: Sequence[float],
) -> ClearancePath:
    """Returns a distance along a motion.

    Args:
        query: Gives the distance of one configuration, [m], and between whom.
        path: Commanded joint angles in every cycle, shape (N, n), [rad].
        before: Those of the cycle before, shape (n,), [rad].
        levers: How far the arm reaches from each joint's axis, shape (n,), [m].
        bounds: Distances of which it must be known in every cycle whether it is larger, [m].
    """
    rows, cycles, travel = _in_between(np.ascontiguousarray(path), before, levers)
    distance, links = np.full(len(rows), np.nan), np.zeros((len(rows), 2), dtype=np.intp)

    def look(row: int) -> float:
        distance[row], links[row] = found = query(rows[row])
        return found[0]

    looked = _advance(look, travel, max(bounds))
    while True:
        between, low, high = _known(distance, travel, looked)
        unsure = low < distance[looked].min() - MOST_TRAVEL / 2.0 - _ROUNDING
        for bound in bounds:
            unsure |= (low <= bound) & (bound < high)
        found = np.flatnonzero(unsure)
        if not len(found):
            break
        _, first, count = np.unique(between[found], return_index=True, return_counts=True)
        chosen = found[first + count // 2]  # One in the middle of each gap; the next round knows more.
        for row in chosen.tolist():
            look(row)
        looked = np.sort(np.concatenate((looked, chosen)))
    straight = np.clip(np.interp(np.arange(len(rows)), looked, distance[looked]), low, high)
    known = np.maximum(straight, np.nextafter(distance[looked].min(), np.inf))  # The smallest one is that of a look.
    known[looked] = distance[looked]
    return _by_cycle(known, links[looked[between]], cycles, len(looked))


def in_between(start: JointVector, end: JointVector, levers: Array) -> JointPath:
    """Returns what one cycle has to look at: its end, and places on the way there where it is long; shape (m, n)."""
    return _in_between(end[np.newaxis], start, levers)[0]


def _in_between(path: JointPath, before: JointVector, levers: Array) -> tuple[JointPath, NDArray[np.intp], Array]:
    """Returns all rows to look at, the cycle each belongs to, and how far any point has moved until then at most."""
    steps = np.diff(path, axis=0, prepend=before[np.newaxis])
    lengths = (np.abs(steps) * levers).sum(axis=1)  # A product with a matrix would round otherwise, row by row.
    parts = np.where(lengths <= LONGEST_STEP, np.maximum(np.ceil(lengths / MOST_TRAVEL), 1.0), 1.0).astype(np.intp)
    cycles = np.repeat(np.arange(len(path)), parts)
    if len(cycles) == len(path):
        return path, cycles, np.cumsum(lengths)
    remaining = np.cumsum(parts)[cycles] - 1 - np.arange(len(cycles))
    rows = path[cycles] - steps[cycles] * (remaining / parts[cycles])[:, np.newaxis]
    return rows, cycles, np.cumsum((lengths / parts)[cycles])


def _advance(look: Callable[[int], float], travel: Array, bound: float) -> NDArray[np.intp]:
    """Looks at rows, the first and the last among them, as far apart as each distance allows, and returns them."""
    marks, row, last = travel.tolist(), 0, len(travel) - 1
    rows = [row]
    while True:
        free = max(look(row) - bound, MOST_TRAVEL)
        if row == last:
            return np.array(rows, dtype=np.intp)
        row = max(row + 1, bisect_right(marks, marks[row] + free) - 1)
        rows.append(row)


def _known(distance: Array, travel: Array, looked: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array, Array]:
    """Returns which look comes before each row or is it, and the least and the largest distance it can have."""
    every: NDArray[np.intp] = np.arange(len(travel))
    between = np.searchsorted(looked, every, side="right") - 1
    a, b = looked[between], looked[np.minimum(between + 1, len(looked) - 1)]
    since, until = travel - travel[a] + _ROUNDING, np.maximum(travel[b] - travel, 0.0) + _ROUNDING
    low = np.maximum(distance[a] - since, distance[b] - until)
    high = np.minimum(distance[a] + since, distance[b] + until)
    low[looked] = high[looked] = distance[looked]
    return between, low, high


def _by_cycle(distance: Array, links: NDArray[np.intp], cycles: NDArray[np.intp], looks: int) -> ClearancePath:
    """Returns the smallest of each cycle's rows."""
    if cycles[-1] + 1 == len(cycles):
        return ClearancePath(distance, links, looks)
    first = np.flatnonzero(np.diff(cycles, prepend=-1))
    smallest = np.lexsort((distance, cycles))[first]  # Sorted within each cycle, which stay where they are.
    return ClearancePath(distance[smallest], links[smallest], looks)
