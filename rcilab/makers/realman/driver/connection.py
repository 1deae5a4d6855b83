"""A connection to a controller: its client library for requests, and its pushed states."""

from __future__ import annotations

import time
from contextlib import suppress

from rcilab.core.errors import CommandRejectedError, ConnectionLostError
from rcilab.core.spatial import Pose
from rcilab.core.state import RobotMode, RobotState
from rcilab.makers.library_connection import LibraryConnection
from rcilab.makers.realman.driver.client import RealManClient
from rcilab.makers.realman.driver.push_receiver import NumberedPush, PushReceiver
from rcilab.makers.realman.driver.state_reader import PAUSED, StateReader, is_enabled
from rcilab.makers.realman.wire.units import pose_from_client

_SILENCE = 300_000_000  # [ns] Without a state, after which the controller is asked where it pushes them.
_TAKEN = (
    "its states go to another client, because a controller pushes them to one address only; close the other client, "
    "and connect again"
)


class RealManConnection(LibraryConnection[NumberedPush]):
    """A connected controller. Owned by one thread, except for the requests of `client`.

    Attributes:
        client: The client library.
        is_enabled: Whether all joints are enabled.
        is_paused: Whether a motion that the controller plans is paused.

    Args:
        client: As the attribute.
        receiver: Where its states arrive.
        n: Number of joints.
    """

    def __init__(self, client: RealManClient, receiver: PushReceiver, n: int) -> None:
        super().__init__(client.name, n, receiver)
        self.client = client
        self.is_enabled = self.is_paused = False
        self._receiver = receiver
        self._reader = StateReader(n)
        client.push_states(receiver.port)
        self.read_work_frame()

    def poll(self, timeout: float) -> list[RobotState]:
        """Returns every state that has arrived, oldest first; waits up to a timeout, [s], for the first.

        Raises:
            ConnectionLostError: The controller does not answer, or pushes its states to another client.
        """
        states = super().poll(timeout)
        is_silent = not states and time.monotonic_ns() - self.received_ns > _SILENCE
        if is_silent and timeout > 0.0 and not self.is_streaming and self.client.pushed_port() != self._receiver.port:
            raise ConnectionLostError(f"{self.name}: {_TAKEN}")
        return states

    def read_work_frame(self) -> None:
        """Asks for the current work frame, in which poses are reported."""
        frame = self.client.request(self.client.api.rm_get_current_work_frame)
        self._reader.T_base_work = pose_from_client(frame["pose"])

    @property
    def T_base_work(self) -> Pose:
        """The work frame, as read last."""
        return self._reader.T_base_work

    @property
    def is_still(self) -> bool:
        """Whether the newest state shows an arm that does nothing."""
        return self.latest is not None and self.latest.robot_mode in (RobotMode.IDLE, RobotMode.REFLEX)

    def close(self) -> None:
        """Ends the connection, and the push of states unless another client has them. May be called twice."""
        with suppress(ConnectionLostError, CommandRejectedError, OSError):
            port = self._receiver.port
            if self.client.pushed_port() == port:
                self.client.push_states(port, on=False)
        super().close()
        self.client.close()

    def _read(self, report: NumberedPush) -> RobotState:
        self.is_enabled = is_enabled(report.pushed)
        self.is_paused = report.pushed.arm_current_status == PAUSED
        return self._reader.read(report, is_streaming=self.is_streaming)
