"""Conditions that end a motion, evaluated by the control process in every cycle."""

from __future__ import annotations

import os
import time

from rcilab.control_process.layout import OPERATOR_TIMEOUT, Counter


class StopConditions:
    """Evaluates requested stops and the heartbeats of operator and supervisor.

    Args:
        counters: The counters of the shared block.
        parent: Process id of the fork server, which ends with the supervisor, possibly before the first check.
    """

    def __init__(self, counters: memoryview, parent: int) -> None:
        self._counters, self._parent = counters, parent
        self._acknowledged_stops = counters[Counter.STOPS_REQUESTED]
        self._is_exit_requested = False

    def request_exit(self) -> None:
        """Ends the motion and the process as after the end of the supervisor."""
        self._is_exit_requested = True

    @property
    def is_orphan(self) -> bool:
        """Whether the supervisor has ended, or an exit was requested."""
        return self._is_exit_requested or os.getppid() != self._parent

    @property
    def is_operator_gone(self) -> bool:
        """Whether an operator was present and no longer is."""
        heartbeat = self._counters[Counter.OPERATOR_HEARTBEAT]
        if heartbeat == 0:
            return False
        # A supervisor that hangs cannot report an operator, who then counts as absent.
        oldest = min(heartbeat, self._counters[Counter.SUPERVISOR_HEARTBEAT])
        return time.monotonic_ns() - oldest > OPERATOR_TIMEOUT * 1e9

    def reason_to_stop(self) -> str | None:
        """Returns the reason to end a motion as a code of `MESSAGES`, or None."""
        if self._counters[Counter.STOPS_REQUESTED] != self._acknowledged_stops:
            return "idle.stopped"
        if self.is_operator_gone:
            return "idle.operator"
        return "idle.stopped" if self.is_orphan else None

    def acknowledge_stops(self, count: int) -> None:
        """Marks this number of requested stops as done."""
        self._acknowledged_stops = count
