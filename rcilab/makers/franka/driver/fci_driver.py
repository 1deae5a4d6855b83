"""The driver of Franka's interface: a neutral `StreamingDriver` over one of the maker's client libraries."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import JointVector
from rcilab.core.command import Command, CommandFilter
from rcilab.core.errors import CommandRejectedError, InvalidValueError, ModelError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState
from rcilab.makers.address import ControllerAddress
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.driver import (
    ConfiguredArm,
    ExpectedArm,
    FaultReport,
    GuideKind,
    GuideSpace,
    RequestLock,
    SafetyStopReason,
    SignalRequest,
)
from rcilab.makers.franka.collisions import describe_collisions
from rcilab.makers.franka.driver.active_client import ActiveClient
from rcilab.makers.franka.driver.address import parse_address
from rcilab.makers.franka.driver.callback_client import CallbackClient
from rcilab.makers.franka.driver.client import FciClient
from rcilab.makers.franka.driver.configuration import send_configuration
from rcilab.makers.franka.driver.fault_report import describe_faults
from rcilab.makers.franka.driver.handshake import find_version
from rcilab.makers.franka.driver.libraries import arm_of, load_client_library, version_of
from rcilab.makers.franka.driver.rate_limiter import LOST_CYCLES, LibfrankaFilter
from rcilab.makers.franka.driver.session_commands import FciSessionCommands
from rcilab.makers.franka.driver.settings import FciSettings, find_reason, refusal_of
from rcilab.makers.franka.driver.state_reader import StateReader
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.limit_tables import cartesian_limits, require_table
from rcilab.makers.known_setup import with_reported_load, with_reported_tool
from rcilab.model.dynamics.payload import combine_payloads

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_NEWEST = 10
"""Version that is asked for where the arm is not known."""
_CLIENTS: dict[int, Callable[[ControllerAddress], FciClient]] = {5: CallbackClient, 10: ActiveClient}
_GENERATORS = {
    ControllerMode.JOINT_POSITION: MotionGeneratorMode.JOINT_POSITION,
    ControllerMode.JOINT_IMPEDANCE: MotionGeneratorMode.JOINT_POSITION,
    ControllerMode.CARTESIAN_POSITION: MotionGeneratorMode.CARTESIAN_POSITION,
    ControllerMode.CARTESIAN_IMPEDANCE: MotionGeneratorMode.CARTESIAN_POSITION,
    ControllerMode.TORQUE: MotionGeneratorMode.IDLE,
}
_FRESH = 0.1  # [s] For a state that is sent after a call.
_IDLE = ControllerMode.OTHER, MotionGeneratorMode.IDLE
_UNPOWERED = (RobotMode.USER_STOPPED, RobotMode.OTHER)


def open_driver(address: str, timeout: float, expected: ExpectedArm | None) -> FciDriver:
    """Returns a connection to a Franka controller; see `rcilab.makers.driver.open_driver`."""
    parsed = parse_address(address)
    version = _NEWEST if expected is None else version_of(expected.name)
    if expected is not None:
        load_client_library(version)  # A missing library is reported also where no controller answers.
    found = find_version(parsed, version, timeout)
    name = arm_of(found, parsed)
    if expected is not None and name != expected.name:
        raise ModelError(
            f"the controller at {parsed} has version {found} of Franka's interface, which is that of the {name}, you "
            f"gave {expected.name}; leave model out, or load_model({name!r})"
        ).coded("other_arm", address=str(parsed), theirs=name, ours=expected.name)
    return FciDriver(_CLIENTS[found](parsed), parsed, name)


class FciDriver:
    """A connection to a Franka controller with the interface of `StreamingDriver`.

    The client libraries keep the newest state only: while this process is late, states are lost. No state is read while
    they wait for the answer of a request.

    Args:
        client: The connection.
        address: Address of the controller.
        arm_name: Name of its arm.
    """

    scheme = "fci"
    holds_arm_angle = False
    keeps_newest = reports_load = True
    recovery_silence = 10.0  # The library holds Python's global lock until the arm has recovered, which takes seconds.

    def __init__(self, client: FciClient, address: ControllerAddress, arm_name: str) -> None:
        self.name = str(address)
        self.n = 7
        self.arm_name = arm_name
        self.is_local = address.is_here
        self.simulation_address = None if address.world_port is None else (address.host, address.world_port)
        self.resolution = client.resolution
        self.commands_arm_angle = client.commands_elbow
        self.on_states: Callable[[list[RobotState]], None] = lambda states: None
        self.received_ns = self._empty_ns = self._latest_since_ns = time.monotonic_ns()
        self._client = client
        self._settings = FciSettings(client, self.name)
        self._reader = StateReader()
        self._shown = _IDLE
        self._latest = self._reader.read(client.newest, *_IDLE)

    def read_configuration(self) -> RobotConfiguration:
        """Returns the load of `set_load`, without the end effector that is set in Desk."""
        return RobotConfiguration(load=self._settings.load)

    @property
    def latest(self) -> RobotState | None:
        """The newest state."""
        return self._latest

    @property
    def age(self) -> float:
        """Upper bound of the newest state's age: since the buffer was last empty before it arrived, [s]."""
        return (time.monotonic_ns() - self._latest_since_ns) * 1e-9

    def poll(self, timeout: float) -> list[RobotState]:
        """Returns the newest state if one arrives within a timeout, [s]."""
        raw = self._client.poll(0.0)
        if raw is None:
            self._empty_ns = time.monotonic_ns()
            raw = self._client.poll(timeout) if timeout > 0.0 else None
            if raw is None:
                return []
        self._latest_since_ns = self._empty_ns
        self.received_ns = self._empty_ns = time.monotonic_ns()
        is_shown = self._client.is_moving and int(raw.robot_mode) == RobotMode.MOVE
        self._latest = self._reader.read(raw, *(self._shown if is_shown else _IDLE))
        return [self._latest]

    def open_commands(self, arm: ConfiguredArm, lock: RequestLock) -> FciSessionCommands:
        """Returns the requests of libfranka for a session."""
        return FciSessionCommands(self._client, self.name, arm, lock)

    def power(self, on: bool, *, alongside: bool = False) -> None:
        """Checks that the arm is ready for a motion; the interface cannot switch motor power.

        Raises:
            CommandRejectedError: It is not ready, and the reason; or the power is to be switched off.
        """
        if not on:
            raise CommandRejectedError(
                "power_off",
                "the interface cannot switch motor power",
                "press the user stop, or lock the joints in Desk",
                reason="no_power_off",
            )
        for timeout in (0.0, _FRESH):  # The newest state may be from before the user stop was released.
            self.on_states(self.poll(timeout))
        if not self.is_powered():
            reason = find_reason(self._client)
            assert reason is not None  # Both modes have one.
            raise refusal_of("power_on", reason)

    def is_powered(self, *, alongside: bool = False) -> bool:
        """Returns whether the joints are unlocked and no user stop is pressed, by the newest state."""
        if not (alongside or self._client.is_moving):
            self.on_states(self.poll(0.0))
        return self._latest.robot_mode not in _UNPOWERED

    def recover(self) -> None:
        """Clears the controller's errors and returns once they are gone."""
        self._settings.automatic_error_recovery()
        self.on_states(self.poll(0.0))

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration."""
        send_configuration(self._settings, configuration)

    def with_tool(self, model: RobotModel) -> RobotModel:
        """Returns the model with the controller's end effector and load; warns if those of the model are others."""
        settings = self._settings
        model = with_reported_tool(model, settings.tool, self.name)
        return with_reported_load(model, combine_payloads(settings.end_effector, settings.load), self.name)

    def start_guiding(self, space: GuideSpace, kind: GuideKind) -> None:
        """Raises an error: the arm is guided with the buttons at its hand.

        Raises:
            ModelError: Always.
        """
        raise ModelError("Franka's interface does not start hand guiding: press the buttons at the hand")

    def stop_guiding(self) -> None:
        """Has no effect: see `start_guiding`."""

    def set_output(self, signal: int, level: bool) -> None:
        """Raises an error: there are no digital signals.

        Raises:
            ModelError: Always.
        """
        raise ModelError("Franka's interface has no digital signals")

    def read_input(self, signal: int) -> bool:
        """Raises an error: there are no digital signals.

        Raises:
            ModelError: Always.
        """
        raise ModelError("Franka's interface has no digital signals")

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Raises an error: there are no digital signals.

        Raises:
            ModelError: Always.
        """
        raise ModelError("Franka's interface has no digital signals")

    def reboot(self) -> None:
        """Raises an error: there is no such request.

        Raises:
            ModelError: Always.
        """
        raise ModelError("Franka's interface has no restart on request")

    def close(self) -> None:
        """Ends the connection."""
        self._client.close()

    def begin(self, mode: ControllerMode) -> None:
        """Begins a motion (Move), and returns once the controller has begun it.

        It returns also if a fault has ended the motion since, such as a reflex: the next states show it.

        Raises:
            InvalidValueError: It is not a mode for motions.
        """
        if mode not in _GENERATORS:
            known = [known.name for known in _GENERATORS]
            raise InvalidValueError("mode", mode, f"is not a mode to move in; there are {known}")
        self.poll(0.0)
        was_faulty = bool(self._latest.faults)
        try:
            self._client.begin(mode)
        except CommandRejectedError as refusal:
            for timeout in (0.0, _FRESH):  # The newest state may be from before the refusal.
                self.poll(timeout)
            reason = find_reason(self._client)
            if reason is None:
                raise
            if was_faulty or not self._latest.faults:
                raise refusal_of("Move", reason) from refusal.__cause__
        self._shown = mode, _GENERATORS[mode]

    def has_begun(self, state: RobotState) -> bool:
        """Returns whether a state shows the motion of `begin`."""
        return state.controller_mode is self._shown[0]

    def is_streaming(self, state: RobotState) -> bool:
        """Returns whether a state shows that the motion is in progress."""
        return state.controller_mode is self._shown[0]

    def send(self, state: RobotState, command: Command) -> None:
        """Sends the command that answers a state."""
        self._client.send(command)

    def end(self, timeout: float | None = None) -> None:
        """Ends the motion at its last command, or by StopMove before the first one."""
        self._client.end()

    def find_safety_stop(self, state: RobotState) -> SafetyStopReason | None:
        """Returns the user stop if a state shows it."""
        if state.robot_mode is not RobotMode.USER_STOPPED:
            return None
        return SafetyStopReason("user_stopped", "the user stop is pressed: release it first")

    def is_lack_of_commands(self, faults: tuple[Any, ...]) -> bool:
        """Returns whether the controller lacked commands."""
        return FrankaError.COMMUNICATION_CONSTRAINTS_VIOLATION in faults

    def select_limits(self, limits: Limits, table: str) -> Limits:
        """Returns the limits with the tool's bounds of the page ("manual"), or of the client library ("sdk")."""
        return cartesian_limits(limits, table)

    def open_filter(self, limits: Limits, table: str, cut_off: float | None) -> CommandFilter | None:
        """Returns libfranka's filters for "sdk"."""
        if require_table(table) != "sdk":
            return None
        return LibfrankaFilter(limits, LOST_CYCLES[version_of(self.arm_name)], cut_off)

    def describe_faults(
        self,
        faults: Iterable[FrankaError],
        record: NDArray[np.void],
        t: float,
        model: RobotModel,
        limits: Limits,
        mode: ControllerMode,
        *,
        late: str = "",
        pressed: str = "",
        box: SafetyBox | None = None,
        collision_thresholds: JointVector | None = None,
    ) -> FaultReport:
        """Returns the diagnosis of the faults that ended a motion; those of a reflex are in the newest state."""
        raw = self._client.newest
        collisions = describe_collisions(
            (raw.joint_collision, raw.cartesian_collision),
            raw.tau_ext_hat_filtered,
            raw.K_F_ext_hat_K,
            self._client.thresholds,
        )
        return describe_faults(
            faults, record, t, model, limits, mode, collisions=collisions, late=late, pressed=pressed
        )
