"""The driver of RealMan's interface: a neutral `StreamingDriver` over the maker's client library."""

from __future__ import annotations

from dataclasses import replace
from math import radians
from typing import TYPE_CHECKING, Any

from rcilab.core.command import Command, JointPosition
from rcilab.core.errors import CommandRejectedError, ConnectionLostError, DeadlineError, InvalidValueError, ModelError
from rcilab.core.fault import name_faults
from rcilab.core.limits import Limits
from rcilab.core.state import ControllerMode, RobotMode, RobotState
from rcilab.makers.address import ControllerAddress
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
from rcilab.makers.fault_report import describe_faults
from rcilab.makers.known_setup import with_reported_load, with_reported_tool
from rcilab.makers.library_connection import LibraryDriver
from rcilab.makers.realman.bounds import ANGLE_STEP
from rcilab.makers.realman.driver.address import parse_address
from rcilab.makers.realman.driver.client import RealManClient, load_client_library
from rcilab.makers.realman.driver.configuration import send_configuration
from rcilab.makers.realman.driver.connection import RealManConnection
from rcilab.makers.realman.driver.handshake import find_arm
from rcilab.makers.realman.driver.push_receiver import NumberedPush, PushReceiver
from rcilab.makers.realman.driver.session_commands import RealManSessionCommands
from rcilab.makers.realman.driver.settings import RealManSettings
from rcilab.makers.realman.errors import REFUSED_COMMANDS
from rcilab.makers.realman.wire.units import degrees_for_client
from rcilab.robots import describe_robot

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_SWITCHED = 5.0  # [s] For the joints to show that they are enabled or not.
_RECOVERED = 3.0  # [s] For errors to be gone after they were cleared.
_ARRIVED = 1.0  # [s] For the arm to stand after the last target.


def open_driver(address: str, timeout: float, expected: ExpectedArm | None) -> RealManDriver:
    """Returns a connection to a RealMan controller; see `rcilab.makers.driver.open_driver`."""
    parsed = parse_address(address)
    load_client_library()  # A missing library is reported also where no controller answers.
    name, route = find_arm(parsed, timeout)
    if expected is not None and name != expected.name:
        raise ModelError(
            f"the controller at {parsed} has an arm {name}, you gave {expected.name}; leave model out, or "
            f"load_model({name!r})"
        ).coded("other_arm", address=str(parsed), theirs=name, ours=expected.name)
    n = len(describe_robot(name).dh)
    receiver = PushReceiver(route, n, str(parsed))
    try:
        client = RealManClient(route, parsed.port, str(parsed), n)
    except BaseException:
        receiver.close()
        raise
    try:
        connection = RealManConnection(client, receiver, n)
    except BaseException:
        receiver.close()
        client.close()
        raise
    try:
        if not connection.wait(lambda: connection.latest is not None, timeout):
            raise ConnectionLostError(
                f"{parsed}: no state arrives at {route.local}:{receiver.port} within {timeout:g} s; look whether a "
                "firewall blocks UDP from the controller"
            )
        return RealManDriver(connection, parsed, name)
    except BaseException:
        connection.close()
        raise


