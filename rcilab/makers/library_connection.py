"""A connection through a maker's client library: its states, and requests whose answers the library waits for."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any, Generic, Protocol, TypeVar

from rcilab.core.state import RobotState

Answer = TypeVar("Answer")
Report = TypeVar("Report")
_ReceivedReport = TypeVar("_ReceivedReport", covariant=True)

_WAIT = 0.02  # [s] Between two looks at what is waited for.


class ReportSource(Protocol[_ReceivedReport]):
    """The reports of a controller."""

    received_ns: int
    """When the newest one arrived, monotonic, [ns]."""

    def poll(self, timeout: float) -> Sequence[_ReceivedReport]:
        """Returns every report that has arrived, oldest first; waits up to a timeout, [s], for the first."""
        ...

    def close(self) -> None:
        """Ends it. May be called twice."""
        ...


class LibraryConnection(ABC, Generic[Report]):
    """A connected controller. Owned by one thread.

    Attributes:
        name: Name of the controller in errors.
        n: Number of joints.
        on_states: Called with the states that arrive while something else is awaited.
        received_ns: When the newest state arrived, monotonic, [ns].
        latest: The newest state.
        is_streaming: Whether targets are being sent: of the states that arrive meanwhile only the newest is used,
            because the controller follows the newest target only.

    Args:
        name: As the attribute.
        n: As the attribute.
        reports: The reports of which states are made.
    """

    def __init__(self, name: str, n: int, reports: ReportSource[Report]) -> None:
        self.name, self.n = name, n
        self.on_states: Callable[[list[RobotState]], None] = lambda states: None
        self.received_ns = self._empty_ns = self._latest_since_ns = time.monotonic_ns()
        self.latest: RobotState | None = None
        self.is_streaming = False
        self._reports = reports
        self._asker = ThreadPoolExecutor(1, "requests")

    @property
    def age(self) -> float:
        """Upper bound of the newest state's age: since the buffer was last empty before it arrived, [s]."""
        return (time.monotonic_ns() - self._latest_since_ns) * 1e-9

    def poll(self, timeout: float) -> list[RobotState]:
        """Returns every state that has arrived, oldest first; waits up to a timeout, [s], for the first.

        Raises:
            ConnectionLostError: The controller has closed the connection.
        """
        reports = self._reports.poll(0.0)
        if not reports:
            self._empty_ns = time.monotonic_ns()
            reports = self._reports.poll(timeout) if timeout > 0.0 else ()
            if not reports:
                return []
        self._latest_since_ns = self._empty_ns
        self.received_ns = self._empty_ns = self._reports.received_ns
        states = [self._read(report) for report in (reports[-1:] if self.is_streaming else reports)]
        self.latest = states[-1]
        return states

    def wait(self, is_over: Callable[[], bool], timeout: float) -> bool:
        """Receives states until something is over; returns whether it was within a timeout, [s]."""
        deadline = time.monotonic() + timeout
        while not is_over():
            if time.monotonic() > deadline:
                return False
            self.on_states(self.poll(_WAIT))
        return True

    def ask(self, call: Callable[..., Answer], *arguments: Any, **options: Any) -> Answer:
        """Returns the result of a call of the library; receives states meanwhile.

        Args:
            call: The call.
            arguments: Its arguments.
            options: Its keyword arguments.

        Raises:
            ConnectionLostError: The connection is lost.
            CommandRejectedError: The controller refuses.
        """
        answer = self._asker.submit(call, *arguments, **options)
        while not wait([answer], _WAIT).done:
            self.on_states(self.poll(0.0))
        return answer.result()

    def post(self, call: Callable[..., Any], *arguments: Any, **options: Any) -> PostedCall:
        """Calls the library in its own thread, and never waits."""
        return PostedCall(self._asker.submit(call, *arguments, **options))

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        self._reports.close()
        self._asker.shutdown(wait=False)

    @abstractmethod
    def _read(self, report: Report) -> RobotState: ...


class PostedCall:
    """A call of the library for a digital signal, a `SignalRequest`.

    Args:
        answer: Its result.
    """

    def __init__(self, answer: Future[Any], read: Callable[[Any], bool] = lambda answer: True) -> None:
        self._answer, self._read = answer, read

    def reading(self, read: Callable[[Any], bool]) -> PostedCall:
        """Returns the same call, with the level that a function finds in the answer."""
        return PostedCall(self._answer, read)

    def poll(self) -> bool | None:
        """Returns the level, or None until the answer; never waits."""
        return self._read(self._answer.result()) if self._answer.done() else None


class LibraryDriver(Generic[Report]):
    """What drivers over a maker's client library take from their connection; see `Driver`.

    Args:
        connection: The connection.
        arm_name: Name of the arm at the other end.
        simulation_address: Simulation port of a virtual controller; None: not known, or a real robot.
    """

    def __init__(
        self, connection: LibraryConnection[Report], arm_name: str, simulation_address: tuple[str, int] | None
    ) -> None:
        self.name, self.n = connection.name, connection.n
        self.arm_name = arm_name
        self.simulation_address = simulation_address
        self.poll = connection.poll
        self._states = connection

    @property
    def latest(self) -> RobotState | None:
        """The newest state."""
        return self._states.latest

    @property
    def received_ns(self) -> int:
        """When it arrived, monotonic, [ns]."""
        return self._states.received_ns

    @property
    def age(self) -> float:
        """Upper bound of its age, [s]."""
        return self._states.age

    @property
    def on_states(self) -> Callable[[list[RobotState]], None]:
        """Called with the states that arrive while something else is awaited."""
        return self._states.on_states

    @on_states.setter
    def on_states(self, listener: Callable[[list[RobotState]], None]) -> None:
        self._states.on_states = listener
