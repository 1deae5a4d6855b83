"""The interface of a robot's driver for session and control process, and the choice of the maker by the address."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.arrays import JointVector, described
from rcilab.core.command import Command, CommandFilter
from rcilab.core.errors import ConnectionLostError, DeadlineError, InvalidValueError, UsageError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import ControllerMode, RobotState
from rcilab.i18n.translator import Remark
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.maker import Maker, all_makers, capabilities_of
from rcilab.robots import DhRow

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.model.robot_model import RobotModel
    from rcilab.motion.motion_event import MotionEvent

GuideSpace: TypeAlias = Literal["joint", "cartesian"]
"""Space of the constraints of hand guiding; in joint space they have no effect."""
GuideKind: TypeAlias = Literal["free", "translation", "rotation"]
"""The free directions in Cartesian space."""


class RobotAddress(Protocol):
    """A parsed address; `str()` is its normal form."""

    @property
    def host(self) -> str:
        """Name or IPv4 address."""
        ...

    @property
    def port(self) -> int:
        """TCP port of the controller."""
        ...

    @property
    def is_here(self) -> bool:
        """Whether it is a loopback address: a virtual controller on this machine."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedArm:
    """The arm that motions are planned for, to compare with the one at the controller."""

    name: str
    maker: str
    """Name of its maker's folder."""
    n: int
    lengths: tuple[tuple[float, float], ...]
    """Denavit-Hartenberg a and d, one pair per joint, [m]."""

    @classmethod
    def of(cls, model: RobotModel) -> ExpectedArm:
        """Returns the data that identify the arm of a model."""
        dh: tuple[DhRow, ...] = tuple(model.description.dh)
        return cls(
            name=model.name, maker=model.description.maker, n=model.n, lengths=tuple((row.a, row.d) for row in dh)
        )


@dataclass(slots=True, kw_only=True)
class ConfiguredArm:
    """The configuration that a session has sent to its robot; changed only with the session's lock."""

    model: RobotModel
    """The arm, with tool, load and soft limits."""
    safety_box: SafetyBox | None = None
    collision_thresholds: JointVector | None = None
    """Shape (n,), [N m]."""
    cell: Cell | None = None
    """The cell that motions are checked with; not sent."""


@dataclass(frozen=True, slots=True)
class SafetyStopReason:
    """The safety stop that stops an arm."""

    code: str
    """Key of its texts: `status.CODE`."""
    sentence: str
    """Its name and remedy."""


@dataclass(frozen=True, slots=True)
class FaultReport:
    """The diagnosis of the faults that ended a motion."""

    sentence: str
    """The full sentence, with the remedy."""
    advice: str
    """What to do next in Python."""
    finding: Remark
    """Joint, value and bound, for user interfaces; empty if unknown."""


class RequestLock(Protocol):
    """The lock of a connection: a session's `SessionLock`."""

    def acquire(self, what: str) -> AbstractContextManager[None]:
        """Acquires the connection; raises UsageError while a motion is running."""
        ...

    def acquire_unless_moving(self) -> AbstractContextManager[bool]:
        """Acquires the connection, or yields False while a motion is running."""
        ...

    def move(self, stop: Callable[[], object]) -> AbstractContextManager[None]:
        """Surrounds the wait for a motion that the controller plans, inside `acquire`; `stop` stops it."""
        ...

    def close(self) -> None:
        """Ends the connection."""
        ...


