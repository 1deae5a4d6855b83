"""A world port that nobody has to wait for: requests go out one after the other, its status comes in now and then.

with SimulationStatusPoller(World(host, port)) as watch:
    watch.ask(Press("estop"))
    watch.status
"""

from __future__ import annotations

import threading
from collections import deque

from rcilab.core.closeable import Closeable
from rcilab.core.errors import RcilabError
from rcilab.execution.simulation_control import SimulationControl
from rcilab.sim.api import WorldRequest, WorldStatus

PERIOD = 0.3  # [s] between two looks at the status; a choice, as fast as one reads.


class SimulationStatusPoller(Closeable):
    """Talks to one world port in a thread of its own.

    Args:
        world: The world port; closed with this object.
    """

    def __init__(self, world: SimulationControl) -> None:
        self._world = world
        self._condition = threading.Condition()
        self._requests: deque[WorldRequest] = deque()
        self._error: RcilabError | None = None
        self._is_ending = False
        self._is_asking = False
        self.status: WorldStatus | None = None
        """How the controller was at the last look; None before the first, and when it does not answer."""
        self._thread = threading.Thread(target=self._run, name="world watch", daemon=True)
        self._thread.start()

    def ask(self, request: WorldRequest) -> None:
        """Sends a request and returns at once; it replaces one of its kind that is still waiting to go out."""
        with self._condition:
            self._requests = deque(other for other in self._requests if _kind(other) != _kind(request))
            self._requests.append(request)
            self._condition.notify()

    @property
    def is_settled(self) -> bool:
        """Whether every request has gone out; a status that is read after this counts them."""
        with self._condition:
            return not self._requests and not self._is_asking

    def take_error(self) -> RcilabError | None:
        """Returns why a request was not carried out, since the last call; None: nothing went wrong."""
        with self._condition:
            error, self._error = self._error, None
            return error

    def close(self) -> None:
        """Sends what is waiting and ends the thread. May be called twice."""
        with self._condition:
            self._is_ending = True
            self._condition.notify()
        self._thread.join(2.0)  # It may be waiting for a controller that hangs: then it ends after that.

    def _run(self) -> None:
        while True:
            with self._condition:
                if not self._requests and not self._is_ending:
                    self._condition.wait(PERIOD)
                request = self._requests.popleft() if self._requests else None
                is_ending = self._is_ending and request is None
                self._is_asking = request is not None
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
                self._is_asking = False


def _kind(request: WorldRequest) -> tuple[str, object]:
    return request.name, getattr(request, "direction", None)
