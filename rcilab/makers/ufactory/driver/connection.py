"""A connection to a controller: its client library for requests, and its reports in real time as states.

The reports show that the arm is stopped, but not by which error: that is asked for when it stops, and then follows the
slow reports of the client library.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from typing import Any, NamedTuple, TypeVar

from rcilab.core.fault import FaultCode
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.core.state import RobotMode, RobotState
from rcilab.makers.ufactory.driver.client import XArmClient, faults_of
from rcilab.makers.ufactory.driver.report_receiver import ReportReceiver
from rcilab.makers.ufactory.driver.state_reader import STOPPED, StateReader, shown_by
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.wire.poses import pose_from_mm_rpy

Answer = TypeVar("Answer")

_BUTTONS = (
    UfactoryError.EMERGENCY_STOP_BUTTON,
    UfactoryError.EMERGENCY_STOP_INPUT,
    UfactoryError.EMERGENCY_STOP_SWITCH,
)
_UNDERWAY_NS = 50_000_000  # For a slow report that was sent before an error was read.
_SLOW = 0.5  # [s] For the next slow report; they come every 0.2 s.
_WAIT = 0.02  # [s] Between two looks at what is waited for.


class Shown(NamedTuple):
    """What a controller is doing, by its newest report."""

    state: int
    mode: int
    queued: int
    """Motions that have not ended."""


class XArmConnection:
    """A connected controller. Owned by one thread, except for the requests of `client`.

    Attributes:
        client: The client library.
        name: Name of the controller in errors.
        n: Number of joints.
        on_states: Called with the states that arrive while something else is awaited.
        received_ns: When the newest state arrived, monotonic, [ns].
        is_streaming: Whether targets of mode 1 are being sent: of the states that arrive meanwhile only the newest is
            used, because the controller follows the newest target only.
        shown: What the controller is doing.
        error: Number of the error that is set; 0: none.

    Args:
        client: As the attribute.
        receiver: Its reports.
        n: As the attribute.
    """

    def __init__(self, client: XArmClient, receiver: ReportReceiver, n: int) -> None:
        self.client = client
        self.name, self.n = client.name, n
        self.on_states: Callable[[list[RobotState]], None] = lambda states: None
        self.received_ns = self._empty_ns = self._latest_since_ns = time.monotonic_ns()
        self.is_streaming = False
        self.shown = Shown(0, 0, 0)
        self.error = 0
        self._error_ns = 0
        self._receiver = receiver
        self._asker = ThreadPoolExecutor(1, "requests")
        self._reader = StateReader(n)
        self._user_frame: tuple[tuple[float, ...], Pose] = (), IDENTITY
        self.latest: RobotState | None = None

    @property
    def age(self) -> float:
        """Upper bound of the newest state's age: since the buffer was last empty before it arrived, [s]."""
        return (time.monotonic_ns() - self._latest_since_ns) * 1e-9

    def poll(self, timeout: float) -> list[RobotState]:
        """Returns every state that has arrived, oldest first; waits up to a timeout, [s], for the first.

        Raises:
            ConnectionLostError: The controller has closed the connection.
        """
        reports = self._receiver.poll(0.0)
        if not reports:
            self._empty_ns = time.monotonic_ns()
            reports = self._receiver.poll(timeout) if timeout > 0.0 else ()
            if not reports:
                return []
        self._latest_since_ns = self._empty_ns
        self.received_ns = self._empty_ns = self._receiver.received_ns
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
        """Returns the result of a method of `client`; receives states meanwhile.

        Args:
            call: The method.
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

    def wait_for_slow_report(self) -> None:
        """Returns once a slow report has arrived that was sent after this call, or none comes any more."""
        slow, since = self.client, time.monotonic_ns() + _UNDERWAY_NS
        self.wait(lambda: slow.slow is not None and slow.slow.received_ns > since, _SLOW)

    @property
    def T_base_user(self) -> Pose:
        """The user frame, in which the controller takes and reports poses."""
        values = tuple(self.client.api.world_offset)
        if values != self._user_frame[0]:
            self._user_frame = values, pose_from_mm_rpy(values)
        return self._user_frame[1]

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        self._receiver.close()
        self._asker.shutdown(wait=False)
        self.client.close()

    def _read(self, report: bytes) -> RobotState:
        before, self.shown = self.shown, Shown(*shown_by(report))
        self._update_error(before)
        self._reader.T_base_user = self.T_base_user
        faults = faults_of(self.error)
        return self._reader.read(report, faults, self._fault_mode(faults), is_streaming=self.is_streaming)

    def _update_error(self, before: Shown) -> None:
        slow = self.client.slow
        if self.shown.state != STOPPED:
            self.error = 0
        elif before.state != STOPPED:
            self.error, self._error_ns = self.client.read_error(), time.monotonic_ns()
        elif slow is not None and slow.received_ns > self._error_ns + _UNDERWAY_NS:
            self.error = slow.error

    def _fault_mode(self, faults: tuple[FaultCode, ...]) -> RobotMode | None:
        if not self.error:
            return None
        return RobotMode.USER_STOPPED if faults and faults[0] in _BUTTONS else RobotMode.REFLEX
