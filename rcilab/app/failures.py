"""Failures of our own code: all are counted, and at most one a second is printed."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Callable

_PAUSE = 1.0  # [s] A tuning value: a loop that fails at the display's rate must not fill the disk.
_MOST = 100  # A tuning value: the first failures matter most.


class Failures(list[BaseException]):
    """The first failures, for tests. Written by one thread.

    Args:
        clock: Returns the time, [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._printed = float("-inf")

    def report(self, error: Exception) -> bool:
        """Keeps a failure; returns whether it was printed, too: not within a second after another one."""
        if len(self) < _MOST:
            self.append(error)
        now = self._clock()
        if now - self._printed < _PAUSE:
            return False
        self._printed = now
        traceback.print_exception(error, file=sys.stderr)
        return True
