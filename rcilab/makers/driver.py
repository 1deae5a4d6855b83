"""What a session and the control process need of a robot's driver, and which maker's driver an address belongs to."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.arrays import JointVector, described
from rcilab.core.command import Command
from rcilab.core.errors import InvalidValueError
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import ControllerMode, RobotState
from rcilab.makers.configuration import RobotConfiguration
from rcilab.makers.maker import Maker, find_scheme
from rcilab.robots import DhRow

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

SIGNALS = range(6)
"""Digital outputs, and as many inputs. RCI manual 3.1.13: DO0_0 to DO0_3, DO1_0, DO1_1; 3.1.14 the same for inputs."""

LimitTable: TypeAlias = Literal["manual", "sdk"]
"""Which published bounds of the tool: those of the maker's manual, or of its client library."""
GuideSpace: TypeAlias = Literal["joint", "cartesian"]
"""Where constraints of hand guiding hold; without effect in joint space."""
GuideKind: TypeAlias = Literal["free", "translation", "rotation"]
"""What stays free in Cartesian space."""

_DEFAULT_SCHEME = "rci"  # Of an address without one; also says what is wrong with an address of an unknown scheme.


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
    """The arm that motions will be planned for, to compare with the one that the controller moves."""

    name: str
    n: int
    lengths: tuple[tuple[float, float], ...]
    """Denavit-Hartenberg a and d, one pair a joint, [m]."""

    @classmethod
    def of(cls, model: RobotModel) -> ExpectedArm:
        """Returns what identifies the arm of a model."""
        dh: tuple[DhRow, ...] = tuple(model.description.dh)
        return cls(name=model.name, n=model.n, lengths=tuple((row.a, row.d) for row in dh))


@dataclass(slots=True, kw_only=True)
class ConfiguredArm:
    """What a session has configured on its robot; changed only with the session's lock."""

    model: RobotModel
    """The arm, with tool, load and soft limits."""
    safety_box: SafetyBox | None = None
    collision_thresholds: JointVector | None = None
    """Shape (n,), [N m]."""


@dataclass(frozen=True, slots=True)
class SafetyStopReason:
    """Which safety stop holds an arm."""

    code: str
    """Names it for catalogues: `status.CODE`."""
    sentence: str
    """What it is and what to do."""


class RequestLock(Protocol):
    """Decides who may send a request now; a session's `SessionLock`."""

    def take(self, what: str) -> AbstractContextManager[None]:
        """Takes the connection; raises UsageError while a motion runs."""
        ...

    def take_unless_moving(self) -> AbstractContextManager[bool]:
        """Takes the connection, or gives False while a motion runs."""
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


class Driver(Protocol):
    """A connection to a controller. Owned by one thread, but for requests that are sent alongside a motion."""

    scheme: str
    """Of its addresses, and the session's attribute for its own commands."""
    name: str
    """What errors call the other end: its address."""
    n: int
    """Number of joints."""
    arm_name: str
    """Name of the arm at the other end."""
    is_local: bool
    """Whether the controller is on this machine."""
    simulation_address: tuple[str, int] | None
    """Simulation port of a virtual controller; None: not known, or a real robot."""
    on_states: Callable[[list[RobotState]], None]
    """Called with the states that arrive while the answer to a request is awaited, at least every 0.05 s."""
    poll: Callable[[float], list[RobotState]]
    """`poll(timeout)` returns every state that has arrived, oldest first; waits up to timeout, [s], for the first."""

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
        """How long ago it was sent, at most, [s]."""
        ...

    @property
    def has_listener(self) -> bool:
        """Whether `on_states` is set."""
        ...

    def open_commands(self, arm: ConfiguredArm, lock: RequestLock) -> MakerCommands:
        """Returns the maker's own commands for a session."""
        ...

    def power(self, on: bool, *, alongside: bool = False) -> None:
        """Switches motor power; `alongside`: from another thread than the motion's."""
        ...

    def is_powered(self) -> bool:
        """Returns whether motor power is on."""
        ...

    def recover(self) -> None:
        """Clears the controller's faults and returns once they are gone."""
        ...

    def configure(self, configuration: RobotConfiguration) -> None:
        """Sends a configuration; nothing may move meanwhile."""
        ...

    def with_tool(self, model: RobotModel) -> RobotModel:
        """Returns the model with the tool that the controller has; warns where that is another one."""
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


