"""Histogram of lateness in logarithmic bins: cheap to update in every cycle, and accurate enough for percentiles."""

from __future__ import annotations

from math import log2

import numpy as np
from numpy.typing import NDArray

from rcilab.control_process.status import Lateness

BINS_PER_OCTAVE = 16  # A bin is 4.4 % wide.
OCTAVES = 21  # From 1 us to 2 s.
BIN_COUNT = BINS_PER_OCTAVE * OCTAVES
MAXIMUM = BIN_COUNT  # Index of the largest lateness, [ns].
LATE = BIN_COUNT + 1  # Index of the number of cycles that were more than a cycle time late.
SIZE = BIN_COUNT + 2
"""Size of a histogram, in words of 8 bytes."""

LATE_AFTER = 1e-3  # [s] One cycle: the answer was sent when the next one was due.
_SHOWN_EDGES = (0.0, 5.0, 10.0, 20.0, 30.0, 50.0, 75.0, 100.0, 150.0, 200.0, 300.0, 500.0, 750.0, 1000.0, 2000.0,
                5000.0, 10000.0, np.inf)  # fmt: skip
"""Edges of the displayed bins, [us]."""
_EDGES = np.array(_SHOWN_EDGES)
_EDGES.flags.writeable = False
_MIDDLES = 2.0 ** ((np.arange(BIN_COUNT) + 0.5) / BINS_PER_OCTAVE)
_MIDDLES[0] = 0.5
_SHOWN_BIN = np.searchsorted(_EDGES, _MIDDLES, side="right") - 1
"""Index of the displayed bin for each bin."""
_SHARES = np.array((0.5, 0.99, 0.999))


class JitterHistogram:
    """Histogram in shared memory. Written by the control process only.

    Args:
        words: `SIZE` writable words of 8 bytes.
    """

    def __init__(self, words: memoryview) -> None:
        self._words = words

    def clear(self) -> None:
        """Sets all counts to zero."""
        for index in range(SIZE):
            self._words[index] = 0

    def add(self, lateness: float) -> None:
        """Counts one cycle.

        Args:
            lateness: [s].
        """
        words = self._words
        micro = lateness * 1e6
        index = int(log2(micro) * BINS_PER_OCTAVE) if micro > 1.0 else 0
        words[min(index, BIN_COUNT - 1)] += 1
        nano = int(micro * 1e3)
        if nano > words[MAXIMUM]:
            words[MAXIMUM] = nano
        if lateness > LATE_AFTER:
            words[LATE] += 1


def late_cycles(words: memoryview) -> int:
    """Returns the number of cycles that were more than one cycle time late."""
    return words[LATE]


def summarise(words: memoryview) -> Lateness:
    """Returns the statistics of a histogram, which may be updated meanwhile."""
    counts = np.frombuffer(words, dtype=np.int64, count=BIN_COUNT).copy()
    cumulative = np.cumsum(counts)
    total = int(cumulative[-1])
    shown: NDArray[np.int64] = np.bincount(_SHOWN_BIN, counts, len(_EDGES) - 1).astype(np.int64)
    if total == 0:
        return Lateness(edges=_EDGES, histogram=shown)
    largest = words[MAXIMUM] / 1e3
    indices = np.searchsorted(cumulative, _SHARES * total)
    p50, p99, p999 = np.minimum(_MIDDLES[indices], largest).tolist()
    return Lateness(p50=p50, p99=p99, p999=p999, max=largest, cycles=total, edges=_EDGES, histogram=shown)
