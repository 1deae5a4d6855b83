"""What the control process shows of itself, kept cheap enough for every cycle."""

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
from rcilab.core.spatial import Pose
from rcilab.execution.recorder import CycleLog, Recorder

_SNAPSHOT_CYCLES = 20  # Rows between two snapshots: 50 a second.
_WRENCH = struct.Struct("=6d")
_POSE = struct.Struct("=16d")
_RATE_TIME = 1.0  # [s] over which states are counted.


class StatusWriter:
    """Owns the control process's side of the shared block. One thread.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._block = block
        self._counters = block.counters
        self.recorder = Recorder(block.n, RING_CYCLES, block.cycles)
        self.recorder.count = self._counters[Counter.CYCLES]  # A successor goes on where its predecessor died.
        self.snapshot = Snapshot()
        self._histogram = JitterHistogram(block.histogram)
        self._rate_since = time.monotonic_ns()
        self._rate_from = self.recorder.count
        self._motion_cycle = 0
        self._felt: Array | None = None  # What the block says of the wrench from outside.
        self.update()

    def restart(self) -> None:
        """Forgets the timing: another connection begins."""
        self._histogram.clear()
        self._block.tool[15] = 0.0
        self._counters[Counter.LOST] = 0

    def beat(self) -> None:
        """Gives a sign of life, and counts states a second."""
        now = time.monotonic_ns()
        self._counters[Counter.WORKER_BEAT] = now
        elapsed = (now - self._rate_since) * 1e-9
        if elapsed >= _RATE_TIME:
            self.update(rate_hz=(self.recorder.count - self._rate_from) / elapsed)
            self._rate_since, self._rate_from = now, self.recorder.count

    def update(self, **changes: Any) -> None:
        """Writes the snapshot with some fields changed."""
        self.snapshot = replace(self.snapshot, **changes)
        write_snapshot(self._block.snapshot, self._counters, self.snapshot)

    def say(self, phase: Phase, code: str, **facts: Any) -> None:
        """Shows another phase, and why; what was said last is not said again."""
        if self.snapshot.code != code or facts:
            self.update(phase=phase, code=code, message=MESSAGES[code].format(**facts))

    def on_row(self, log: CycleLog) -> None:
        """Announces a row that was written to the ring."""
        count = self.recorder.count
        self._counters[Counter.CYCLES] = count
        self._counters[Counter.LOST] = log.lost_total
        if log.lateness == log.lateness:  # NaN where the state was not waited for.
            self._histogram.add(log.lateness)
        if log.state is not None and log.state.tau_ext_in_base is not self._felt:
            self._felt = log.state.tau_ext_in_base
            _WRENCH.pack_into(self._block.felt, 0, *self._felt.tolist())
        self.beat()
        is_timed = self.snapshot.motion_duration is not None and self.snapshot.phase in ("moving", "stopping")
        if is_timed and count % _SNAPSHOT_CYCLES == 0:
            self.update(motion_time=self._motion_cycle * CYCLE_TIME)

    def end_motion(self) -> None:
        """Says how far the motion came; nothing where it was no timed one."""
        if self.snapshot.motion_duration is not None:
            self.update(motion_time=self._motion_cycle * CYCLE_TIME)

    def begin_motion(self, duration: float | None) -> None:
        """Says how long the motion takes that begins now, [s]; None: for as long as it is renewed."""
        self._motion_cycle = 0
        self.update(motion_time=None if duration is None else 0.0, motion_duration=duration)

    def show_tool(self, T_flange_tool: Pose) -> None:
        """Shows which tool the controller has, by the poses it reports."""
        _POSE.pack_into(self._block.tool, 0, *T_flange_tool.as_row_major())

    def on_cycle(self, cycle: int) -> None:
        """Takes note of how far the motion is."""
        self._motion_cycle = cycle
