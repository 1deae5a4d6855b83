"""A ring of recorded cycles in shared memory: one process writes it, others read it.

The writer stores a row before the counter that announces it, and never waits for a reader: a reader that is too slow
loses the oldest rows and counts them. (Only in lock-step, where time has no meaning, a controller waits for its
recorder.)

The ring of a virtual controller, `CycleRing`, is an unnamed file of these parts:

    header      magic, version, number of joints, size of a row, capacity
    counters    rows and events written so far, and rows that a recorder has read, 8 bytes each
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
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import UsageError, VersionMismatchError
from rcilab.core.shared_memory import PAGE, open_shared_memory, whole_pages

CAPACITY = 16384
"""Cycles in the ring of a controller, 16 s: the longest time between two reads without a loss."""
_MAGIC = b"RCILABCY"
_VERSION = 3
_HEADER = struct.Struct("<8sIIII")
_EVENT_SLOTS, _EVENT_SIZE = 512, 4 * PAGE  # Of 256 motions: the shortest ones within the time of the rows.
_MOST_JOINTS = 16
_LENGTH = struct.Struct("<I")


class RingCounter(IntEnum):
    """Index of each counter of a `CycleRing`."""

    ROWS = 0
    EVENTS = 1
    READ = 2
    """Rows that the recorder has read; 0 without one."""


class CycleRing:
    """The ring of a virtual controller; one object in each process.

    Args:
        descriptor: Open file of the ring; this object owns and closes it.

    Raises:
        UsageError: The file is not that of a ring.
        VersionMismatchError: It was made by another version of rcilab.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        try:
            self.n = _read_joints(descriptor)
            dtype = cycle_dtype(self.n, complete=True, playout=True)
            # Populated, because a page that is touched for the first time would delay a cycle.
            self._map = mmap.mmap(descriptor, 0, flags=mmap.MAP_SHARED | mmap.MAP_POPULATE)
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
        descriptor = open_shared_memory(_size(n), "the record of the controller")
        text = json.dumps(facts).encode()
        row_size = cycle_dtype(n, complete=True, playout=True).itemsize
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
        """The facts that it was created with.

        Raises:
            UsageError: They are not readable.
        """
        facts = _decode(_read(self._facts))
        if facts is None:
            raise UsageError("the record of the controller is damaged: its facts are unreadable")
        return facts

    def add_event(self, event: dict[str, Any]) -> None:
        """Appends an event of at most 16 kB, a longer one without its longest value; only the writer calls it."""
        count = self.counters[RingCounter.EVENTS]
        text = json.dumps(event).encode()
        if len(text) > _EVENT_SIZE - _LENGTH.size:
            longest = max(event, key=lambda name: len(json.dumps(event[name])))
            text = json.dumps({**event, longest: None}).encode()
        start = count % _EVENT_SLOTS * _EVENT_SIZE
        self._events[start : start + _LENGTH.size + len(text)] = _LENGTH.pack(len(text)) + text
        self.counters[RingCounter.EVENTS] = count + 1

    def events(self, start: int) -> tuple[list[dict[str, Any]], int]:
        """Returns the events from a number on, oldest first, and the number of the next one.

        Those that were overwritten are missing: of more than 512, the oldest; so are those that are not readable.
        """
        count = self.counters[RingCounter.EVENTS]
        numbers = range(max(start, count - _EVENT_SLOTS), count)
        slots = [number % _EVENT_SLOTS * _EVENT_SIZE for number in numbers]
        texts = [_read(self._events[slot : slot + _EVENT_SIZE]) for slot in slots]
        first = self.counters[RingCounter.EVENTS] + 1 - _EVENT_SLOTS  # The one before may be half overwritten.
        found = (_decode(text) for number, text in zip(numbers, texts, strict=True) if number >= first)
        return [event for event in found if event is not None], count

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

    @property
    def position(self) -> int:
        """Number of the first row that the next `drain` returns, unless it is overwritten."""
        return self._next

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

    def read(self, first: int, end: int) -> NDArray[np.void]:
        """Returns a copy of the rows from `first` to `end`, without those that are overwritten, the oldest.

        It does not move the reader.
        """
        rows = self._copy(first, end)
        return rows[max(0, self.count + 1 - len(self._rows) - first) :]  # Also without those of during the copy.

    def skip(self, to: int | None = None) -> None:
        """Moves the reader to the row with a number; None: behind the newest one."""
        self._next = self.count if to is None else to

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


def _decode(text: bytes) -> dict[str, Any] | None:
    """Returns the object of a line of JSON; None if it is not one."""
    try:
        found = json.loads(text)
    except ValueError:
        return None
    return cast("dict[str, Any]", found) if isinstance(found, dict) else None


def _size(n: int) -> int:
    """Returns the size of the file for an arm with n joints, [bytes]."""
    row_size = cycle_dtype(n, complete=True, playout=True).itemsize
    return 3 * PAGE + _EVENT_SLOTS * _EVENT_SIZE + whole_pages(CAPACITY * row_size)


def _read_joints(descriptor: int) -> int:
    """Returns the number of joints of the arm, from a file that has every part of a ring.

    Raises:
        UsageError: The file is another one.
        VersionMismatchError: It was made by another version of rcilab.
    """
    try:
        size, header = os.fstat(descriptor).st_size, os.pread(descriptor, _HEADER.size, 0)
    except OSError:  # Of a socket or a pipe.
        size, header = 0, b""
    magic, version, n, row_size, capacity = _HEADER.unpack(header.ljust(_HEADER.size, b"\0"))
    if magic != _MAGIC:
        raise UsageError("that is not the record of a controller")
    if version != _VERSION:
        raise VersionMismatchError("shared memory of the controller", version, _VERSION)
    is_valid = 1 <= n <= _MOST_JOINTS and capacity == CAPACITY and size == _size(n)
    if not is_valid or row_size != cycle_dtype(n, complete=True, playout=True).itemsize:
        raise UsageError("the record of the controller is damaged: its header does not belong to its size")
    return n


def _read(slot: memoryview) -> bytes:
    (length,) = _LENGTH.unpack_from(slot)
    return bytes(slot[_LENGTH.size : _LENGTH.size + length])
