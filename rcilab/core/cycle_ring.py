"""A ring of recorded cycles in shared memory: one process writes it, others read it.

The writer stores a row before the counter that announces it, and never waits for a reader: a reader that is too slow
loses the oldest rows and counts them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class RingReader:
    """One reader with its own position in the ring. Owned by one thread at a time.

    Args:
        rows: The rows of the ring, shape (capacity,).
        counters: Counters that the writer updates.
        index: Index of the number of written rows in `counters`.
    """

    def __init__(self, rows: NDArray[np.void], counters: memoryview, index: int) -> None:
        self._rows = rows
        self._counters, self._index = counters, index
        self._next = 0
        self.overrun = 0
        """Number of rows that were overwritten before they were read."""

    @property
    def count(self) -> int:
        """Number of rows written so far."""
        return self._counters[self._index]

    def newest(self) -> NDArray[np.void] | None:
        """Returns a copy of the newest row, shape (1,), or None while the ring is empty; does not move the reader."""
        while True:
            count = self.count
            if count == 0:
                return None
            index = (count - 1) % len(self._rows)
            row = self._rows[index : index + 1].copy()
            if self.count - (count - 1) < len(self._rows):
                return row

    def last(self, count: int) -> NDArray[np.void]:
        """Returns a copy of the newest rows, at most `count`, oldest first; does not move the reader."""
        end = self.count
        return self._copy(max(end - count, 0), end)

    def skip(self) -> None:
        """Moves the reader behind the newest row."""
        self._next = self.count

    def drain(self, end: int | None = None) -> NDArray[np.void]:
        """Returns a copy of every row since the last call, oldest first.

        Args:
            end: Number of the first row that is left for the next call; None: all rows are returned.
        """
        count = self.count if end is None else max(min(end, self.count), self._next)
        first = min(max(self._next, self.count - len(self._rows)), count)
        rows = self._copy(first, count)
        # Rows that were overwritten during the copy are invalid; so is the row being written.
        overwritten = max(0, self.count + 1 - len(self._rows) - first)
        lost = first - self._next + min(overwritten, len(rows))
        rows = rows[overwritten:]
        self.overrun += lost
        self._next = count
        if lost and len(rows):
            rows["lost"][0] += lost
        return rows

    def _copy(self, first: int, end: int) -> NDArray[np.void]:
        return self._rows[np.arange(first, end) % len(self._rows)]
