"""The shared memory block of supervisor and control process.

    header      magic, version and sizes, so that different builds of rcilab cannot misread it
    counters    counters and heartbeats, 8 bytes each, each written by one side only
    settings    the data that the control process needs at its start, pickled; written once
    snapshot    phase, message and motion, guarded by a sequence number
    histogram   lateness of cycles
    requests    ring of messages to the control process
    replies     ring of messages from the control process
    jog         the held jog, guarded by a sequence number
    wrench      the controller's latest estimate of the external wrench, and its tool
    cycles      ring of recorded cycles
    motion      rows of the motion to stream

The block is an unnamed file in memory, inherited by the control process as an open descriptor: the system frees it when
both processes have ended, even if they were killed. Counters are aligned and stored with one instruction; data is
written before the counter that announces it. (x86 guarantees this order; on other processors the interpreter's locks
between two statements have the same effect in practice.)
"""

from __future__ import annotations

import mmap
import os
import pickle
import struct
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from rcilab.control_process.jitter_histogram import SIZE as HISTOGRAM_WORDS
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.cycle_ring import RingReader
from rcilab.core.errors import UsageError, VersionMismatchError
from rcilab.core.shared_memory import PAGE, open_shared_memory, whole_pages

MAGIC = b"RCILABCP"
VERSION = 12  # Increment with every change of this file, of the snapshot or of `cycle_dtype`.

RING_CYCLES = 32768  # 33 s: the longest time between two reads without a loss.
MOTION_TIME = 300.0  # [s] Longest motion that fits into the block.
MOTION_ROWS = round(MOTION_TIME / CYCLE_TIME) + 1
OPERATOR_TIMEOUT = 2.0  # [s] A motion ends after this time without an operator (workbench: control lock).
MESSAGE_SLOTS = 16
MESSAGE_SIZE = 32768  # [bytes] The largest message, the reply to a motion with 1000 waits, needs 21 100.

_HEADER = struct.Struct("<8sIIIIQ")  # magic, version, n, size of a cycle, ring capacity, total size
_SETTINGS_SIZE = 4 * PAGE
_SNAPSHOT_SIZE = PAGE


class Counter(IntEnum):
    """Index of each counter. The description names the side that writes it."""

    SUPERVISOR_HEARTBEAT = 0
    """Supervisor: monotonic time of its last heartbeat, [ns]."""
    OPERATOR_HEARTBEAT = 1
    """Supervisor: monotonic time when an operator was last present, [ns]; 0 while none is expected."""
    STOPS_REQUESTED = 2
    """Supervisor: number of requested stops."""
    REQUESTS_POSTED = 3
    """Supervisor."""
    REPLIES_READ = 4
    """Supervisor."""
    WORKER_HEARTBEAT = 5
    """Control process: monotonic time of its last heartbeat, [ns]."""
    REQUESTS_READ = 6
    """Control process."""
    REPLIES_POSTED = 7
    """Control process."""
    CYCLES = 8
    """Control process: number of rows written to the ring."""
    SNAPSHOT = 9
    """Control process: sequence number, odd while the snapshot is being written."""
    LOST = 10
    """Control process: controller cycles whose state was not received, since the connection was made."""
    JOG = 11
    """Supervisor: sequence number, odd while the jog is being written."""
    JOG_HEARTBEAT = 12
    """Supervisor: monotonic time when a jog was last held, [ns]; 0 after its release."""
    MOTION_CYCLE = 13
    """Control process: newest cycle of the motion in progress, in which waits for inputs do not count."""


