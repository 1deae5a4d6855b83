"""Letters from one process to another: small JSON objects in a ring of slots, one writer and one reader."""

from __future__ import annotations

import json
import struct
from typing import Any

from rcilab.control_process.layout import MAIL_SIZE, MAIL_SLOTS, Counter
from rcilab.core.errors import UsageError

_LENGTH = struct.Struct("<I")


class MessageRing:
    """One direction of mail. `post` belongs to one side, `take` to the other.

    Args:
        slots: Memory of the letters.
        words: The block's counters.
        posted: Which counter the writer counts up.
        taken: Which counter the reader counts up.
    """

    def __init__(self, slots: memoryview, words: memoryview, posted: Counter, taken: Counter) -> None:
        self._slots = slots
        self._words = words
        self._posted = posted
        self._taken = taken

    @property
    def waiting(self) -> bool:
        """Whether a letter is there; cheap enough for every cycle."""
        return self._words[self._posted] != self._words[self._taken]

    def post(self, letter: dict[str, Any]) -> None:
        """Puts a letter in.

        Raises:
            UsageError: The box is full, because nobody takes letters out, or the letter is too long.
        """
        text = json.dumps(letter).encode()
        if len(text) > MAIL_SIZE - _LENGTH.size:
            raise UsageError(f"a letter of {len(text)} bytes does not fit: {MAIL_SIZE - _LENGTH.size} do")
        posted = self._words[self._posted]
        if posted - self._words[self._taken] >= MAIL_SLOTS:
            raise UsageError(
                f"{MAIL_SLOTS} requests are waiting already; the control process does not keep up, restart it"
            ).coded("too_many")
        start = posted % MAIL_SLOTS * MAIL_SIZE
        self._slots[start + _LENGTH.size : start + _LENGTH.size + len(text)] = text
        _LENGTH.pack_into(self._slots, start, len(text))
        self._words[self._posted] = posted + 1  # Last: this is what the reader looks at.

    def take(self) -> dict[str, Any] | None:
        """Returns the oldest letter, or None."""
        if not self.waiting:
            return None
        taken = self._words[self._taken]
        start = taken % MAIL_SLOTS * MAIL_SIZE
        (length,) = _LENGTH.unpack_from(self._slots, start)
        letter = json.loads(bytes(self._slots[start + _LENGTH.size : start + _LENGTH.size + length]))
        self._words[self._taken] = taken + 1
        return letter
