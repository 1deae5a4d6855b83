"""pylibfranka, for version 10 of the interface: one call reads a state, one sends a command.

An `ActiveControl` that is deleted before its motion has ended sends StopMove, and ends this process if the controller
refuses it. So each is ended by its last command, which the library does not send any more once the motion is over.
"""

from __future__ import annotations

import time
from typing import Any

from rcilab.core.command import CartesianPosition, Command, JointPosition
from rcilab.core.errors import CommandRejectedError, InvalidValueError
from rcilab.core.state import ControllerMode, RobotMode
from rcilab.makers.address import ControllerAddress
from rcilab.makers.franka.bounds import SINGLE_PRECISION
from rcilab.makers.franka.driver.client import FciClient, columns_of
from rcilab.makers.franka.driver.libraries import load_client_library

VERSION = 10
_STATE_SIZE = 1377  # [bytes]
_END_TIMEOUT = 1.0  # [s] For the arm to stop after StopMove; from full speed it takes 0.3 s.


class ActiveClient(FciClient):
    """A connection by pylibfranka.

    Args:
        address: Address of the controller.

    Raises:
        MissingExtraError: The library is not installed.
        ConnectionLostError: No states arrive.
    """

    resolution = SINGLE_PRECISION
    commands_elbow = False  # The binding of CartesianPose has no elbow.

    def __init__(self, address: ControllerAddress) -> None:
        library = load_client_library(VERSION)
        super().__init__(library, address, _STATE_SIZE)
        self._library = library
        self._control: Any = None
        self._kind: Any = None
        self._last: Any = None

    @property
    def is_moving(self) -> bool:
        """Whether a motion was begun and not ended."""
        return self._control is not None

    def begin(self, mode: ControllerMode) -> None:
        """Begins a motion; returns once the controller has begun it."""
        library, robot, controllers = self._library, self.robot, self._library.ControllerMode
        kinds = {
            ControllerMode.JOINT_POSITION: (robot.start_joint_position_control, controllers.JointImpedance),
            ControllerMode.JOINT_IMPEDANCE: (robot.start_joint_position_control, controllers.JointImpedance),
            ControllerMode.CARTESIAN_POSITION: (robot.start_cartesian_pose_control, controllers.JointImpedance),
            ControllerMode.CARTESIAN_IMPEDANCE: (robot.start_cartesian_pose_control, controllers.CartesianImpedance),
            ControllerMode.TORQUE: (robot.start_torque_control,),
        }
        start, *arguments = kinds[mode]
        with self.request("Move"):
            self._control = start(*arguments)
        self._last = None
        self._kind = library.JointPositions
        if mode is ControllerMode.TORQUE:
            self._kind = library.Torques
        elif mode in (ControllerMode.CARTESIAN_POSITION, ControllerMode.CARTESIAN_IMPEDANCE):
            self._kind = library.CartesianPose

    def send(self, command: Command) -> None:
        """Sends the command that answers the newest state."""
        self._last = self._kind(self._numbers(command))
        with self.request("command"):
            self._control.writeOnce(self._last)

    def end(self) -> None:
        """Ends the motion: at its last command, or by StopMove before the first one."""
        if self._control is None:
            return
        if self._last is None:
            with self.request("StopMove"):
                self.robot.stop()
            self._await_end()
        try:
            self._finish()
        except CommandRejectedError:  # An error ended the motion first: the states show it.
            self._await_end()
            self._finish()

    def set_ee(self, columns: list[float]) -> None:
        """The library's own setter."""
        self.robot.set_EE(columns)

    def set_k(self, columns: list[float]) -> None:
        """The same for the stiffness frame."""
        self.robot.set_K(columns)

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        if self._control is not None:
            self.sockets.abort()  # Else the library would wait for the answer to its StopMove.
            self._control = None
        super().close()

    def _finish(self) -> None:
        """Sends the last command as such, until the motion is over; nothing if it is."""
        last = self._last if self._last is not None else self._kind(self._hold())
        last.motion_finished = True
        with self.request("end of the motion"):
            self._control.writeOnce(last)
        self._control = None

    def _await_end(self) -> None:
        """Reads states until the motion is over."""
        deadline = time.monotonic() + _END_TIMEOUT
        while int(self.newest.robot_mode) == RobotMode.MOVE and time.monotonic() < deadline:
            self.poll(_END_TIMEOUT)

    def _hold(self) -> list[float]:
        """Returns the numbers of a command that moves nothing."""
        if self._kind is self._library.Torques:
            return [0.0] * len(self.newest.q)
        return self.newest.q_d if self._kind is self._library.JointPositions else self.newest.O_T_EE_c

    def _numbers(self, command: Command) -> list[float]:
        if isinstance(command, JointPosition):
            return command.q.tolist()
        if not isinstance(command, CartesianPosition):
            return command.tau.tolist()
        if command.psi is not None:
            raise InvalidValueError(
                "psi", command.psi, "cannot be sent: pylibfranka commands poses without the elbow; leave psi None"
            )
        return columns_of(command.T_base_tool)
