"""When cycles are due, and what becomes of those that this process was not there for. Told the time, it knows none.

A real controller's clock never stops; ours does whenever the machine gives us no core. Such cycles are left out and
counted. What stopped us has mostly stopped a client on the same machine as well, and it may come back later than we do:
it cannot be blamed for that. So for as long as we stood still ourselves, a cycle whose command is not there is put off,
which is no lost command; after that it is one.
"""

from __future__ import annotations

from rcilab.core.clock import CYCLE_TIME

LONGEST_PATIENCE = 250  # [cycles] However long we stood still; a choice: nobody streams commands through more.


class CycleTimer:
    """The grid of milliseconds that cycles are due on. Owned by the controller's loop.

    Attributes:
        deadline: When the current cycle is due, [s].
        missed: Cycles that were left out or put off.

    Args:
        now: The time, [s].
    """

    def __init__(self, now: float) -> None:
        self.deadline = now
        self.missed = 0
        self._patience = 0

    def restart(self, now: float) -> None:
        """Begins the grid anew: before, cycles were lived through one by one as in lock-step."""
        self.deadline = now

    def next(self, now: float) -> float:
        """Returns when the next cycle is due, [s], at most a cycle ago; those before it are left out."""
        self.deadline += CYCLE_TIME
        self._patience = max(0, self._patience - 1)
        skipped = int((now - self.deadline) / CYCLE_TIME)
        if skipped > 0:
            self.missed += skipped
            self.deadline += skipped * CYCLE_TIME
            self._patience = max(self._patience, min(skipped, LONGEST_PATIENCE))
        return self.deadline

    def puts_off(self, is_starved: bool) -> bool:
        """Returns whether this cycle is not lived through yet.

        Args:
            is_starved: Whether a motion runs whose next command is not there.
        """
        if not is_starved or self._patience == 0:
            return False
        self.missed += 1
        return True
