"""A connection to a controller: its client library for requests, and its reports in real time as states.

The reports show that the arm is stopped, but not by which error: that is asked for when it stops, and then follows the
slow reports of the client library.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from rcilab.core.fault import FaultCode
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.core.state import RobotMode, RobotState
from rcilab.makers.library_connection import LibraryConnection
from rcilab.makers.ufactory.driver.client import XArmClient, faults_of
from rcilab.makers.ufactory.driver.report_receiver import ReportReceiver
from rcilab.makers.ufactory.driver.state_reader import STOPPED, StateReader, shown_by
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.wire.poses import pose_from_mm_rpy

_BUTTONS = (
    UfactoryError.EMERGENCY_STOP_BUTTON,
    UfactoryError.EMERGENCY_STOP_INPUT,
    UfactoryError.EMERGENCY_STOP_SWITCH,
)
_UNDERWAY_NS = 50_000_000  # For a slow report that was sent before an error was read.
_STILL = 2
_SLOW = 0.5  # [s] For the next slow report; they come every 0.2 s.


class Shown(NamedTuple):
    """What a controller is doing, by its newest report."""

    state: int
    mode: int
    queued: int
    """Motions that have not ended."""


class XArmConnection(LibraryConnection[bytes]):
    """A connected controller. Owned by one thread, except for the requests of `client`.

    Attributes:
        client: The client library.
        shown: What the controller is doing.
        error: Number of the error that is set; 0: none.
        is_still: Whether the arm is commanded the same joint angles in three states: two may be about a turn.

    Args:
        client: As the attribute.
        receiver: Its reports.
        n: As the attribute.
    """

    def __init__(self, client: XArmClient, receiver: ReportReceiver, n: int) -> None:
        super().__init__(client.name, n, receiver)
        self.client = client
        self.shown = Shown(0, 0, 0)
        self.error = 0
        self.is_still = False
        self._same = 0  # States with the joint angles of the one before.
        self._error_ns = 0
        self._reader = StateReader(n)
        self._user_frame: tuple[tuple[float, ...], Pose] = (), IDENTITY

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
        super().close()
        self.client.close()

    def _read(self, report: bytes) -> RobotState:
        before, self.shown = self.shown, Shown(*shown_by(report))
        self._update_error(before)
        self._reader.T_base_user = self.T_base_user
        faults = faults_of(self.error)
        state = self._reader.read(report, faults, self._fault_mode(faults), is_streaming=self.is_streaming)
        is_same = self.latest is not None and np.array_equal(state.q_c, self.latest.q_c)
        self._same = self._same + 1 if is_same else 0
        self.is_still = self._same >= _STILL
        return state

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
