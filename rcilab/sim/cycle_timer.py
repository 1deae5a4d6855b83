"""When cycles are due, and what becomes of those that this process missed. It reads no clock: the time is an argument.

A real controller's clock never stops; this one does whenever the machine gives the process no core. Such cycles are
left out and counted. What stopped the controller has mostly stopped a client on the same machine as well, which may
resume later. So for as long as the pause lasted, a cycle without a command is put off and its command does not count as
lost; after that it does.
"""

from __future__ import annotations

from rcilab.core.clock import CYCLE_TIME

LONGEST_PATIENCE = 250  # [cycles] However long the pause was: no client streams commands through more.


class CycleTimer:
    """The grid that cycles are due on. Owned by the controller's loop.

    Attributes:
        deadline: When the current cycle is due, [s].
        missed: Cycles that were left out or put off.

    Args:
        now: The time, [s].
        period: From one cycle to the next, [s].
    """

    def __init__(self, now: float, period: float = CYCLE_TIME) -> None:
        self._period = period
        self.deadline = now
        self.missed = 0
        self._patience = 0

    def restart(self, now: float) -> None:
        """Restarts the grid, after cycles that were not on it, as in lock-step."""
        self.deadline = now

    def next(self, now: float) -> float:
        """Returns when the next cycle is due, [s], at most a cycle ago; those before it are left out."""
        self.deadline += self._period
        self._patience = max(0, self._patience - 1)
        skipped = int((now - self.deadline) / self._period)
        if skipped > 0:
            self.missed += skipped
            self.deadline += skipped * self._period
            self._patience = max(self._patience, min(skipped, LONGEST_PATIENCE))
        return self.deadline

    def puts_off(self, is_starved: bool) -> bool:
        """Returns whether this cycle is put off.

        Args:
            is_starved: Whether a motion runs whose next command is not there.
        """
        if not is_starved or self._patience == 0:
            return False
        self.missed += 1
        return True
