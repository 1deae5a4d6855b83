"""Round-trip time of a command, and time from a state to its answer, measured in the recorded cycles."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from rcilab.control_process.layout import ControlBlock
from rcilab.control_process.ring import RingReader
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import state_cycles
from rcilab.recording.run import find_delay

_PERIOD = 0.5  # [s] between two samples; the delay changes slowly.
_CYCLES = 600  # Newest cycles that a sample uses.
_MIN_CYCLES = 50
_MIN_MOTION = 1e-6  # [rad] A smaller motion does not show the delay.


class RoundTrip:
    """Samples the ring at most twice a second. Guarded by its owner's lock.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._ring = RingReader(block)
        self._sampled_at = 0.0
        self._fields: dict[str, Any] = {}

    def read_fields(self) -> dict[str, Any]:
        """Returns `round_trip` and `answer_time` of the status; an unknown one is left out."""
        now = time.monotonic()
        if now - self._sampled_at < _PERIOD:
            return self._fields
        self._sampled_at = now
        rows = self._ring.last(_CYCLES)
        rows = rows[np.isfinite(rows["t"]) & (rows["sent_ns"] > 0)]
        if len(rows) < _MIN_CYCLES:
            return self._fields
        self._fields = {**self._fields, "answer_time": 1e-9 * float(np.median(rows["sent_ns"] - rows["received_ns"]))}
        command = rows["command"]
        if np.isfinite(command).all() and np.ptp(command, axis=0).max() > _MIN_MOTION:
            self._fields["round_trip"] = CYCLE_TIME * state_cycles(rows) * find_delay(rows["q_c"], command)
        return self._fields
