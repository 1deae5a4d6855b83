"""Messages from one process to another: pickled objects in a ring of slots, one writer and one reader."""

from __future__ import annotations

import pickle
import struct
from typing import Generic, TypeVar

from rcilab.control_process.layout import MESSAGE_SIZE, MESSAGE_SLOTS, Counter
from rcilab.core.errors import UsageError

_LENGTH = struct.Struct("<I")
_Message = TypeVar("_Message")


class MessageRing(Generic[_Message]):
    """One direction of messages. `post` belongs to one side, `take` to the other.

    Args:
        slots: Memory of the messages.
        counters: The block's counters.
        posted: Which counter the writer increments.
        taken: Which counter the reader increments.
    """

    def __init__(self, slots: memoryview, counters: memoryview, posted: Counter, taken: Counter) -> None:
        self._slots = slots
        self._counters = counters
        self._posted = posted
        self._taken = taken

    @property
    def has_message(self) -> bool:
        """Whether a message waits; cheap enough for every cycle."""
        return self._counters[self._posted] != self._counters[self._taken]

    def post(self, message: _Message) -> None:
        """Appends a message.

        Raises:
            UsageError: The ring is full, because the reader takes no messages, or the message is too long.
        """
        data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        if len(data) > MESSAGE_SIZE - _LENGTH.size:
            raise UsageError(f"a message of {len(data)} bytes does not fit: {MESSAGE_SIZE - _LENGTH.size} do")
        posted = self._counters[self._posted]
        if posted - self._counters[self._taken] >= MESSAGE_SLOTS:
            raise UsageError(
                f"{MESSAGE_SLOTS} requests are waiting already; the control process does not keep up, restart it"
            ).coded("too_many")
        start = posted % MESSAGE_SLOTS * MESSAGE_SIZE
        self._slots[start + _LENGTH.size : start + _LENGTH.size + len(data)] = data
        _LENGTH.pack_into(self._slots, start, len(data))
        self._counters[self._posted] = posted + 1  # Last: this is what the reader looks at.

    def take(self) -> _Message | None:
        """Returns the oldest message, or None."""
        if not self.has_message:
            return None
        taken = self._counters[self._taken]
        start = taken % MESSAGE_SLOTS * MESSAGE_SIZE
        (length,) = _LENGTH.unpack_from(self._slots, start)
        data = self._slots[start + _LENGTH.size : start + _LENGTH.size + min(length, MESSAGE_SIZE - _LENGTH.size)]
        self._counters[self._taken] = taken + 1
        return pickle.loads(data)
