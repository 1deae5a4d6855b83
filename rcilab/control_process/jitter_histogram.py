"""Lateness counted in logarithmic bins: cheap to add to in every cycle, exact enough for percentiles."""

from __future__ import annotations

from math import log2

import numpy as np
from numpy.typing import NDArray

from rcilab.control_process.status import Lateness

BINS_PER_OCTAVE = 16  # A bin is 4.4 % wide.
OCTAVES = 21  # From 1 us to 2 s.
BIN_COUNT = BINS_PER_OCTAVE * OCTAVES
MAXIMUM = BIN_COUNT  # The place after the bins holds the largest lateness, in [ns].
LATE = BIN_COUNT + 1  # And the one after that how many cycles were more than a cycle time late.
SIZE = BIN_COUNT + 2
"""Words of 8 bytes that a histogram takes."""

LATE_AFTER = 1e-3  # [s] One cycle: the answer came when the next one was due.
_SHOWN_EDGES = (0.0, 5.0, 10.0, 20.0, 30.0, 50.0, 75.0, 100.0, 150.0, 200.0, 300.0, 500.0, 750.0, 1000.0, 2000.0,
                5000.0, 10000.0, np.inf)  # fmt: skip
"""Edges of the bins that people see, [us]."""
_EDGES = np.array(_SHOWN_EDGES)
_EDGES.flags.writeable = False
_MIDDLES = 2.0 ** ((np.arange(BIN_COUNT) + 0.5) / BINS_PER_OCTAVE)
_MIDDLES[0] = 0.5
_SHOWN_BIN = np.searchsorted(_EDGES, _MIDDLES, side="right") - 1
"""In which of the bins that people see a bin is counted."""
_SHARES = np.array((0.5, 0.99, 0.999))


class JitterHistogram:
    """Counts in shared memory. Owned by the control process; others read.

    Args:
        words: `SIZE` writable words of 8 bytes.
    """

    def __init__(self, words: memoryview) -> None:
        self._words = words

    def clear(self) -> None:
        """Starts counting anew."""
        for place in range(SIZE):
            self._words[place] = 0

    def add(self, lateness: float) -> None:
        """Counts one cycle.

        Args:
            lateness: [s].
        """
        words = self._words
        micro = lateness * 1e6
        place = int(log2(micro) * BINS_PER_OCTAVE) if micro > 1.0 else 0
        words[min(place, BIN_COUNT - 1)] += 1
        nano = int(micro * 1e3)
        if nano > words[MAXIMUM]:
            words[MAXIMUM] = nano
        if lateness > LATE_AFTER:
            words[LATE] += 1


def late_cycles(words: memoryview) -> int:
    """Returns how many cycles were more than one cycle late."""
    return words[LATE]


def summarise(words: memoryview) -> Lateness:
    """Returns the figures of a histogram that may still be counting."""
    counts = np.frombuffer(words, dtype=np.int64, count=BIN_COUNT).copy()
    cumulative = np.cumsum(counts)
    total = int(cumulative[-1])
    shown: NDArray[np.int64] = np.bincount(_SHOWN_BIN, counts, len(_EDGES) - 1).astype(np.int64)
    if total == 0:
        return Lateness(edges=_EDGES, histogram=shown)
    largest = words[MAXIMUM] / 1e3
    places = np.searchsorted(cumulative, _SHARES * total)
    p50, p99, p999 = np.minimum(_MIDDLES[places], largest).tolist()
    return Lateness(p50=p50, p99=p99, p999=p999, max=largest, cycles=total, edges=_EDGES, histogram=shown)