class RealManDriver(LibraryDriver[NumberedPush]):
    """A connection to a RealMan controller with the interface of `StreamingDriver`.

    Motions are joint angles streamed for the controller to follow on a curve through them, one for every pushed state:
    the arm's clock is that of the motion.

    Args:
        connection: The connection.
        address: Address of the controller.
        arm_name: Name of its arm.
    """

    scheme = "realman"
    resolution = radians(ANGLE_STEP)
    commands_arm_angle = holds_arm_angle = False
    keeps_newest = reports_load = True
    recovery_silence = 0.0

    def __init__(self, connection: RealManConnection, address: ControllerAddress, arm_name: str) -> None:
        world_port = address.world_port
        super().__init__(connection, arm_name, None if world_port is None else (address.host, world_port))
        self.is_local = address.is_here
        self._link = connection
        self._settings: RealManSettings = RealManSettings(connection, arm_name)

    def read_configuration(self) -> RobotConfiguration:
        """Returns the load of the tool frame that is set, and the limits in force of joints and tool."""
        return replace(self._settings.read_limits(), load=self._settings.tool.load)

    def open_commands(self, arm: ConfiguredArm, lock: RequestLock) -> RealManSessionCommands:
        """Returns the commands of the interface for a session; its model has the controller's limits from now on."""
        arm.model = self._settings.with_limits(arm.model)
        self._settings = commands = RealManSessionCommands(self._link, arm, lock)
        return commands

    def power(self, on: bool, *, alongside: bool = False) -> None:
        """Switches motor power; on, all joints are enabled."""
        link, client = self._link, self._link.client
        if alongside:
            client.request(client.api.rm_set_arm_power, int(on))
            return
        if on is not bool(link.ask(client.request, client.api.rm_get_arm_power_state)):
            link.ask(client.request, client.api.rm_set_arm_power, int(on))
            link.wait(lambda: link.is_enabled is on, _SWITCHED)
        if on:
            self._settings.enable_all()

    def is_powered(self, *, alongside: bool = False) -> bool:
        """Returns whether all joints are enabled, by a state: the newest one if `alongside`."""
        if not alongside:
            self._settings.await_states()
        return self._link.is_enabled

    def recover(self) -> None:
        """Clears the errors of system and joints, and returns once all joints are enabled without one.

        Raises:
            DeadlineError: An error remains.
        """
        link = self._link
        self._settings.clear_errors()
        latest = link.latest
        if latest is not None and latest.robot_mode is RobotMode.USER_STOPPED:
            raise DeadlineError(f"{self.name}: {_ESTOP}").coded("still_pressed")
        if latest is not None and latest.faults:
            names = name_faults(latest.faults)
            raise DeadlineError(f"{self.name}: {names} did not clear: remove the cause first").coded(
                "still_set", faults=names
            )
        self.power(True)
        link.wait(lambda: link.is_enabled, _RECOVERED)

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration."""
        send_configuration(self._settings, configuration)

    def with_tool(self, model: RobotModel) -> RobotModel:
        """Returns the model with the controller's tool and load; warns if those of the model are others."""
        tool = self._settings.tool
        return with_reported_load(with_reported_tool(model, tool.T_flange_tool, self.name), tool.load, self.name)

    def start_guiding(self, space: GuideSpace, kind: GuideKind) -> None:
        """Raises an error: rcilab does not use this interface's hand guiding.

        Raises:
            ModelError: Always.
        """
        raise ModelError("rcilab does not start RealMan's drag teaching: use the teach pendant")

    def stop_guiding(self) -> None:
        """Does nothing, see `start_guiding`."""

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output of the controller."""
        self._settings.set_output(signal, level)

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input of the controller."""
        return self._settings.read_input(signal)

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Sends a request for a digital signal during a motion."""
        return self._settings.ask_signal(signal, level)

    def reboot(self) -> None:
        """Raises an error: the interface has no restart.

        Raises:
            ModelError: Always.
        """
        raise ModelError("a RealMan controller is not restarted over its interface: switch it off and on")

    def close(self) -> None:
        """Ends the connection; stops a motion of `robot.realman` that is in progress. May be called twice."""
        self._settings.close()
        self._link.close()

    def begin(self, mode: ControllerMode) -> None:
        """Prepares for targets.

        Raises:
            InvalidValueError: It is not a mode for motions.
            CommandRejectedError: The arm is not ready, or a motion is paused; the message has the reason.
        """
        if mode is not ControllerMode.JOINT_POSITION:
            raise InvalidValueError("mode", mode, "is not a mode to move in; there is JOINT_POSITION")
        self._settings.await_states()
        self._settings.require_not_paused("the motion")
        link, latest = self._link, self._link.latest
        assert latest is not None  # A connection begins with a state.
        if latest.faults and REFUSED_COMMANDS.issuperset(latest.faults):  # Of a command before this motion.
            link.ask(link.client.request, link.client.api.rm_clear_system_err)
            link.wait(lambda: link.latest is not None and not link.latest.faults, _RECOVERED)
        if not link.is_enabled and not latest.faults and latest.robot_mode is not RobotMode.USER_STOPPED:
            raise CommandRejectedError(
                "the motion", "joints are disabled", "power_on() enables all joints", reason="power_off"
            )
        link.is_streaming = True

    def has_begun(self, state: RobotState) -> bool:
        """Returns whether a state shows that targets are followed."""
        return state.controller_mode is ControllerMode.JOINT_POSITION

    def is_streaming(self, state: RobotState) -> bool:
        """Returns whether a state shows that targets are followed."""
        return state.controller_mode is ControllerMode.JOINT_POSITION

    def send(self, state: RobotState, command: Command) -> None:
        """Sends the target that answers a state; the library waits for no answer."""
        assert isinstance(command, JointPosition)  # The only mode.
        self._link.client.send_angles(degrees_for_client(command.q.tolist()))

    def end(self, timeout: float | None = None) -> None:
        """Ends the stream: the arm stays at the newest target, and a stopped one where it is."""
        self._link.is_streaming = False
        self._link.wait(lambda: self._link.is_still, _ARRIVED)

    def find_safety_stop(self, state: RobotState) -> SafetyStopReason | None:
        """Returns the emergency stop if a state shows it."""
        return SafetyStopReason("estop", _ESTOP) if state.robot_mode is RobotMode.USER_STOPPED else None

    def is_lack_of_commands(self, faults: tuple[Any, ...]) -> bool:
        """Returns False: without targets the arm stays where it is, and the controller reports no error."""
        return False

    def select_limits(self, limits: Limits, table: str) -> Limits:
        """Returns the limits: the maker publishes one table only, the manual's.

        Raises:
            InvalidValueError: Another table is asked for.
        """
        if table != "manual":
            raise InvalidValueError("rate_limit", table, "does not exist for this maker; there is 'manual'")
        return limits

    describe_faults = staticmethod(describe_faults)


_ESTOP = "the emergency stop is pressed: release it, then recover()"
