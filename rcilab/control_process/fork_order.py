"""What the fork server is told and what it tells.

An order is one byte, sent together with open files: `FIRST_FILES`, then those of the order. Through its channel come
two `TOLD` messages: the copy's process id, with a handle of the process, and when it has ended its exit code, or the
negative number of the signal that ended it. Where there could be no copy only the second one comes.
"""

from __future__ import annotations

import json
import struct
from dataclasses import asdict, dataclass

TOLD = struct.Struct("<i")
FIRST_FILES = ("order", "channel", "stdout", "stderr")
MOST_FILES = len(FIRST_FILES) + 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What a copy of the fork server is to become."""

    module: str
    """Its `main(arguments)` is called and returns the exit code."""
    arguments: tuple[str, ...]
    environment: dict[str, str]
    folder: str | None
    """Where it works; None: where the fork server does."""
    descriptors: tuple[int, ...]
    """The numbers by which it knows the files that it is handed."""

    def pack(self) -> bytes:
        """Returns the order as it is sent: JSON, which also keeps names that are no UTF-8."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def unpack(cls, packed: bytes) -> Order:
        """Returns the order that was sent."""
        fields = json.loads(packed)
        lists = {name: tuple(fields[name]) for name in ("arguments", "descriptors")}
        return cls(**{**fields, **lists})
