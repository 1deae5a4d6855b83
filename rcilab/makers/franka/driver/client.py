"""What a driver needs of a client library: states, and one motion at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rcilab.core.arrays import Matrix
from rcilab.core.command import Command
from rcilab.core.errors import CommandRejectedError, ConnectionLostError, RcilabError
from rcilab.core.spatial import as_pose
from rcilab.core.state import ControllerMode
from rcilab.makers.address import ControllerAddress
from rcilab.makers.franka.collisions import CollisionThresholds
from rcilab.makers.franka.driver.client_sockets import open_with_sockets
from rcilab.makers.franka.driver.libraries import kept_scheduling
from rcilab.makers.franka.driver.state_reader import number_of
from rcilab.makers.network import find_route

ANSWER_TIMEOUT = 5.0  # [s] For the answer to a request, which a controller gives within a few cycles. A tuning value.
_STATE_TIMEOUT = 1.0  # [s] After which both client libraries end the wait for a state.


class FciClient(ABC):
    """A connected client library. Owned by one thread.

    Attributes:
        robot: The library's `Robot`, for requests; see `request`.
        sockets: Its sockets.
        thresholds: The upper thresholds of collisions that were set over this connection; None before.

    Args:
        library: The client library.
        address: Address of the controller.
        state_size: Size of its states, [bytes].

    Raises:
        ConnectionLostError: No states of an arm arrive.
    """

    robot: Any
    resolution: float
    """Largest rounding of commanded positions in states, [rad] or [m]."""
    commands_elbow: bool
    """Whether poses can be sent with the elbow."""

    def __init__(self, library: Any, address: ControllerAddress, state_size: int) -> None:
        self._name = str(address)
        self.thresholds: CollisionThresholds | None = None

        def open_robot() -> tuple[Any, Any]:
            robot = library.Robot(address.host, library.RealtimeConfig.kIgnore)
            state = robot.read_once()
            as_pose(np.array(state.O_T_EE).reshape(4, 4).T)  # Else it is not the state of an arm.
            return robot, state

        with kept_scheduling():
            peer = find_route(address).host, address.port
            (self.robot, first), self.sockets = open_with_sockets(
                open_robot, state_size, peer, str(address), ANSWER_TIMEOUT
            )
        self.newest: Any = first
        """The newest state."""

    @property
    @abstractmethod
    def is_moving(self) -> bool:
        """Whether a motion was begun and not ended."""

    @abstractmethod
    def begin(self, mode: ControllerMode) -> None:
        """Begins a motion; returns once the controller has begun it."""

    @abstractmethod
    def send(self, command: Command) -> None:
        """Sends the command that answers the newest state."""

    @abstractmethod
    def end(self) -> None:
        """Ends the motion: at its last command, or by StopMove before the first one; has no effect without one."""

    def poll(self, timeout: float) -> Any | None:
        """Returns the newest state if one arrives within a timeout, [s]; older ones are dropped.

        Raises:
            ConnectionLostError: The controller has closed the connection, or sends no further state.
        """
        if not self.sockets.wait_for_state(number_of(self.newest), timeout):
            return None
        try:
            with self.request("state"):
                self.newest = self.robot.read_once()
        except CommandRejectedError as error:  # Nothing was requested: the library waits for another state.
            raise ConnectionLostError(
                f"{self._name}: no state for {_STATE_TIMEOUT:g} s; check that the controller runs, and connect again"
            ) from error
        return self.newest

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        self.sockets.close()
        self.robot = None

    @abstractmethod
    def set_ee(self, columns: list[float]) -> None:
        """The library's own setter, which both spell differently; 16 numbers, column-major."""

    @abstractmethod
    def set_k(self, columns: list[float]) -> None:
        """The same for the stiffness frame."""

    @contextmanager
    def request(self, name: str, timeout: float = ANSWER_TIMEOUT) -> Iterator[None]:
        """Calls of the library for a request: their errors become those of rcilab.

        Args:
            name: Name of the request.
            timeout: For its answer, [s].

        Raises:
            ConnectionLostError: The controller has closed the connection, or does not answer in time.
            CommandRejectedError: The controller refuses the request; its text is that of the library.
        """
        self.sockets.require_open()
        self.sockets.limit.start(timeout)
        try:
            yield
        except RcilabError:
            raise
        except Exception as error:  # The libraries have no common base class, and panda-python no types.
            self.sockets.require_open()
            raise CommandRejectedError(name, str(error).removeprefix("libfranka: ")) from error
        finally:
            self.sockets.limit.stop()


def columns_of(T: Matrix) -> list[float]:
    """Returns the 16 numbers of a transform, column-major."""
    return np.asarray(T).T.ravel().tolist()
