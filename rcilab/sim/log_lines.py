"""Log lines from a loop that must not block: a separate thread writes them."""

from __future__ import annotations

import logging
import os
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

_MAX_QUEUED = 200  # [lines] A tuning value.
_PERIOD = 10.0  # [s] For which lines of a kind that any peer can cause are counted together. A tuning value.
_CLOSE_TIMEOUT = 0.5  # [s] For the last lines at the end of the controller, if they are not read.


class LineHandler(logging.Handler):
    """Passes the log records of the simulation to a writer of lines.

    Args:
        write: Writes a line; does not block.
    """

    def __init__(self, write: Callable[[str], None]) -> None:
        super().__init__()
        self._write = write

    def emit(self, record: logging.LogRecord) -> None:
        """Writes one record."""
        self._write(record.getMessage())


@dataclass(slots=True)
class _Kind:
    """Lines of a kind in the current period."""

    end: float  # [s]
    more: str
    written: int = 0
    counted: int = 0


class RateLimitedLog:
    """Limits the rate of lines that any peer can cause: some of a kind per period, then the number of skipped ones.

    Args:
        write: Writes a line; does not block.
        clock: Returns the time, [s].
    """

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float]) -> None:
        self._write, self._clock = write, clock
        self._kinds: dict[str, _Kind] = {}

    def write(self, kind: str, line: str, more: str, most: int = 1) -> None:
        """Writes a line, or counts it.

        Args:
            kind: Kind of line, one of a few; lines of a kind are counted together.
            line: The line.
            more: Text for the counted ones, such as "were refused".
            most: Number of lines of this kind that are written per period.
        """
        self.write_counts()
        seen = self._kinds.setdefault(kind, _Kind(self._clock() + _PERIOD, more))
        if seen.written < most:
            seen.written += 1
            self._write(line)
        else:
            seen.counted += 1

    def write_counts(self) -> None:
        """Writes how many lines were skipped in each period that is over. Call it periodically."""
        if not self._kinds:
            return
        now = self._clock()
        for kind, seen in list(self._kinds.items()):
            if now >= seen.end:
                del self._kinds[kind]
                if seen.counted:
                    self._write(f"{seen.counted} more {seen.more} within {_PERIOD:g} s")


class LogLines:
    """Writes lines to a descriptor. `write` may be called from one thread, and does not block.

    Args:
        descriptor: Descriptor, such as 2. It is used directly: the lock of a stream would delay the end of the
            interpreter while its reader is blocked.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._lines: deque[str] = deque()
        self._skipped = 0
        self._wake, self._is_ending = threading.Event(), False
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    def write(self, line: str) -> None:
        """Queues a line; a full queue skips it, and a later line reports the number of skipped lines."""
        if len(self._lines) >= _MAX_QUEUED:
            self._skipped += 1
            return
        if self._skipped:
            self._lines.append(f"{self._skipped} lines were dropped: the stream was not read")
            self._skipped = 0
        self._lines.append(line)
        self._wake.set()

    def close(self) -> None:
        """Waits briefly until the last lines are written. May be called twice."""
        self._is_ending = True
        self._wake.set()
        self._thread.join(_CLOSE_TIMEOUT)

    def _run(self) -> None:
        while True:
            self._wake.wait()
            self._wake.clear()
            while self._lines:
                data = f"rcilab controller: {self._lines.popleft()}\n".encode(errors="replace")
                try:
                    while data:
                        data = data[os.write(self._descriptor, data) :]
                except OSError:  # The reader has closed it.
                    return
            if self._is_ending:
                return
