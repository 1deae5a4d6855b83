"""Lines for a person, from a loop that must never wait: a thread of their own writes them, as long as they are read."""

from __future__ import annotations

import logging
import os
import threading
from collections import deque
from collections.abc import Callable

_MOST = 200  # Lines that wait; a tuning value: what a stream takes at once, and a person reads.
_SELDOM = 10.0  # [s] A line that anybody can cause is written once in this time, and then counted; a tuning value.
_GRACE = 0.5  # [s] For the last lines, when the controller ends and they are not read.


class LineHandler(logging.Handler):
    """Hands what the controller's own parts log to a writer of lines, instead of to a stream.

    Args:
        write: Takes a line and never waits.
    """

    def __init__(self, write: Callable[[str], None]) -> None:
        super().__init__()
        self._write = write

    def emit(self, record: logging.LogRecord) -> None:
        """Takes one entry."""
        self._write(record.getMessage())


class SeldomLines:
    """Writes lines that anybody who connects can cause: one of a kind in a while, which says how many came between.

    Args:
        write: Takes a line and never waits.
        clock: Returns the time, [s].
    """

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float]) -> None:
        self._write, self._clock = write, clock
        self._next: dict[str, float] = {}  # Kind -> when it is written again, [s].
        self._counted: dict[str, int] = {}

    def write(self, kind: str, line: str, more: str) -> None:
        """Writes a line, or counts it.

        Args:
            kind: One of a few names: lines of a kind are counted together.
            line: What to write.
            more: What happened to those that were counted, such as "were refused".
        """
        now = self._clock()
        if now < self._next.get(kind, now):
            self._counted[kind] = self._counted.get(kind, 0) + 1
            return
        self._next[kind] = now + _SELDOM
        count = self._counted.pop(kind, 0)
        self._write(f"{line} ({count} more {more} since the last line)" if count else line)


class LogLines:
    """Writes lines to a descriptor. `write` may be called from one thread, and never waits.

    Args:
        descriptor: Where to, such as 2. It is written to directly: a stream's own lock would hold up the interpreter's
            end for as long as they are not read.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._lines: deque[str] = deque()
        self._left_out = 0
        self._wake, self._is_ending = threading.Event(), False
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    def write(self, line: str) -> None:
        """Has a line written; where too many wait already it is left out, and a later one says how many were."""
        if len(self._lines) >= _MOST:
            self._left_out += 1
            return
        if self._left_out:
            self._lines.append(f"{self._left_out} lines were left out: the stream was not read")
            self._left_out = 0
        self._lines.append(line)
        self._wake.set()

    def close(self) -> None:
        """Waits a moment for the last lines to be written. May be called twice."""
        self._is_ending = True
        self._wake.set()
        self._thread.join(_GRACE)

    def _run(self) -> None:
        while True:
            self._wake.wait()
            self._wake.clear()
            while self._lines:
                data = f"rcilab controller: {self._lines.popleft()}\n".encode(errors="replace")
                try:
                    while data:
                        data = data[os.write(self._descriptor, data) :]
                except OSError:  # The reader is gone.
                    return
            if self._is_ending:
                return