class ControlBlock:
    """The mapped block; one object in each process.

    Args:
        descriptor: Open file of the block; this object owns and closes it.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        try:
            size = os.fstat(descriptor).st_size
            if size < _HEADER.size:
                raise VersionMismatchError("shared memory of the control process", f"of {size} bytes", VERSION)
            self._map = mmap.mmap(descriptor, size)
        except BaseException:
            os.close(descriptor)
            raise
        self._memory = memoryview(self._map)
        try:
            self.n = self._check_header(size)
            self._place_regions()
        except BaseException:
            self.close()
            raise

    @classmethod
    def create(cls, n: int, settings: object) -> ControlBlock:
        """Returns a new block for an arm with n joints.

        Args:
            n: Number of joints.
            settings: The data that the control process needs at its start; pickled.
        """
        data = pickle.dumps(settings)
        if len(data) > _SETTINGS_SIZE - 4:
            raise UsageError(
                f"the settings of the control process need {len(data)} bytes, at most {_SETTINGS_SIZE - 4} fit"
            )
        size = _total_size(n)
        descriptor = open_shared_memory(size, "the control process")
        os.pwrite(descriptor, _HEADER.pack(MAGIC, VERSION, n, cycle_dtype(n).itemsize, RING_CYCLES, size), 0)
        os.pwrite(descriptor, struct.pack("<I", len(data)) + data, 2 * PAGE)
        return cls(descriptor)

    @property
    def settings(self) -> object:
        """The settings that the block was created with."""
        (length,) = struct.unpack_from("<I", self._memory, 2 * PAGE)
        return pickle.loads(self._memory[2 * PAGE + 4 : 2 * PAGE + 4 + min(length, _SETTINGS_SIZE - 4)])

    def open_reader(self) -> RingReader:
        """Returns a reader of the recorded cycles."""
        rows: NDArray[np.void] = np.frombuffer(self.cycles, cycle_dtype(self.n), RING_CYCLES)
        return RingReader(rows, self.counters, Counter.CYCLES)

    def close(self) -> None:
        """Closes the descriptor; the memory is freed with its last view. May be called twice."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1

    def _check_header(self, size: int) -> int:
        magic, version, n, cycle_size, ring, total = _HEADER.unpack_from(self._memory, 0)
        if magic != MAGIC or version != VERSION:
            found = version if magic == MAGIC else f"unknown (magic {magic!r})"
            raise VersionMismatchError("shared memory of the control process", found, VERSION)
        layout = (n, cycle_size, ring, total)
        expected = (n, cycle_dtype(n).itemsize, RING_CYCLES, _total_size(n))
        if layout != expected or size != total:
            raise VersionMismatchError(
                "layout of the shared memory (joints, bytes a cycle, cycles, bytes)", (*layout[:3], size), expected
            )
        return n

    def _place_regions(self) -> None:
        start = PAGE
        regions: list[memoryview] = []
        for size in _region_sizes(self.n):
            regions.append(self._memory[start : start + size])
            start += size
        counters, _, self.snapshot, histogram, self.requests, self.replies, self.jog, wrench, self.cycles, motion = (
            regions
        )
        self.counters = counters.cast("Q")
        self.wrench = wrench[: 8 * 6].cast("d")
        self.tool = wrench[8 * 6 : 8 * (6 + 16)].cast("d")
        self.histogram = histogram[: 8 * HISTOGRAM_WORDS].cast("Q")
        self.motion: Array = np.frombuffer(motion, "<f8", MOTION_ROWS * self.n).reshape(MOTION_ROWS, self.n)


def _region_sizes(n: int) -> tuple[int, ...]:
    """Returns the sizes of all regions after the header, in the order of the module's docstring, [bytes]."""
    messages = MESSAGE_SLOTS * MESSAGE_SIZE
    return (
        PAGE,
        _SETTINGS_SIZE,
        _SNAPSHOT_SIZE,
        whole_pages(8 * HISTOGRAM_WORDS),
        messages,
        messages,
        PAGE,
        PAGE,
        whole_pages(RING_CYCLES * cycle_dtype(n).itemsize),
        whole_pages(MOTION_ROWS * n * 8),
    )


def _total_size(n: int) -> int:
    return PAGE + sum(_region_sizes(n))
