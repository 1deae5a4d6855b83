"""A clock that stands still until a test advances it."""

from __future__ import annotations


class ManualClock:
    """A `Clock` that advances only in `advance` and `sleep_until`."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Returns its current time, [s]."""
        return self._now

    def advance(self, duration: float) -> None:
        """Advances the clock by `duration`, [s]."""
        self._now += duration

    def sleep_until(self, deadline: float) -> None:
        """Sets the clock to `deadline`, [s], unless that has passed."""
        self._now = max(self._now, deadline)
