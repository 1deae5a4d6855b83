"""Writer of the control process's status, cheap enough for every cycle."""

from __future__ import annotations

import struct
import time
from dataclasses import replace
from typing import Any

from rcilab.control_process.jitter_histogram import JitterHistogram
from rcilab.control_process.layout import RING_CYCLES, ControlBlock, Counter
from rcilab.control_process.snapshot import Snapshot, write_snapshot
from rcilab.control_process.status import MESSAGES, Phase
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_recorder import Recorder
from rcilab.core.spatial import Pose
from rcilab.execution.recorder import CycleLog

_SNAPSHOT_CYCLES = 20  # Rows between two snapshots: 50 per second.
_WRENCH = struct.Struct("=6d")
_POSE = struct.Struct("=16d")
_RATE_TIME = 1.0  # [s] For which states are counted.


class StatusWriter:
    """Writes the control process's part of the shared block. Owned by its one thread.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._block = block
        self._counters = block.counters
        self.recorder = Recorder(block.n, RING_CYCLES, block.cycles)
        self.recorder.count = self._counters[Counter.CYCLES]  # A restarted process continues the ring.
        self.snapshot = Snapshot()
        self._histogram = JitterHistogram(block.histogram)
        self._rate_since = time.monotonic_ns()
        self._rate_from = self.recorder.count
        self._skipped = 0
        self._motion_cycle = 0
        self._wrench: Array | None = None  # The external wrench in the block.
        self.update()

    def restart(self) -> None:
        """Resets the timing for a new connection."""
        self._histogram.clear()
        self._block.tool[15] = 0.0
        self._counters[Counter.LOST] = 0

    def announce_silence(self, seconds: float) -> None:
        """Allows this process to write no heartbeat for a time, [s], as while a driver waits for an answer."""
        self._counters[Counter.WORKER_HEARTBEAT] = time.monotonic_ns() + round(1e9 * seconds)

    def write_heartbeat(self) -> None:
        """Writes the heartbeat, and the rate of states once a second."""
        now = time.monotonic_ns()
        self._counters[Counter.WORKER_HEARTBEAT] = now
        elapsed = (now - self._rate_since) * 1e-9
        if elapsed >= _RATE_TIME:
            self.update(rate_hz=(self.recorder.count + self._skipped - self._rate_from) / elapsed)
            self._rate_since, self._rate_from = now, self.recorder.count + self._skipped

    def update(self, **changes: Any) -> None:
        """Writes the snapshot with some fields changed."""
        self.snapshot = replace(self.snapshot, **changes)
        write_snapshot(self._block.snapshot, self._counters, self.snapshot)

    def set_phase(self, phase: Phase, code: str, **facts: Any) -> None:
        """Sets phase and message; does nothing if the code is unchanged and the message has no values."""
        if self.snapshot.code != code or facts:
            self.update(phase=phase, code=code, message=MESSAGES[code].format(**facts))

    def on_row(self, log: CycleLog) -> None:
        """Updates counters and status after a row was written to the ring."""
        count = self.recorder.count
        self._skipped = log.skipped_total
        self._counters[Counter.CYCLES] = count
        self._counters[Counter.LOST] = log.lost_total
        if log.lateness == log.lateness:  # NaN if the loop did not wait for the state.
            self._histogram.add(log.lateness)
        if log.state is not None and log.state.tau_ext_in_base is not self._wrench:
            self._wrench = log.state.tau_ext_in_base
            _WRENCH.pack_into(self._block.wrench, 0, *self._wrench.tolist())
        self.write_heartbeat()
        is_timed = self.snapshot.motion_duration is not None and self.snapshot.phase in ("moving", "stopping")
        if is_timed and count % _SNAPSHOT_CYCLES == 0:
            self.update(motion_time=self._motion_cycle * CYCLE_TIME)

    def end_motion(self) -> None:
        """Writes the final time of a motion with a duration."""
        self.await_input(None)
        if self.snapshot.motion_duration is not None:
            self.update(motion_time=self._motion_cycle * CYCLE_TIME)

    def begin_motion(self, duration: float | None) -> None:
        """Writes the duration of a motion that begins, [s]; None: it has none, such as a jog."""
        self.on_cycle(0)
        self.update(awaited=-1, motion_time=None if duration is None else 0.0, motion_duration=duration)

    def await_input(self, signal: int | None) -> None:
        """Writes which input the motion waits for; None: none."""
        awaited = -1 if signal is None else signal
        if awaited != self.snapshot.awaited:
            self.update(awaited=awaited)

    def set_output(self, signal: int, level: bool) -> None:
        """Writes the level of a digital output that was set."""
        bit, shown = 1 << signal, self.snapshot
        outputs = shown.outputs | bit if level else shown.outputs & ~bit
        self.update(outputs_known=shown.outputs_known | bit, outputs=outputs)

    def write_tool(self, T_flange_tool: Pose) -> None:
        """Writes the tool that follows from the poses that the controller reports."""
        _POSE.pack_into(self._block.tool, 0, *T_flange_tool.as_row_major())

    def on_cycle(self, cycle: int) -> None:
        """Stores the present cycle of the motion."""
        self._motion_cycle = self._counters[Counter.MOTION_CYCLE] = cycle
