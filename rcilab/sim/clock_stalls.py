"""When the controller's clock has to stall. It reads no clock: the time is an argument."""

from __future__ import annotations

from collections.abc import Iterable

from rcilab.sim.api import Stall


class StallSchedule:
    """The pauses that are still to come. Owned by the thread that runs the controller.

    Attributes:
        count: Pauses so far.

    Args:
        stalls: What is asked for.
        now: The time that their `after` counts from, [s].
    """

    def __init__(self, stalls: Iterable[Stall] = (), now: float = 0.0) -> None:
        self.count = 0
        self._coming: list[tuple[float, Stall]] = []
        self.replace(stalls, now)

    def replace(self, stalls: Iterable[Stall], now: float) -> None:
        """Forgets the pauses that were to come, and takes others; `now`, [s], is what their `after` counts from."""
        self._coming = sorted(((now + stall.after, stall) for stall in stalls), key=_first)

    def take(self, now: float) -> float:
        """Returns how long to stand still from `now` on, [s]; 0 nearly always."""
        if not self._coming or now < self._coming[0][0]:
            return 0.0
        due, stall = self._coming.pop(0)
        if stall.period is not None:
            # Not more often than it fits: what was due while another pause lasted is left out.
            due = max(due + stall.period, now + stall.duration)
            self._coming = sorted([*self._coming, (due, stall)], key=_first)
        self.count += 1
        return stall.duration


def _first(entry: tuple[float, Stall]) -> float:
    return entry[0]
