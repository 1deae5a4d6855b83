"""Schedule of simulated stalls of the controller's clock. The time is an argument."""

from __future__ import annotations

from collections.abc import Iterable

from rcilab.sim.api import Stall


class StallSchedule:
    """The pending stalls. Owned by the thread that runs the controller.

    Attributes:
        count: Number of stalls so far.

    Args:
        stalls: The requested stalls.
        now: Start of their `after`, [s].
    """

    def __init__(self, stalls: Iterable[Stall] = (), now: float = 0.0) -> None:
        self.count = 0
        self._pending: list[tuple[float, Stall]] = []
        self.replace(stalls, now)

    def replace(self, stalls: Iterable[Stall], now: float) -> None:
        """Replaces the pending stalls; `now`, [s], is the start of their `after`."""
        self._pending = sorted(((now + stall.after, stall) for stall in stalls), key=_first)

    def pop(self, now: float) -> float:
        """Returns the duration of a stall that is due `now`, [s]; 0 without one."""
        if not self._pending or now < self._pending[0][0]:
            return 0.0
        due, stall = self._pending.pop(0)
        if stall.period is not None:
            # Stalls that were due during another one are skipped.
            due = max(due + stall.period, now + stall.duration)
            self._pending = sorted([*self._pending, (due, stall)], key=_first)
        self.count += 1
        return stall.duration


def _first(entry: tuple[float, Stall]) -> float:
    return entry[0]
