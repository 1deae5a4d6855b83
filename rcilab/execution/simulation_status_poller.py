"""Asynchronous use of a simulation port: requests are sent in a thread, which also polls the status.

with SimulationStatusPoller(SimulationControl(host, port)) as poller:
    poller.ask(Press("estop"))
    poller.status
"""

from __future__ import annotations

import threading
from collections import deque

from rcilab.core.closeable import Closeable
from rcilab.core.errors import RcilabError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.sim.api import WorldRequest, WorldStatus

PERIOD = 0.3  # [s] Of the status: as fast as a person can read it.


class SimulationStatusPoller(Closeable):
    """Uses one simulation port in a separate thread.

    Args:
        world: The simulation port; closed with this object.
    """

    def __init__(self, world: SimulationControl) -> None:
        self._world = world
        self._condition = threading.Condition()
        self._requests: deque[WorldRequest] = deque()
        self._error: RcilabError | None = None
        self._is_ending = False
        self._is_sending = False
        self.status: WorldStatus | None = None
        """The latest status; None before the first poll and without a response."""
        self._thread = threading.Thread(target=self._run, name="simulation status", daemon=True)
        self._thread.start()

    def ask(self, request: WorldRequest) -> None:
        """Queues a request and returns at once; it replaces a queued one of the same kind."""
        with self._condition:
            self._requests = deque(other for other in self._requests if _kind(other) != _kind(request))
            self._requests.append(request)
            self._condition.notify()

    @property
    def is_settled(self) -> bool:
        """Whether all requests were sent, so that the next status includes them."""
        with self._condition:
            return not self._requests and not self._is_sending

    def pop_error(self) -> RcilabError | None:
        """Returns the error of a request since the last call, or None."""
        with self._condition:
            error, self._error = self._error, None
            return error

    def close(self) -> None:
        """Sends queued requests and ends the thread. May be called twice."""
        with self._condition:
            self._is_ending = True
            self._condition.notify()
        self._thread.join(2.0)  # A controller that hangs may delay its end.

    def _run(self) -> None:
        while True:
            with self._condition:
                if not self._requests and not self._is_ending:
                    self._condition.wait(PERIOD)
                request = self._requests.popleft() if self._requests else None
                is_ending = self._is_ending and request is None
                self._is_sending = request is not None
            if is_ending:
                self._world.close()
                return
            try:
                if request is not None:
                    self._world.ask(request)
                self.status = self._world.status()
            except RcilabError as error:
                self.status = None
                with self._condition:
                    self._error = error if request is not None else self._error
            with self._condition:
                self._is_sending = False


def _kind(request: WorldRequest) -> tuple[str, object]:
    return request.name, getattr(request, "direction", None)
