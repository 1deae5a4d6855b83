"""Clocks: the system's monotonic clock, and one that a test advances."""

from __future__ import annotations

import time
from typing import Protocol

CYCLE_TIME = 0.001  # [s] RCI manual 3.3: the control period is 1 ms.


class Clock(Protocol):
    """A monotonic clock with a sleep."""

    def now(self) -> float:
        """Returns the time, [s], from an arbitrary origin."""
        ...

    def sleep_until(self, deadline: float) -> None:
        """Sleeps until `now()` reaches `deadline`; returns at once when it has passed."""
        ...


class SystemClock:
    """The monotonic clock of this machine."""

    def now(self) -> float:
        """Returns the monotonic time, [s]."""
        return time.monotonic()

    def sleep_until(self, deadline: float) -> None:
        """Sleeps until `deadline`, [s]."""
        remaining = deadline - time.monotonic()
        if remaining > 0.0:
            time.sleep(remaining)
