"""The driver of the RCI: a neutral `StreamingDriver` over a connection and its commands."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rcilab.core.command import Command, CommandFilter
from rcilab.core.errors import DeadlineError, InvalidValueError, RcilabError
from rcilab.core.fault import name_faults
from rcilab.core.limits import Limits
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import (
    ConfiguredArm,
    ExpectedArm,
    GuideKind,
    GuideSpace,
    RequestLock,
    SafetyStopReason,
    SignalRequest,
)
from rcilab.makers.rokae.driver.address import RciAddress, parse_address
from rcilab.makers.rokae.driver.commands import RciCommands
from rcilab.makers.rokae.driver.configuration import send_configuration
from rcilab.makers.rokae.driver.connection import RciConnection, SocketTransport
from rcilab.makers.rokae.driver.fault_report import describe_faults
from rcilab.makers.rokae.driver.handshake import await_first_state, require_arm_there, with_tool_of
from rcilab.makers.rokae.driver.identify import identify_robot
from rcilab.makers.rokae.driver.refusal import Refusal
from rcilab.makers.rokae.driver.session_commands import RciSessionCommands
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.limit_tables import cartesian_limits
from rcilab.makers.rokae.wire import STATE_SIZE, Request, SafetyStop, StartMotionMode, build_command
from rcilab.robots import describe_robot

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

__all__ = ["RciDriver", "open_driver", "parse_address"]

_MOST_JOINTS = 7
_RECOVERY_TIMEOUT = 3.0  # [s] For the error bits to clear after the controller has accepted the recovery.
_FRESH = 0.1  # [s] Longest wait for one state while the bits are expected to clear.
_MOTION_MODES = {
    ControllerMode.JOINT_POSITION: StartMotionMode.JOINT,
    ControllerMode.JOINT_IMPEDANCE: StartMotionMode.JOINT,
    ControllerMode.CARTESIAN_POSITION: StartMotionMode.CARTESIAN,
    ControllerMode.CARTESIAN_IMPEDANCE: StartMotionMode.CARTESIAN,
    ControllerMode.TORQUE: StartMotionMode.IDLE,
}


def open_driver(address: str, timeout: float, expected: ExpectedArm | None) -> RciDriver:
    """Returns a connection to an RCI controller; see `rcilab.makers.driver.open_driver`."""
    parsed = parse_address(address)
    transport = SocketTransport(parsed, STATE_SIZE, timeout)
    try:
        connection = RciConnection(transport, _MOST_JOINTS if expected is None else expected.n, str(parsed), timeout)
        commands = RciCommands(connection)
        if expected is None:
            name = identify_robot(commands.load_model().dh)
            connection.n = len(describe_robot(name).dh)
        else:
            name = expected.name
            require_arm_there(commands, name, expected.lengths, str(parsed))
        await_first_state(connection, parsed, transport.local_address, timeout)
    except BaseException:
        transport.close()
        raise
    return RciDriver(connection, parsed, name)


class RciDriver:
    """A connection to an RCI controller with the interface of `StreamingDriver`.

    Args:
        connection: The connection.
        address: Address of the controller.
        arm_name: Name of its arm.
    """

    scheme = "rci"
    resolution = 0.0
    commands_arm_angle = holds_arm_angle = True
    keeps_newest = reports_load = False
    recovery_silence = 0.0

    def __init__(self, connection: RciConnection, address: RciAddress, arm_name: str) -> None:
        self.connection = connection
        self.name = connection.name
        self.n = connection.n
        self.arm_name = arm_name
        self.is_local = address.is_here
        self.simulation_address = None if address.world_port is None else (address.host, address.world_port)
        self.poll = connection.poll
        self._description = describe_robot(arm_name)
        self._commands = RciCommands(connection, self._description)
        self._mode = ControllerMode.JOINT_POSITION
        self._shown = MotionGeneratorMode.IDLE

    def read_configuration(self) -> RobotConfiguration:
        """Returns nothing: the interface does not report it."""
        return RobotConfiguration()

    @property
    def latest(self) -> RobotState | None:
        """The newest state."""
        return self.connection.latest

    @property
    def received_ns(self) -> int:
        """When it arrived, monotonic, [ns]."""
        return self.connection.received_ns

    @property
    def age(self) -> float:
        """Upper bound of its age, [s]."""
        return self.connection.age

    @property
    def on_states(self) -> Callable[[list[RobotState]], None]:
        """Called with the states that arrive while an answer is awaited."""
        return self.connection.on_states

    @on_states.setter
    def on_states(self, listener: Callable[[list[RobotState]], None]) -> None:
        self.connection.on_states = listener

    def open_commands(self, arm: ConfiguredArm, lock: RequestLock) -> RciSessionCommands:
        """Returns the commands of the RCI for a session."""
        return RciSessionCommands(self.connection, self._description, arm, lock)

    def power(self, on: bool, *, alongside: bool = False) -> None:
        """Switches motor power."""
        commands = _AlongsideCommands(self.connection) if alongside else self._commands
        commands.set_motor_power(on)

    def is_powered(self, *, alongside: bool = False) -> bool:
        """Returns whether motor power is on."""
        commands = _AlongsideCommands(self.connection) if alongside else self._commands
        return commands.motor_state()

    def recover(self) -> None:
        """Clears the controller's faults and returns once they are gone."""
        self._commands.automatic_error_recovery()
        link, deadline = self.connection, time.monotonic() + _RECOVERY_TIMEOUT
        faults = link.latest.faults if link.latest is not None else ()
        while time.monotonic() < deadline:
            states = link.poll(_FRESH)
            link.on_states(states)
            if states:
                faults = states[-1].faults
                if not faults:
                    return
        names = name_faults(faults)
        raise DeadlineError(
            f"{link.name}: {names or 'the faults'} did not clear within {_RECOVERY_TIMEOUT:g} s; remove the cause first"
            + (f": {faults[0].remedy}" if faults else "")
        ).coded("not_cleared", faults=names, seconds=f"{_RECOVERY_TIMEOUT:g}")

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration."""
        send_configuration(self._commands, configuration)

    def with_tool(self, model: RobotModel) -> RobotModel:
        """Returns the model with the tool that the controller's state shows."""
        return with_tool_of(self.connection, model)

    def start_guiding(self, space: GuideSpace, kind: GuideKind) -> None:
        """Frees the arm for hand guiding (startDrag)."""
        self._commands.start_drag(space, kind)

    def stop_guiding(self) -> None:
        """Ends hand guiding (stopDrag)."""
        self._commands.stop_drag()

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output."""
        self._commands.set_do(signal, level)

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input."""
        return self._commands.get_di(signal)

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Sends a request for a digital signal during a motion."""
        return self._commands.ask_signal(signal, level)

    def reboot(self) -> None:
        """Restarts the controller."""
        self._commands.reboot()

    def close(self) -> None:
        """Ends the connection."""
        self.connection.close()

    def begin(self, mode: ControllerMode) -> None:
        """Begins a motion (StartMove).

        Raises:
            InvalidValueError: It is not a mode for motions.
        """
        if mode not in _MOTION_MODES:
            known = [known.name for known in _MOTION_MODES]
            raise InvalidValueError("mode", mode, f"is not a mode to move in; there are {known}")
        motion_mode = _MOTION_MODES[mode]
        self._mode, self._shown = mode, motion_mode.shown_as
        self._commands.start_move(mode, motion_mode)

    def has_begun(self, state: RobotState) -> bool:
        """Returns whether a state shows both modes of `begin`."""
        return state.controller_mode == self._mode and state.motion_generator_mode == self._shown

    def is_streaming(self, state: RobotState) -> bool:
        """Returns whether a state shows the motion generator of `begin`."""
        return state.motion_generator_mode == self._shown

    def send(self, state: RobotState, command: Command) -> None:
        """Sends the command that answers a state."""
        self.connection.send(build_command(state.message_id, command, state))

    def end(self, timeout: float | None = None) -> None:
        """Ends the motion (StopMove)."""
        self._commands.stop_move(timeout)

    def find_safety_stop(self, state: RobotState) -> SafetyStopReason | None:
        """Returns the safety stop that a state shows; the state shows that there is one, a query which."""
        if state.robot_mode is not RobotMode.USER_STOPPED:
            return None
        try:
            is_gate = self._commands.safety_stop() is SafetyStop.GSTOP
        except RcilabError:  # The state shows that there is one.
            is_gate = False
        reason = Refusal.GSTOP if is_gate else Refusal.ESTOP
        return SafetyStopReason(reason.word, reason.sentence)

    def is_lack_of_commands(self, faults: tuple[Any, ...]) -> bool:
        """Returns whether the controller lacked commands, which it reports as an instability."""
        return Fault.INSTABILITY_DETECTION in faults

    def select_limits(self, limits: Limits, table: str) -> Limits:
        """Returns the limits with the tool's bounds of the manual, or of the vendor's limiter ("sdk")."""
        return cartesian_limits(limits, table)

    def open_filter(self, limits: Limits, table: str, cut_off: float | None) -> CommandFilter | None:
        """Returns None: rcilab's filters apply."""
        return None

    describe_faults = staticmethod(describe_faults)


class _AlongsideCommands(RciCommands):
    """Commands from another thread than the one that receives the states."""

    def _request(self, request: Request, timeout: float | None = None) -> Any:
        return self._link.request_alongside(request, timeout)
