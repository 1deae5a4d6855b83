"""The arm that faults are provoked on: one of the gallery's own, kept for the next provocation."""

from __future__ import annotations

import threading

from rcilab.app.fault_lab.fault_demo import FaultDemo
from rcilab.app.fault_lab.lab import FaultLab
from rcilab.core.background_job import ProgressCallback
from rcilab.core.fault import FaultCode

IDLE_TIME = 60.0  # [s] A tuning value: starting a controller takes two seconds, keeping one 8 % of a core.


class PrivateArm:
    """A controller that stays from one fault to the next and ends when it is idle. Threads that provoke take turns.

    Args:
        idle_time: How long it waits for the next fault, [s]; a later one gets a fresh controller.
    """

    def __init__(self, idle_time: float = IDLE_TIME) -> None:
        self._idle_time = idle_time
        self._lab: FaultLab | None = None
        self._lock = threading.Lock()  # Held by the thread that uses the lab.
        self._timer: threading.Timer | None = None

    def provoke(self, fault: FaultCode, model: str, tell: ProgressCallback) -> FaultDemo:
        """Returns what came of provoking a fault; who gives up meanwhile leaves the arm at rest."""
        with self._lock:
            tell(0.0)
            if self._lab is None or self._lab.model.name != model:
                self._drop()
                self._lab = FaultLab(model)
            try:
                return self._lab.provoke(fault, tell)
            finally:
                self._start_timer()

    def close(self) -> None:
        """Ends the controller, once no thread uses it."""
        with self._lock:
            self._drop()

    def _start_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        timer = self._timer = threading.Timer(self._idle_time, lambda: self._expire(timer))
        timer.daemon = True
        timer.start()

    def _expire(self, timer: threading.Timer) -> None:
        with self._lock:
            if timer is self._timer:  # Else the controller was used while this one waited for the lock.
                self._drop()

    def _drop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._lab is not None:
            self._lab.close()
            self._lab = None
