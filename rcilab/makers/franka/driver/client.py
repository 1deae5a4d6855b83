"""What a driver needs of a client library: states, and one motion at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rcilab.core.arrays import Matrix
from rcilab.core.command import Command
from rcilab.core.errors import CommandRejectedError, RcilabError
from rcilab.core.state import ControllerMode
from rcilab.makers.franka.driver.client_sockets import ClientSockets
from rcilab.makers.franka.driver.state_reader import number_of


class FciClient(ABC):
    """A connected client library. Owned by one thread.

    Attributes:
        robot: The library's `Robot`, for requests; see `request`.
        sockets: Its sockets.

    Args:
        robot: See above.
        sockets: See above.
    """

    robot: Any
    resolution: float
    """Largest rounding of commanded positions in states, [rad] or [m]."""
    commands_elbow: bool
    """Whether poses can be sent with the elbow."""

    def __init__(self, robot: Any, sockets: ClientSockets) -> None:
        self.robot = robot
        self.sockets = sockets
        self.newest = robot.read_once()
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
            ConnectionLostError: The controller has closed the connection.
        """
        if not self.sockets.wait_for_state(number_of(self.newest), timeout):
            return None
        with self.request("state"):
            self.newest = self.robot.read_once()
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
    def request(self, name: str) -> Iterator[None]:
        """Calls of the library for a request: their errors become those of rcilab.

        Raises:
            ConnectionLostError: The controller has closed the connection.
            CommandRejectedError: The controller refuses the request; its text is that of the library.
        """
        self.sockets.require_open()
        try:
            yield
        except RcilabError:
            raise
        except Exception as error:  # The libraries have no common base class, and panda-python no types.
            self.sockets.require_open()
            raise CommandRejectedError(name, str(error).removeprefix("libfranka: ")) from error


def columns_of(T: Matrix) -> list[float]:
    """Returns the 16 numbers of a transform, column-major."""
    return np.asarray(T).T.ravel().tolist()