class MakerCommands(Protocol):
    """The maker's own commands in a session, `robot.rci` over RCI; they keep the `ConfiguredArm` up to date."""

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration."""
        ...

    def set_load(self, mass: float, center_of_mass: ArrayLike, inertia: ArrayLike) -> None:
        """Sets the load at the flange."""
        ...

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output."""
        ...

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input."""
        ...

    def reboot(self) -> None:
        """Restarts the controller and closes the session."""
        ...


class Driver(Protocol):
    """A connection to a controller. Owned by one thread, except for requests that are sent alongside a motion."""

    scheme: str
    """Scheme of its addresses, and the session's attribute for its own commands."""
    name: str
    """Name of the controller in errors: its address."""
    n: int
    """Number of joints."""
    arm_name: str
    """Name of the arm at the other end."""
    is_local: bool
    """Whether the controller is on this machine."""
    simulation_address: tuple[str, int] | None
    """Simulation port of a virtual controller; None: not known, or a real robot."""
    resolution: float
    """Largest rounding of commanded positions in states, [rad] or [m]; 0: they return as they were sent."""
    commands_arm_angle: bool
    """Whether poses can be sent with an arm angle; if not, the controller chooses it."""
    holds_arm_angle: bool
    """Whether the controller holds its arm angle while none is sent; if not, the joints move as little as possible."""
    keeps_newest: bool
    """Whether `poll` returns the newest state only, so that those that arrive between two calls are missing."""
    reports_load: bool
    """Whether `with_tool` returns a model with the controller's load, too."""
    recovery_silence: float
    """Longest time for which `recover` may keep the whole process from running, [s]; 0: it does not."""
    on_states: Callable[[list[RobotState]], None]
    """Called with the states that arrive while the answer to a request is awaited, at least every 0.05 s."""
    poll: Callable[[float], list[RobotState]]
    """`poll(timeout)` returns every state that has arrived, oldest first; waits up to timeout, [s], for the first."""

    def read_configuration(self) -> RobotConfiguration:
        """Returns what the controller reports of the configuration that a client sets; None for what it does not."""
        ...

    @property
    def latest(self) -> RobotState | None:
        """The newest state."""
        ...

    @property
    def received_ns(self) -> int:
        """When it arrived, monotonic, [ns]."""
        ...

    @property
    def age(self) -> float:
        """Upper bound of its age, [s]."""
        ...

    def open_commands(self, arm: ConfiguredArm, lock: RequestLock) -> MakerCommands:
        """Returns the maker's own commands for a session."""
        ...

    def power(self, on: bool, *, alongside: bool = False) -> None:
        """Switches motor power; `alongside`: from another thread than the motion's."""
        ...

    def is_powered(self, *, alongside: bool = False) -> bool:
        """Returns whether motor power is on; `alongside`: from another thread than the motion's, or its callback."""
        ...

    def recover(self) -> None:
        """Clears the controller's faults and returns once they are gone."""
        ...

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration; the arm must stand still."""
        ...

    def with_tool(self, model: RobotModel) -> RobotModel:
        """Returns the model with the controller's tool; warns if that is another one."""
        ...

    def start_guiding(self, space: GuideSpace, kind: GuideKind) -> None:
        """Frees the arm for hand guiding."""
        ...

    def stop_guiding(self) -> None:
        """Ends hand guiding; returns once the arm stands still."""
        ...

    def set_output(self, signal: int, level: bool) -> None:
        """Sets a digital output."""
        ...

    def read_input(self, signal: int) -> bool:
        """Returns the level of a digital input."""
        ...

    def reboot(self) -> None:
        """Restarts the controller."""
        ...

    def close(self) -> None:
        """Ends the connection. May be called twice."""
        ...


class SignalRequest(Protocol):
    """A request for a digital signal that was sent during a motion."""

    def poll(self) -> bool | None:
        """Returns the level of an input, True for an output that is set, or None until the answer; never waits.

        Raises:
            CommandRejectedError: The controller refuses.
            ConnectionLostError: The connection is lost.
        """
        ...


