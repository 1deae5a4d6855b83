"""Schedule of cycles, and handling of missed ones. The time is an argument.

The clock of a real controller never stops; this one stops when the process gets no CPU time. Such cycles are skipped
and counted. A client on the same machine has usually been stopped as well, and may resume later. Therefore, for as long
as the pause lasted, a cycle without a command is postponed and its command does not count as lost.
"""

from __future__ import annotations

from rcilab.core.clock import CYCLE_TIME

MAX_CATCH_UP = 250  # [cycles] Also after a longer pause: no client continues its stream after that.


class CycleTimer:
    """The grid that cycles are due on. Owned by the controller's loop.

    Attributes:
        deadline: When the current cycle is due, [s].
        missed: Cycles that were skipped or postponed.

    Args:
        now: The time, [s].
        period: From one cycle to the next, [s].
    """

    def __init__(self, now: float, period: float = CYCLE_TIME) -> None:
        self._period = period
        self.deadline = now
        self.missed = 0
        self._catch_up_left = 0

    def restart(self, now: float) -> None:
        """Restarts the grid, after cycles that were not on it, as in lock-step."""
        self.deadline = now

    def delay(self, now: float) -> None:
        """Moves the current cycle, and with it the grid, to a later time, [s]; an earlier one has no effect."""
        self.deadline = max(self.deadline, now)

    def next(self, now: float) -> float:
        """Returns the time at which the next cycle is due, [s], at most a cycle ago; earlier ones are skipped."""
        self.deadline += self._period
        self._catch_up_left = max(0, self._catch_up_left - 1)
        skipped = int((now - self.deadline) / self._period)
        if skipped > 0:
            self.missed += skipped
            self.deadline += skipped * self._period
            self._catch_up_left = max(self._catch_up_left, min(skipped, MAX_CATCH_UP))
        return self.deadline

    def postpones(self, is_starved: bool) -> bool:
        """Returns whether this cycle is postponed.

        Args:
            is_starved: Whether a motion is in progress whose next command has not arrived.
        """
        if not is_starved or self._catch_up_left == 0:
            return False
        self.missed += 1
        return True
