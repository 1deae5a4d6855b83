"""How long a command takes to come back in a state, and how long we take to answer: from the recorded cycles."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from rcilab.control_process.layout import ControlBlock
from rcilab.control_process.ring import RingReader
from rcilab.core.clock import CYCLE_TIME
from rcilab.recording.run import find_delay

_PERIOD = 0.5  # [s] between two samples; the delay changes slowly.
_CYCLES = 600  # Of the newest that are looked at.
_FEWEST = 50
_MOVED = 1e-6  # [rad] Less motion than that does not show a delay.


class RoundTrip:
    """Looks at the ring twice a second at most; changes nothing. Guarded by the lock of its owner.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._ring = RingReader(block)
        self._looked = 0.0
        self._found: dict[str, Any] = {}

    def read_fields(self) -> dict[str, Any]:
        """Returns `round_trip` and `answer_time` of the status, as far as they are known."""
        now = time.monotonic()
        if now - self._looked < _PERIOD:
            return self._found
        self._looked = now
        rows = self._ring.last(_CYCLES)
        rows = rows[np.isfinite(rows["t"]) & (rows["sent_ns"] > 0)]
        if len(rows) < _FEWEST:
            return self._found
        self._found = {**self._found, "answer_time": 1e-9 * float(np.median(rows["sent_ns"] - rows["received_ns"]))}
        command = rows["command"]
        if np.isfinite(command).all() and np.ptp(command, axis=0).max() > _MOVED:
            self._found["round_trip"] = CYCLE_TIME * find_delay(rows["q_c"], command)
        return self._found
