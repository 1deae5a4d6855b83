"""Reader of the ring of cycles that the control process writes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rcilab.control_process.layout import RING_CYCLES, ControlBlock, Counter
from rcilab.core.cycle_log import cycle_dtype


class RingReader:
    """One reader with its own position in the ring. Owned by one thread at a time.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._counters = block.counters
        self._rows: NDArray[np.void] = np.frombuffer(block.cycles, cycle_dtype(block.n), RING_CYCLES)
        self._next = 0
        self.overrun = 0
        """Number of rows that were overwritten before they were read."""

    def newest(self) -> NDArray[np.void] | None:
        """Returns a copy of the newest row, shape (1,), or None while the ring is empty; does not move the reader."""
        while True:
            count = self._counters[Counter.CYCLES]
            if count == 0:
                return None
            index = (count - 1) % RING_CYCLES
            row = self._rows[index : index + 1].copy()
            if self._counters[Counter.CYCLES] - (count - 1) < RING_CYCLES:
                return row

    def last(self, count: int) -> NDArray[np.void]:
        """Returns a copy of the newest rows, at most `count`, oldest first; does not move the reader."""
        end = self._counters[Counter.CYCLES]
        return self._copy(max(end - count, 0), end)

    def drain(self) -> NDArray[np.void]:
        """Returns a copy of every row since the last call, oldest first."""
        count = self._counters[Counter.CYCLES]
        first = max(self._next, count - RING_CYCLES)
        rows = self._copy(first, count)
        # Rows that were overwritten during the copy are invalid; so is the row being written.
        overwritten = max(0, self._counters[Counter.CYCLES] + 1 - RING_CYCLES - first)
        lost = first - self._next + min(overwritten, len(rows))
        rows = rows[overwritten:]
        self.overrun += lost
        self._next = count
        if lost and len(rows):
            rows["lost"][0] += lost
        return rows

    def _copy(self, first: int, end: int) -> NDArray[np.void]:
        return self._rows[np.arange(first, end) % RING_CYCLES]
