"""The held jog: one small record in the shared block, which is renewed as long as the jog is held."""

from __future__ import annotations

import struct
import time
from typing import get_args

from rcilab.control_process.layout import ControlBlock, Counter
from rcilab.execution.jog import JogCommand, JogKind

HOLD_TIMEOUT = 0.3  # [s] A jog that is not renewed for this time is released; a page renews it ten times a second.

_KINDS: tuple[JogKind, ...] = get_args(JogKind)
_RECORD = struct.Struct("<qq7d")  # index of the kind, count of the numbers, the numbers
_ATTEMPTS = 3  # The writer needs a microsecond; if all fail, the reader uses the previous jog.


class HeldJog:
    """The `JogSource` of the control process: the held jog in the block.

    Args:
        block: The shared block.
    """

    def __init__(self, block: ControlBlock) -> None:
        self._block = block

    def read(self, current: JogCommand | None) -> JogCommand | None:
        """Returns the held jog; None: no jog is held.

        Args:
            current: The previous jog, returned again while another one is being written.
        """
        counters = self._block.counters
        if not is_held(counters):
            return None
        return read_jog(self._block.jog, counters) or current


def hold_jog(memory: memoryview, counters: memoryview, command: JogCommand) -> None:
    """Writes or renews the held jog."""
    write_jog(memory, counters, command)
    counters[Counter.JOG_HEARTBEAT] = time.monotonic_ns()


def release_jog(counters: memoryview) -> None:
    """Releases the jog."""
    counters[Counter.JOG_HEARTBEAT] = 0


def is_held(counters: memoryview) -> bool:
    """Returns whether a jog was written or renewed within the last `HOLD_TIMEOUT`."""
    return time.monotonic_ns() - counters[Counter.JOG_HEARTBEAT] <= HOLD_TIMEOUT * 1e9


def write_jog(memory: memoryview, counters: memoryview, command: JogCommand) -> None:
    """Writes a jog; the sequence number is odd meanwhile."""
    numbers = (*command.values, *(0.0,) * (7 - len(command.values)))
    sequence = counters[Counter.JOG] | 1
    counters[Counter.JOG] = sequence
    _RECORD.pack_into(memory, 0, _KINDS.index(command.kind), len(command.values), *numbers)
    counters[Counter.JOG] = sequence + 1


def read_jog(memory: memoryview, counters: memoryview) -> JogCommand | None:
    """Returns the complete jog, or None while it is being written."""
    for _ in range(_ATTEMPTS):
        before = counters[Counter.JOG]
        kind, count, *numbers = _RECORD.unpack_from(memory, 0)
        if before % 2 == 0 and counters[Counter.JOG] == before:
            return JogCommand(_KINDS[kind], tuple(numbers[:count]))
    return None