class StreamingDriver(Driver, Protocol):
    """A driver that is sent a command for every state."""

    def begin(self, mode: ControllerMode) -> None:
        """Asks the controller to begin a motion in a mode."""
        ...

    def has_begun(self, state: RobotState) -> bool:
        """Returns whether a state shows the mode of `begin`."""
        ...

    def is_streaming(self, state: RobotState) -> bool:
        """Returns whether a state shows that commands are still followed; cheap enough for every cycle."""
        ...

    def send(self, state: RobotState, command: Command) -> None:
        """Sends the command that answers a state."""
        ...

    def end(self, timeout: float | None = None) -> None:
        """Ends the motion; `timeout` for the answer, [s]; None: as for every request."""
        ...

    def find_safety_stop(self, state: RobotState) -> SafetyStopReason | None:
        """Returns which safety stop a state shows; None: no safety stop."""
        ...

    def is_lack_of_commands(self, faults: tuple[Any, ...]) -> bool:
        """Returns whether one of the faults means that commands came too late or not at all."""
        ...

    def select_limits(self, limits: Limits, table: LimitTable) -> Limits:
        """Returns the limits with the tool's bounds of a table: "manual", or another that the maker publishes."""
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
    ) -> str:
        """Returns the message of the error that a motion with these faults ends with.

        Args:
            faults: What the controller reported.
            record: The last cycles, see `cycle_dtype`.
            t: Motion time of the state with the faults, [s]; NaN before the first command.
            model: The arm with its tool and load.
            limits: Its bounds.
            mode: How it was commanded.
            late: What a slow callback did, in a sentence; "" for nothing.
            pressed: Which safety stop ended the motion, in a sentence; "" for none.
            box: The safety box that the controller has, as far as it is known.
            collision_thresholds: Its collision thresholds, shape (n,), [N m], as far as they are known.
        """
        ...


def open_driver(address: str, timeout: float, expected: ExpectedArm | None) -> StreamingDriver:
    """Returns a connection to the controller at an address, once its first state has arrived.

    Args:
        address: Its scheme chooses the maker.
        timeout: For the connection, the first state and every answer, [s].
        expected: The arm that must be there; None takes the one that is.

    Raises:
        ConnectionLostError: The controller does not answer, or sends no states.
        ModelError: It moves another arm, or one that is not known.
        InvalidValueError: The address is not valid.
    """
    return _maker_at(address).open_driver(address, timeout, expected)


def parse_address(address: str) -> RobotAddress:
    """Returns the parts of an address of any maker's controller.

    Raises:
        InvalidValueError: It is not a valid address.
    """
    return _maker_at(address).parse_address(address)


def normalise_address(address: str) -> str:
    """Returns an address with scheme and port written out.

    Raises:
        InvalidValueError: It is not a valid address.
    """
    return str(parse_address(address))


def require_signal(signal: object) -> int:
    """Returns the number of a digital signal, 0 to 5.

    Raises:
        InvalidValueError: There is no such signal.
    """
    if isinstance(signal, bool) or not isinstance(signal, int) or signal not in SIGNALS:
        raise InvalidValueError("signal", described(signal), "does not exist; there are 0 to 5")
    return signal


def require_timeout(timeout: object) -> None:
    """Makes sure that a timeout is a finite number above 0, [s].

    Raises:
        InvalidValueError: It is not.
    """
    is_number = isinstance(timeout, int | float) and not isinstance(timeout, bool) and math.isfinite(timeout)
    if not is_number:
        raise InvalidValueError("timeout", timeout, "must be a finite number above 0 [s]")
    if timeout <= 0:  # type: ignore[operator]  # A number, see above.
        raise InvalidValueError("timeout", timeout, "must be above 0 [s]")


def _maker_at(address: object) -> Maker:
    scheme = address.strip().partition("://")[0] if isinstance(address, str) and "://" in address else ""
    maker = find_scheme(scheme)
    if maker is None or not maker.capabilities.drives:
        maker = find_scheme(_DEFAULT_SCHEME)
    assert maker is not None
    return maker
