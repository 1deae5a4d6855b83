"""A ring of recorded cycles in shared memory: one process writes it, others read it.

The writer stores a row before the counter that announces it, and never waits for a reader: a reader that is too slow
loses the oldest rows and counts them.

The ring of a virtual controller, `CycleRing`, is an unnamed file of these parts:

    header      magic, version, number of joints, size of a row, capacity
    counters    rows and events written so far, 8 bytes each
    facts       JSON: what the reader must know about the controller
    events      ring of lines of JSON: the motions of its client, from their beginning to their end
    rows        ring of cycles, with `PLAYOUT_FIELDS`
"""

from __future__ import annotations

import json
import mmap
import os
import struct
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import UsageError, VersionMismatchError
from rcilab.core.shared_memory import PAGE, open_shared_memory, whole_pages

CAPACITY = 16384
"""Cycles in the ring of a controller, 16 s: the longest time between two reads without a loss."""
_MAGIC = b"RCILABCY"
_VERSION = 1
_HEADER = struct.Struct("<8sIIII")
_EVENT_SLOTS, _EVENT_SIZE = 64, 4 * PAGE
_LENGTH = struct.Struct("<I")


class RingCounter(IntEnum):
    """Index of each counter of a `CycleRing`."""

    ROWS = 0
    EVENTS = 1


class CycleRing:
    """The ring of a virtual controller; one object in each process.

    Args:
        descriptor: Open file of the ring; this object owns and closes it.

    Raises:
        VersionMismatchError: It was made by another version of rcilab.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        try:
            size = os.fstat(descriptor).st_size
            # Populated, because a page that is touched for the first time would delay a cycle.
            self._map = mmap.mmap(descriptor, size, flags=mmap.MAP_SHARED | mmap.MAP_POPULATE)
            header = _HEADER.unpack_from(self._map, 0) if size >= _HEADER.size else (b"", 0, 0, 0, 0)
            magic, version, self.n, row_size, capacity = header
            dtype = cycle_dtype(self.n, complete=True, playout=True)
            if (magic, version, row_size, capacity) != (_MAGIC, _VERSION, dtype.itemsize, CAPACITY):
                raise VersionMismatchError("shared memory of the controller", version, _VERSION)
        except BaseException:
            os.close(descriptor)
            raise
        memory = memoryview(self._map)
        self.counters = memory[PAGE : 2 * PAGE].cast("Q")
        self._facts = memory[2 * PAGE : 3 * PAGE]
        self._events = memory[3 * PAGE : 3 * PAGE + _EVENT_SLOTS * _EVENT_SIZE]
        self.memory = memory[3 * PAGE + _EVENT_SLOTS * _EVENT_SIZE :]
        """The rows, for a `Recorder` of `CAPACITY` rows."""
        self._dtype = dtype

    @classmethod
    def create(cls, n: int, facts: dict[str, Any]) -> CycleRing:
        """Returns a new ring for an arm with n joints.

        Args:
            n: Number of joints.
            facts: JSON data for the readers.

        Raises:
            UsageError: Memory is short.
        """
        row_size = cycle_dtype(n, complete=True, playout=True).itemsize
        size = 3 * PAGE + _EVENT_SLOTS * _EVENT_SIZE + whole_pages(CAPACITY * row_size)
        descriptor = open_shared_memory(size, "the record of the controller")
        text = json.dumps(facts).encode()
        os.pwrite(descriptor, _HEADER.pack(_MAGIC, _VERSION, n, row_size, CAPACITY), 0)
        os.pwrite(descriptor, _LENGTH.pack(len(text)) + text, 2 * PAGE)
        return cls(descriptor)

    @classmethod
    def attach(cls, pid: int, descriptor: int) -> CycleRing:
        """Opens the ring of another process of this user.

        Args:
            pid: Id of the process.
            descriptor: Its descriptor.

        Raises:
            UsageError: It cannot be opened.
        """
        try:
            return cls(os.open(f"/proc/{pid}/fd/{descriptor}", os.O_RDWR))
        except OSError as error:
            raise UsageError(
                f"the record of the controller (process {pid}) cannot be opened: {error.strerror}; watch it as the "
                "user who started it, outside or inside the same container"
            ) from error

    @property
    def facts(self) -> dict[str, Any]:
        """The facts that it was created with."""
        return json.loads(_read(self._facts))

    def add_event(self, event: dict[str, Any]) -> None:
        """Appends an event; only the writer calls it."""
        count = self.counters[RingCounter.EVENTS]
        text = json.dumps(event).encode()
        start = count % _EVENT_SLOTS * _EVENT_SIZE
        self._events[start : start + _LENGTH.size + len(text)] = _LENGTH.pack(len(text)) + text
        self.counters[RingCounter.EVENTS] = count + 1

    def events(self, start: int) -> list[dict[str, Any]]:
        """Returns the events from a number on, oldest first; of more than 64, the newest."""
        count = self.counters[RingCounter.EVENTS]
        first = max(start, count - _EVENT_SLOTS)
        slots = (number % _EVENT_SLOTS * _EVENT_SIZE for number in range(first, count))
        return [json.loads(_read(self._events[slot : slot + _EVENT_SIZE])) for slot in slots]

    def open_reader(self) -> RingReader:
        """Returns a reader of the rows."""
        rows: NDArray[np.void] = np.frombuffer(self.memory, self._dtype, CAPACITY)
        return RingReader(rows, self.counters, RingCounter.ROWS)

    def close(self) -> None:
        """Closes the descriptor; the memory is freed with its last view. May be called twice."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1


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


def _read(slot: memoryview) -> bytes:
    (length,) = _LENGTH.unpack_from(slot)
    return bytes(slot[_LENGTH.size : _LENGTH.size + length])
