"""panda-python's libfranka, for version 5 of the interface: it asks a callback for the command that answers a state.

The library runs in a thread of its own while a motion is in progress. Its callback passes a state on and waits for the
command, so that the two threads never run at the same time.
"""

from __future__ import annotations

import os
import queue
import threading
from typing import Any

from rcilab.core.command import CartesianPosition, Command, JointPosition
from rcilab.core.errors import ConnectionLostError
from rcilab.core.state import ControllerMode
from rcilab.makers.address import ControllerAddress
from rcilab.makers.franka.driver.call_limit import CallLimit
from rcilab.makers.franka.driver.client import ANSWER_TIMEOUT, FciClient, columns_of
from rcilab.makers.franka.driver.libraries import load_client_library

VERSION = 5
_STATE_SIZE = 2373  # [bytes]
_NO_FILTER = 1000.0  # [Hz] The library's own low pass filter is off from here; rcilab has the filters of a callback.
_START_TIMEOUT = 3.0  # [s] For the first state of a motion.
_END_TIMEOUT = 3.0  # [s] For the controller to end a motion.


class CallbackClient(FciClient):
    """A connection by panda-python.

    Args:
        address: Address of the controller.

    Raises:
        MissingExtraError: The library is not installed.
        ConnectionLostError: No states arrive.
    """

    resolution = 0.0
    commands_elbow = True

    def __init__(self, address: ControllerAddress) -> None:
        library = load_client_library(VERSION)
        super().__init__(library, address, _STATE_SIZE)
        self._library = library
        self._name = str(address)
        self._motion: _Motion | None = None
        self._mode = ControllerMode.JOINT_POSITION
        self._last: Any = None

    @property
    def is_moving(self) -> bool:
        """Whether a motion was begun and not ended."""
        return self._motion is not None

    def begin(self, mode: ControllerMode) -> None:
        """Begins a motion; returns once the controller has begun it."""
        robot, controllers = self.robot, self._library.ControllerMode
        joints, tool = robot.control_joint_position, robot.control_cartesian_pose
        kinds = {
            ControllerMode.JOINT_POSITION: (joints, controllers.kJointImpedance),
            ControllerMode.JOINT_IMPEDANCE: (joints, controllers.kJointImpedance),
            ControllerMode.CARTESIAN_POSITION: (tool, controllers.kJointImpedance),
            ControllerMode.CARTESIAN_IMPEDANCE: (tool, controllers.kCartesianImpedance),
            ControllerMode.TORQUE: (robot.control,),
        }
        control, *arguments = kinds[mode]
        self._mode, self._last = mode, None
        with self.request("Move"):
            self._motion = _Motion(control, (*arguments, False, _NO_FILTER), self.sockets.limit)
            first = self._motion.next_state(_START_TIMEOUT)
            if first is None:
                motion, self._motion = self._motion, None
                raise motion.failure or TimeoutError(f"no state of the motion within {_START_TIMEOUT:g} s")
        self._motion.unread = first

    def poll(self, timeout: float) -> Any | None:
        """Returns the newest state if one arrives within a timeout, [s]; older ones are dropped.

        Raises:
            ConnectionLostError: The controller has closed the connection.
        """
        if self._motion is None or self._motion.has_ended:
            return super().poll(timeout)
        state = self._motion.next_state(timeout)
        if state is not None:
            self.newest = state
            return state
        return super().poll(timeout) if self._motion.has_ended else None

    def send(self, command: Command) -> None:
        """Sends the command that answers the newest state."""
        self._last = self._converted(command)
        if self._motion is not None and not self._motion.has_ended:
            self._motion.answer(self._last)

    def end(self) -> None:
        """Ends the motion: at its last command, or by StopMove before the first one."""
        motion = self._motion
        if motion is None:
            return
        last = self._last
        if last is not None:
            last.motion_finished = True
        while not motion.has_ended:
            if motion.is_waiting:
                motion.answer(last)  # None makes the library send StopMove.
            elif motion.next_state(_END_TIMEOUT) is None and not motion.has_ended:
                raise ConnectionLostError(f"{self._name}: the motion did not end within {_END_TIMEOUT:g} s")
        self._motion = None

    def set_ee(self, columns: list[float]) -> None:
        """The library's own setter."""
        self.robot.set_ee(columns)

    def set_k(self, columns: list[float]) -> None:
        """The same for the stiffness frame."""
        self.robot.set_k(columns)

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        if self._motion is not None:
            self.sockets.abort()  # Else the library would wait for the answer to its StopMove.
            self._motion.abandon(_END_TIMEOUT)
            self._motion = None
        super().close()

    def _converted(self, command: Command) -> Any:
        library = self._library
        if isinstance(command, JointPosition):
            return library.JointPositions(command.q.tolist())
        if not isinstance(command, CartesianPosition):
            return library.Torques(command.tau.tolist())
        T = columns_of(command.T_base_tool)
        if command.psi is None:
            return library.CartesianPose(T)
        return library.CartesianPose(T, [command.psi, self.newest.elbow_c[1]])


class _StopMoveError(Exception):
    """Raised by a callback to end its motion without a last command."""


class _Motion:
    """A call of the library's `control` in a thread. Owned by the thread that created it.

    Attributes:
        is_waiting: Whether the library waits for a command.
        failure: The error that ended the motion.
        unread: A state that was taken out of turn, and is returned first.

    Args:
        control: The method of the library.
        arguments: Its arguments after the callback.
        limit: Time limit of the library's calls.
    """

    def __init__(self, control: Any, arguments: tuple[Any, ...], limit: CallLimit) -> None:
        self.is_waiting = False
        self.failure: Exception | None = None
        self.unread: Any = None
        self._states: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._commands: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._scheduling = os.sched_getscheduler(0), os.sched_getparam(0)
        self._is_first = True
        self._limit = limit
        self._thread = threading.Thread(target=self._run, args=(control, arguments), name="libfranka", daemon=True)
        self._thread.start()

    @property
    def has_ended(self) -> bool:
        """Whether the library has returned."""
        return not self._thread.is_alive()

    def next_state(self, timeout: float) -> Any | None:
        """Returns the state to answer; None if the motion has ended, or after a timeout, [s]."""
        state, self.unread = self.unread, None
        if state is not None:
            return state
        if self.is_waiting:  # It will not read another one before its answer.
            return None
        try:
            state = self._states.get(timeout=timeout)
        except queue.Empty:
            return None
        if state is None:
            self._thread.join()
        else:
            self.is_waiting = True
        return state

    def answer(self, command: Any) -> None:
        """Sends a command; None ends the motion by StopMove."""
        self.is_waiting = False
        self._commands.put(command)

    def abandon(self, timeout: float) -> None:
        """Ends the call without a last command; waits for it for a time, [s]."""
        self.answer(None)
        self._thread.join(timeout)

    def _run(self, control: Any, arguments: tuple[Any, ...]) -> None:
        self._limit.start(ANSWER_TIMEOUT)
        try:
            control(self._exchange, *arguments)
        except Exception as error:
            self.failure = error
        finally:
            self._limit.stop()
            self._states.put(None)

    def _exchange(self, state: Any, period: Any) -> Any:
        """The library's callback."""
        self._limit.stop()
        if self._is_first:
            self._is_first = False
            os.sched_setscheduler(0, *self._scheduling)  # The library has requested the highest priority.
        self._states.put(state)
        command = self._commands.get()
        self._limit.start(ANSWER_TIMEOUT)
        if command is None:
            raise _StopMoveError
        return command
