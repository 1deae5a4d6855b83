"""The private arm of the fault lab, kept for the next provocation."""

from __future__ import annotations

import threading

from rcilab.app.fault_lab.fault_demo import FaultDemo
from rcilab.app.fault_lab.lab import FaultLab
from rcilab.core.background_job import ProgressCallback
from rcilab.core.fault import FaultCode

IDLE_TIME = 60.0  # [s] A tuning value: starting a controller takes two seconds, keeping one 8 % of a core.


class PrivateArm:
    """A controller that is kept from one fault to the next and ends when it is idle. Threads use it in turn.

    Args:
        idle_time: Maximum wait for the next fault, [s]; a later one gets a new controller.
    """

    def __init__(self, idle_time: float = IDLE_TIME) -> None:
        self._idle_time = idle_time
        self._lab: FaultLab | None = None
        self._lock = threading.Lock()  # Held by the thread that uses the lab.
        self._timer: threading.Timer | None = None

    def provoke(self, fault: FaultCode, model: str, progress: ProgressCallback) -> FaultDemo:
        """Returns the provoked fault; a cancelled provocation leaves the arm at standstill."""
        with self._lock:
            progress(0.0)
            if self._lab is None or self._lab.model.name != model:
                self._drop()
                self._lab = FaultLab(model)
            try:
                return self._lab.provoke(fault, progress)
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
