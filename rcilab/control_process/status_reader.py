"""Readers of the shared block: status of arm, motion and timing, and the delays measured in the recorded cycles."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from rcilab.control_process.jitter_histogram import late_cycles, summarise
from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.control_process.snapshot import Snapshot, read_snapshot
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import state_cycles
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode, RobotMode
from rcilab.makers.maker import Maker
from rcilab.recording.run import find_delay

_PERIOD = 0.5  # [s] between two samples; the delay changes slowly.
_CYCLES = 600  # Newest cycles that a sample uses.
_MIN_CYCLES = 50
_MIN_MOTION = 1e-6  # [rad] A smaller motion does not show the delay.


class StatusReader:
    """Reads the status that the control process writes.

    Args:
        block: The shared block.
        maker: Maker of the controller: a cycle has one bit for each of its faults, the snapshot one for each signal.
    """

    def __init__(self, block: ControlBlock, maker: Maker) -> None:
        self._faults = tuple(maker.faults())
        self._inputs = range(len(maker.capabilities.inputs))
        self._outputs = range(len(maker.capabilities.outputs))
        self._block = block
        self._ring = block.open_reader()
        self._tool: tuple[bytes, Pose | None] = b"", None

    def read_snapshot(self) -> Snapshot:
        """Returns the latest snapshot of the control process."""
        return read_snapshot(self._block.snapshot, self._block.counters)

    def read_fields(self, shown: Snapshot) -> dict[str, Any]:
        """Returns the fields of `SupervisorStatus` that are in the block; those of the arm only after the first state.

        Args:
            shown: Snapshot with motion and scheduling.
        """
        return {
            "powered": shown.powered,
            "inputs": None if shown.inputs < 0 else tuple(bool(shown.inputs >> bit & 1) for bit in self._inputs),
            "outputs": tuple(
                bool(shown.outputs >> bit & 1) if shown.outputs_known >> bit & 1 else None for bit in self._outputs
            ),
            "awaited": None if shown.awaited < 0 else shown.awaited,
            "rate_hz": shown.rate_hz,
            "scheduling": "SCHED_FIFO" if shown.is_fifo else "normal",
            "memory_locked": shown.memory_locked,
            "late_cycles": late_cycles(self._block.histogram),
            "lost_cycles": self._block.counters[Counter.LOST],
            "lateness": summarise(self._block.histogram),
            "motion_time": shown.motion_time,
            "motion_duration": shown.motion_duration,
            **self._read_arm(),
        }

    def read_cycle(self) -> int:
        """Returns the newest cycle of the motion in progress, without its waits for inputs; 0 before its first."""
        return int(self._block.counters[Counter.MOTION_CYCLE])

    def _read_arm(self) -> dict[str, Any]:
        row = self._ring.newest()
        if row is None:
            return {}
        last = row[0]
        bits = int(last["faults"])
        return {
            "q": last["q"],
            "q_c": last["q_c"],
            "dq": last["dq"],
            "robot_mode": RobotMode(last["robot_mode"]),
            "controller_mode": ControllerMode(last["controller_mode"]),
            "faults": tuple(fault for fault in self._faults if bits >> fault & 1) if bits else (),
            "tau_ext": np.array(self._block.wrench),
            "T_flange_tool": self._read_tool(),
            "success_rate": float(last["success_rate"]),
            "message_id": int(last["message_id"]),
        }

    def _read_tool(self) -> Pose | None:
        """Returns the tool; the same object as long as the numbers do not change."""
        raw = self._block.tool.tobytes()
        if raw != self._tool[0]:
            self._tool = raw, _pose(self._block.tool.tolist())
        return self._tool[1]


def _pose(numbers: Sequence[float]) -> Pose | None:
    if numbers[15] != 1.0:
        return None
    try:
        return Pose.from_row_major(numbers)
    except InvalidValueError:  # It is being written.
        return None


class RoundTrip:
    """Measures the round-trip time of a command and the time from a state to its answer.

    Samples the ring at most twice a second. Guarded by its owner's lock.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._ring = block.open_reader()
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
