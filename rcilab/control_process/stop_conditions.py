"""Whether those who set the arm in motion still want it to move, as the control process sees it in every cycle."""

from __future__ import annotations

import os
import time

from rcilab.control_process.layout import OPERATOR_TIMEOUT, Counter


class StopConditions:
    """Looks at stops that were asked for, at the operator's and the supervisor's signs of life.

    Args:
        counters: The counters of the shared block.
        parent: Process id of the fork server, which ends with the supervisor; it may be gone before the first poll.
    """

    def __init__(self, counters: memoryview, parent: int) -> None:
        self._counters, self._parent = counters, parent
        self._stops_seen = counters[Counter.STOPS_ASKED]
        self._is_dismissed = False

    def dismiss(self) -> None:
        """Has everything end as if the supervisor were gone."""
        self._is_dismissed = True

    @property
    def is_orphan(self) -> bool:
        """Whether the supervisor's process is gone, or has no parent that waits for it."""
        return self._is_dismissed or os.getppid() != self._parent

    @property
    def is_operator_gone(self) -> bool:
        """Whether an operator was present once and is not any more."""
        beat = self._counters[Counter.OPERATOR_BEAT]
        if beat == 0:
            return False
        # A supervisor that hangs cannot report an operator: that counts as absent.
        oldest = min(beat, self._counters[Counter.SUPERVISOR_BEAT])
        return time.monotonic_ns() - oldest > OPERATOR_TIMEOUT * 1e9

    def reason_to_stop(self) -> str | None:
        """Returns the code of the message for why a motion is to end, or None."""
        if self._counters[Counter.STOPS_ASKED] != self._stops_seen:
            return "idle.stopped"
        if self.is_operator_gone:
            return "idle.operator"
        return "idle.stopped" if self.is_orphan else None

    def see_stop(self, number: int) -> None:
        """Counts all stops up to this one as done."""
        self._stops_seen = number
