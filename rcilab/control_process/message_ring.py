"""Messages between two processes: pickled objects in a ring of slots, with one writer and one reader."""

from __future__ import annotations

import pickle
import struct
from typing import Generic, TypeVar

from rcilab.control_process.layout import MESSAGE_SIZE, MESSAGE_SLOTS, Counter
from rcilab.core.errors import UsageError

_LENGTH = struct.Struct("<I")
_Message = TypeVar("_Message")


class MessageRing(Generic[_Message]):
    """One direction of messages: one process calls `post`, the other `pop`.

    Args:
        slots: Memory of the messages.
        counters: The block's counters.
        posted: The counter of the writer.
        read: The counter of the reader.
    """

    def __init__(self, slots: memoryview, counters: memoryview, posted: Counter, read: Counter) -> None:
        self._slots = slots
        self._counters = counters
        self._posted = posted
        self._read = read

    @property
    def has_message(self) -> bool:
        """Whether there is an unread message; cheap enough for every cycle."""
        return self._counters[self._posted] != self._counters[self._read]

    def post(self, message: _Message) -> None:
        """Appends a message.

        Raises:
            UsageError: The ring is full, because the reader does not read it, or the message is too long.
        """
        data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        if len(data) > MESSAGE_SIZE - _LENGTH.size:
            raise UsageError(f"a message of {len(data)} bytes is too long: at most {MESSAGE_SIZE - _LENGTH.size} fit")
        posted = self._counters[self._posted]
        if posted - self._counters[self._read] >= MESSAGE_SLOTS:
            raise UsageError(
                f"{MESSAGE_SLOTS} requests are queued already; the control process is too slow, restart it"
            ).coded("too_many")
        start = posted % MESSAGE_SLOTS * MESSAGE_SIZE
        self._slots[start + _LENGTH.size : start + _LENGTH.size + len(data)] = data
        _LENGTH.pack_into(self._slots, start, len(data))
        self._counters[self._posted] = posted + 1  # Last: the reader polls this counter.

    def pop(self) -> _Message | None:
        """Returns the oldest message, or None."""
        if not self.has_message:
            return None
        read = self._counters[self._read]
        start = read % MESSAGE_SLOTS * MESSAGE_SIZE
        (length,) = _LENGTH.unpack_from(self._slots, start)
        data = self._slots[start + _LENGTH.size : start + _LENGTH.size + min(length, MESSAGE_SIZE - _LENGTH.size)]
        self._counters[self._read] = read + 1
        return pickle.loads(data)