class StreamingDriver(Driver, Protocol):
    """A driver that sends a command for every state."""

    def ask_signal(self, signal: int, level: bool | None = None) -> SignalRequest:
        """Sends a request for an input, or sets an output to a level; during a motion, and never waits.

        Raises:
            InvalidValueError: There is no such signal.
            ModelError: The interface has no signals.
        """
        ...

    def begin(self, mode: ControllerMode) -> None:
        """Asks the controller to start a motion in a mode."""
        ...

    def has_begun(self, state: RobotState) -> bool:
        """Returns whether a state shows the mode of `begin`."""
        ...

    def is_streaming(self, state: RobotState) -> bool:
        """Returns whether a state shows that the motion is still in progress; cheap enough for every cycle."""
        ...

    def send(self, state: RobotState, command: Command) -> None:
        """Sends the command that answers a state."""
        ...

    def end(self, timeout: float | None = None) -> None:
        """Ends the motion; `timeout` for the answer, [s]; None: that of every request."""
        ...

    def find_safety_stop(self, state: RobotState) -> SafetyStopReason | None:
        """Returns the safety stop that a state shows, or None."""
        ...

    def is_lack_of_commands(self, faults: tuple[Any, ...]) -> bool:
        """Returns whether one of the faults means that commands came too late or not at all."""
        ...

    def select_limits(self, limits: Limits, table: str) -> Limits:
        """Returns the limits with the tool's bounds of a table: "manual", or another that the maker publishes."""
        ...

    def open_filter(self, limits: Limits, table: str, cut_off: float | None) -> CommandFilter | None:
        """Returns low pass and rate limiter of the maker's client library for a table; None: rcilab's apply to it.

        Args:
            limits: The arm's.
            table: See `select_limits`.
            cut_off: Cut-off frequency of the low pass, [Hz]; None: no low pass.
        """
        ...

    def describe_faults(
        self,
        faults: tuple[Any, ...],
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
        """Returns the diagnosis of the faults that ended a motion.

        Args:
            faults: The faults that the controller reported.
            record: The last cycles, see `cycle_dtype`.
            t: Motion time of the state with the faults, [s]; NaN before the first command.
            model: The arm with its tool and load.
            limits: Its bounds.
            mode: The command mode.
            late: The delay by a slow callback, as a sentence; "" for none.
            pressed: The safety stop that ended the motion, as a sentence; "" for none.
            box: The controller's safety box, if it is known.
            collision_thresholds: Its collision thresholds, shape (n,), [N m], if they are known.
        """
        ...


def open_driver(address: str, timeout: float, expected: ExpectedArm | None) -> StreamingDriver:
    """Returns a connection to the controller at an address, once its first state has arrived.

    Args:
        address: The address; its scheme chooses the maker.
        timeout: For the connection, the first state and every answer, [s].
        expected: The expected arm; None accepts any.

    Raises:
        ConnectionLostError: The controller does not answer, or sends no states.
        ModelError: It has another arm, or an unknown one.
        InvalidValueError: The address is not valid.
    """
    maker = _maker_at(address, None if expected is None else expected.maker)
    try:
        return maker.open_driver(address, timeout, expected)
    except (DeadlineError, ConnectionLostError) as error:
        is_silent = isinstance(error, DeadlineError) or error.code == "other_protocol"
        other = _other_maker_at(maker, maker.parse_address(address)) if is_silent else None
        if other is None:
            raise
        raise ConnectionLostError(
            f"{error}; if it is an arm of {other.title}, its address begins with {other.scheme}://"
        ).coded("other_scheme", cause=error, maker=other.title, scheme=f"{other.scheme}://") from error


def parse_address(address: str, model: RobotModel | None = None) -> RobotAddress:
    """Returns the parts of the address of a controller; `str` returns it with scheme and port.

    Args:
        address: With the scheme of a maker; without one, it is of the model's maker.
        model: The arm at the address; None if it is unknown.

    Raises:
        InvalidValueError: It is not a valid address, or that of another maker's controller.
    """
    return _maker_at(address, None if model is None else model.description.maker).parse_address(address)


def require_signals(events: Sequence[MotionEvent], model: RobotModel) -> None:
    """Requires that the arm's controller has the digital signals of a motion's events.

    Raises:
        UsageError: It has not.
    """
    has = capabilities_of(model)
    for event in events:
        kind = "output" if event.kind == "output" else "input"
        names = has.outputs if kind == "output" else has.inputs
        if event.signal >= len(names):
            there = f"there are {kind}s 0 to {len(names) - 1}" if names else f"its interface has no digital {kind}s"
            step = f"step {event.row}: " if event.row else ""
            raise UsageError(f"{step}{kind} {event.signal} of {model.name} does not exist; {there}").coded(
                "no_such_signal",
                number=event.row,
                kind=kind,
                signal=event.signal,
                model=model.name,
                last=len(names) - 1,
            )


def require_signal(signal: object, names: Sequence[str]) -> int:
    """Returns the number of a digital signal.

    Args:
        signal: The number or name.
        names: The names of all signals, see `Capabilities`.

    Raises:
        InvalidValueError: There is no such signal.
    """
    if isinstance(signal, bool) or not isinstance(signal, int) or not 0 <= signal < len(names):
        raise InvalidValueError("signal", described(signal), f"does not exist; there are 0 to {len(names) - 1}")
    return signal


def require_timeout(timeout: object) -> None:
    """Checks that a timeout is a finite number above 0, [s].

    Raises:
        InvalidValueError: It is not.
    """
    is_number = isinstance(timeout, int | float) and not isinstance(timeout, bool) and math.isfinite(timeout)
    if not is_number:
        raise InvalidValueError("timeout", timeout, "must be a finite number above 0 [s]")
    if timeout <= 0:  # type: ignore[operator]  # A number, see above.
        raise InvalidValueError("timeout", timeout, "must be above 0 [s]")


def _maker_at(address: object, name: str | None) -> Maker:
    """Returns the maker of an address; without a scheme, the one of this name, or the only one."""
    drivable = [maker for maker in all_makers() if maker.capabilities.drives]
    possible = [maker for maker in drivable if maker.name == name] or drivable
    scheme, mark, _ = address.strip().partition("://") if isinstance(address, str) else ("", "", "")
    found = [maker for maker in possible if not mark or maker.scheme == scheme.lower()]
    if len(found) == 1:
        return found[0]
    schemes = ", ".join(f"{maker.scheme}:// ({maker.title})" for maker in possible)
    problem = f"begins with {scheme}://" if mark else "has no scheme"
    raise InvalidValueError("address", described(address), f"{problem}, needs {schemes}")


def _other_maker_at(maker: Maker, address: RobotAddress) -> Maker | None:
    """Returns another maker whose controllers answer at the port of an address, if there is one."""
    others = [other for other in all_makers() if other.capabilities.drives and other is not maker]
    return next(
        (other for other in others if other.parse_address(f"{other.scheme}://{address.host}").port == address.port),
        None,
    )
