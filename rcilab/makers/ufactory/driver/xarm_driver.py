"""The driver of UFACTORY's interface: a neutral `StreamingDriver` over the maker's client library."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.core.command import Command, CommandFilter, JointPosition
from rcilab.core.errors import DeadlineError, InvalidValueError, ModelError
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
from rcilab.makers.ufactory.bounds import SINGLE_PRECISION
from rcilab.makers.ufactory.driver.address import parse_address
from rcilab.makers.ufactory.driver.client import XArmClient, describe_error
from rcilab.makers.ufactory.driver.configuration import send_configuration
from rcilab.makers.ufactory.driver.connection import XArmConnection
from rcilab.makers.ufactory.driver.library import load_client_library
from rcilab.makers.ufactory.driver.links import find_arm
from rcilab.makers.ufactory.driver.report_receiver import open_receiver
from rcilab.makers.ufactory.driver.session_commands import XArmSessionCommands
from rcilab.makers.ufactory.driver.settings import XArmSettings
from rcilab.makers.ufactory.driver.state_reader import MOVING, READY, READY_MODE, SERVO_MODE, STOPPED, TEACH_MODE
from rcilab.robots import describe_robot

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_SWITCHED = 2.0  # [s] For the motors to show that they are on or off; brakes take 0.2 s.
_RECOVERED = 3.0  # [s] For an error to be gone after the controller has accepted `clean_error`.
_ARRIVED = 1.0  # [s] For the arm to stand after the last target.
_REACTION = 1.0  # [s] For a report that shows a new mode.


def open_driver(address: str, timeout: float, expected: ExpectedArm | None) -> XArmDriver:
    """Returns a connection to a UFACTORY controller; see `rcilab.makers.driver.open_driver`."""
    parsed = parse_address(address)
    load_client_library()  # A missing library is reported also where no controller answers.
    name, endpoint = find_arm(parsed, timeout)
    if expected is not None and name != expected.name:
        raise ModelError(
            f"the controller at {parsed} has an arm {name}, you gave {expected.name}; leave model out, or "
            f"load_model({name!r})"
        ).coded("other_arm", address=str(parsed), theirs=name, ours=expected.name)
    n = len(describe_robot(name).dh)
    client = XArmClient(endpoint, str(parsed), n)
    try:
        connection = XArmConnection(client, open_receiver(endpoint, str(parsed), timeout), n)
    except BaseException:
        client.close()
        raise
    driver = XArmDriver(connection, parsed, name)
    try:
        connection.wait(lambda: connection.latest is not None, timeout)
    except BaseException:
        driver.close()
        raise
    return driver


class XArmDriver(LibraryDriver[bytes]):
    """A connection to a UFACTORY controller with the interface of `StreamingDriver`.

    Motions are targets of mode 1, one for every report of 200 Hz: the arm's clock is that of the motion.

    Args:
        connection: The connection.
        address: Address of the controller.
        arm_name: Name of its arm.
    """

    scheme = "xarm"
    resolution = SINGLE_PRECISION
    commands_arm_angle = holds_arm_angle = False
    keeps_newest = reports_load = True
    recovery_silence = 0.0

    def __init__(self, connection: XArmConnection, address: ControllerAddress, arm_name: str) -> None:
        world_port = address.world_port
        super().__init__(connection, arm_name, None if world_port is None else (address.host, world_port))
        self.is_local = address.is_here
        self._link = connection
        self._settings = XArmSettings(connection, arm_name)

    def read_configuration(self) -> RobotConfiguration:
        """Returns the load and the boundary of the tool that are set."""
        return RobotConfiguration(load=self._settings.load, box=self._settings.read_boundary())

    def open_commands(self, arm: ConfiguredArm, lock: RequestLock) -> XArmSessionCommands:
        """Returns the commands of the interface for a session."""
        return XArmSessionCommands(self._link, arm, lock)

    def power(self, on: bool, *, alongside: bool = False) -> None:
        """Switches the motors on or off; on, the arm is ready for motions in mode 0."""
        link, client = self._link, self._link.client
        if alongside:
            client.request("motion_enable", client.api.motion_enable, on)
            return
        link.ask(client.request, "motion_enable", client.api.motion_enable, on)
        if on:
            link.ask(client.enter, READY_MODE)
        link.wait(lambda: client.is_enabled is on, _SWITCHED)

    def is_powered(self, *, alongside: bool = False) -> bool:
        """Returns whether the motors of all joints are on, by a slow report: the newest one if `alongside`."""
        if not alongside:
            self._link.wait_for_slow_report()
        return self._link.client.is_enabled

    def recover(self) -> None:
        """Clears error and warning, switches the motors on, and returns once the arm stands, ready in mode 0.

        Raises:
            DeadlineError: The error remains.
        """
        link, client = self._link, self._link.client
        link.ask(client.request, "clean_error", client.api.clean_error)
        link.ask(client.request, "clean_warn", client.api.clean_warn)
        link.error = link.ask(client.read_error)
        if link.error:
            text = describe_error(link.error)
            raise DeadlineError(f"{self.name}: {text}; it did not clear: remove its cause first").coded(
                "still_set", faults=f"C{link.error}"
            )
        self.power(True)
        link.wait(lambda: link.shown.state < STOPPED and link.is_still, _RECOVERED)  # It may still brake.

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration."""
        send_configuration(self._settings, configuration)

    def with_tool(self, model: RobotModel) -> RobotModel:
        """Returns the model with the controller's tool and load; warns if those of the model are others."""
        settings = self._settings
        model = with_reported_tool(model, settings.tool, self.name)
        return with_reported_load(model, settings.load, self.name)

    def start_guiding(self, space: GuideSpace, kind: GuideKind) -> None:
        """Frees the arm for hand guiding (mode 2); only all directions are free at once.

        Raises:
            ModelError: Some directions are to be blocked.
        """
        if space == "cartesian" and kind != "free":
            raise ModelError("UFACTORY's interface frees the whole arm for hand guiding: it blocks no direction")
        self._link.ask(self._link.client.enter, TEACH_MODE)

    def stop_guiding(self) -> None:
        """Ends hand guiding; returns once the arm stands still."""
        self._link.ask(self._link.client.enter, READY_MODE)
        self._link.wait(lambda: self._link.shown.mode == READY_MODE and self._link.shown.state == READY, _REACTION)

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output of the control box."""
        self._settings.set_output(signal, level)

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input of the control box."""
        return self._settings.read_input(signal)

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Sends a request for a digital signal during a motion."""
        return self._settings.ask_signal(signal, level)

    def reboot(self) -> None:
        """Raises an error: the request would also restart what else runs on the control box.

        Raises:
            ModelError: Always.
        """
        raise ModelError("rcilab does not restart UFACTORY's control box: switch it off and on")

    def close(self) -> None:
        """Ends the connection; stops a motion of `robot.xarm` that is in progress. May be called twice."""
        self._settings.close()
        self._link.close()

    def begin(self, mode: ControllerMode) -> None:
        """Enters mode 1.

        Raises:
            InvalidValueError: It is not a mode for motions.
            CommandRejectedError: The arm is not ready, or a motion is paused; the message has the reason.
        """
        if mode is not ControllerMode.JOINT_POSITION:
            raise InvalidValueError("mode", mode, "is not a mode to move in; there is JOINT_POSITION")
        self._settings.require_not_paused("the motion")
        self._link.ask(self._link.client.enter, SERVO_MODE)
        self._link.client.hurry(True)
        self._link.is_streaming = True

    def has_begun(self, state: RobotState) -> bool:
        """Returns whether a state shows mode 1, ready for targets."""
        return state.controller_mode is ControllerMode.JOINT_POSITION

    def is_streaming(self, state: RobotState) -> bool:
        """Returns whether a state shows that the controller follows targets."""
        return state.controller_mode is ControllerMode.JOINT_POSITION

    def send(self, state: RobotState, command: Command) -> None:
        """Sends the target that answers a state."""
        assert isinstance(command, JointPosition)  # The only mode.
        self._settings.servo(command.q)

    def end(self, timeout: float | None = None) -> None:
        """Leaves mode 1 once the arm stands at the last target; an arm that is stopped stays so."""
        link, client = self._link, self._link.client
        link.is_streaming = False
        client.hurry(False)
        link.wait(lambda: link.is_still or link.shown.state not in (MOVING, READY), _ARRIVED)
        is_ready = link.shown.state in (MOVING, READY)
        link.ask(client.request, "set_mode", client.api.set_mode, READY_MODE)
        if is_ready:
            link.ask(client.request, "set_state", client.api.set_state, 0)

    def find_safety_stop(self, state: RobotState) -> SafetyStopReason | None:
        """Returns the emergency stop if a state shows it."""
        if state.robot_mode is not RobotMode.USER_STOPPED:
            return None
        return SafetyStopReason("estop", "the emergency stop is pressed: release it, then recover()")

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

    def open_filter(self, limits: Limits, table: str, cut_off: float | None) -> CommandFilter | None:
        """Returns None: rcilab's filters apply."""
        return None

    describe_faults = staticmethod(describe_faults)
