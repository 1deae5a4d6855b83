"""Requests of the simulation port, which only virtual robots have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias, get_args

from rcilab.core.errors import InvalidValueError
from rcilab.sim.api.faults import DIRECTIONS, LONGEST_STALL, LONGEST_TIME, Direction, NetworkFaults, Stall
from rcilab.sim.api.fields import as_flag, as_float, as_floats, as_integer, as_joints, as_name, as_word

Floats: TypeAlias = tuple[float, ...]
SafetyButton: TypeAlias = Literal["none", "estop", "gstop", "switch"]

_BUTTONS: tuple[SafetyButton, ...] = get_args(SafetyButton)
_LARGEST_FORCE = 1e4  # [N], [N m] Far beyond the strength of any arm: it detects wrong units.
_FARTHEST = 100.0  # [m] The same for lengths.
_LAST_SIGNAL = (
    31  # The status of the control process has 32 bits for them; a controller refuses signals that it does not have.
)


@dataclass(frozen=True, slots=True)
class Push:
    """Applies an external force for a duration, or until `Release`. It replaces the previous force."""

    name: ClassVar[str] = "push"
    wrench: Floats
    """Force and moment, base axes, shape (6,), [N, N m]."""
    link: int | None = None
    """Number of the link from 1; None: the tool."""
    point: Floats | None = None
    """Where the force acts, in the frame of the link, shape (3,), [m]; None: at its origin."""
    duration: float | None = None
    """In the controller's own time, [s]; None: until `Release`."""
    rise_time: float = 0.05
    """Time in which the force rises, and falls at its end, [s]; 0: a step. A hand needs at least the default; a step
    accelerates the light wrist of a stiff arm beyond the bound on measured accelerations."""

    def __post_init__(self) -> None:
        """Checks every value."""
        _put(self, "wrench", as_floats(self.wrench, 6, "wrench", "N, N m"))
        largest = max(self.wrench, key=abs)
        if abs(largest) > _LARGEST_FORCE:
            raise InvalidValueError("wrench", largest, f"needs at most {_LARGEST_FORCE:g} [N, N m]")
        if self.link is not None:
            _put(self, "link", as_integer(self.link, "link", 1, 7))
        if self.point is not None:
            _put(self, "point", as_floats(self.point, 3, "point", "m"))
        if self.duration is not None:
            _put(self, "duration", as_float(self.duration, "duration", "s", 0.001, LONGEST_TIME))
        _put(self, "rise_time", as_float(self.rise_time, "rise_time", "s", 0.0, LONGEST_TIME))


@dataclass(frozen=True, slots=True)
class Release:
    """Removes the external force."""

    name: ClassVar[str] = "release"


@dataclass(frozen=True, slots=True)
class Press:
    """Presses an emergency stop, opens the safety gate, or resets all ("none").

    "estop" is the button, "gstop" the gate, "switch" the button of a three-position switch, which UFACTORY's arms have.
    """

    name: ClassVar[str] = "press"
    button: SafetyButton

    def __post_init__(self) -> None:
        """Checks the word."""
        _put(self, "button", as_word(self.button, "button", _BUTTONS))


@dataclass(frozen=True, slots=True)
class Guide:
    """Presses the buttons of the arm that let a hand guide it, or releases them; for arms that have such buttons."""

    name: ClassVar[str] = "guide"
    on: bool

    def __post_init__(self) -> None:
        """Checks it."""
        _put(self, "on", as_flag(self.on, "on"))


@dataclass(frozen=True, slots=True)
class SetInput:
    """Sets a digital input of the controller."""

    name: ClassVar[str] = "set_input"
    signal: int
    """Number of the input, from 0."""
    level: bool

    def __post_init__(self) -> None:
        """Checks both."""
        _put(self, "signal", as_integer(self.signal, "signal", 0, _LAST_SIGNAL))
        _put(self, "level", as_flag(self.level, "level"))


@dataclass(frozen=True, slots=True)
class LoopBack:
    """Wires every digital output to the input of the same number, or removes this wiring."""

    name: ClassVar[str] = "loop_back"
    on: bool

    def __post_init__(self) -> None:
        """Checks it."""
        _put(self, "on", as_flag(self.on, "on"))


@dataclass(frozen=True, slots=True)
class AutoLimit:
    """Stops commands inside the soft joint limits instead of raising a fault, or not."""

    name: ClassVar[str] = "auto_limit"
    on: bool

    def __post_init__(self) -> None:
        """Checks it."""
        _put(self, "on", as_flag(self.on, "on"))


@dataclass(frozen=True, slots=True)
class Limits:
    """Chooses the Cartesian limits that commands are checked against: the manual's, or those of the vendor's SDK."""

    name: ClassVar[str] = "limits"
    table: str
    """Name of one of the maker's tables; "manual" is that of its manual."""

    def __post_init__(self) -> None:
        """Checks the word."""
        _put(self, "table", as_name(self.table, "table"))


@dataclass(frozen=True, slots=True)
class OnLoss:
    """Chooses what the arm does while commands are missing, from the next motion on."""

    name: ClassVar[str] = "on_loss"
    behaviour: str
    """"hold" or "bridge"."""

    def __post_init__(self) -> None:
        """Checks the word."""
        _put(self, "behaviour", as_name(self.behaviour, "behaviour"))


@dataclass(frozen=True, slots=True)
class Network:
    """Sets the simulated network faults."""

    name: ClassVar[str] = "network"
    faults: NetworkFaults
    direction: Direction = "both"
    """Affected datagrams; TCP responses are affected by "both" and "states"."""

    def __post_init__(self) -> None:
        """Checks both; a dictionary of faults, as in a line of JSON, becomes a value."""
        _put(self, "faults", _network_faults(self.faults))
        _put(self, "direction", as_word(self.direction, "direction", DIRECTIONS))


@dataclass(frozen=True, slots=True)
class StallClock:
    """Stops the controller's clock, once or periodically; a new request replaces the previous one."""

    name: ClassVar[str] = "stall"
    duration: float
    """[s]; 0 cancels pending stalls."""
    after: float = 0.0
    """[s] from now."""
    period: float | None = None
    """[s]; None: once."""

    def __post_init__(self) -> None:
        """Checks every value."""
        _put(self, "duration", as_float(self.duration, "duration", "s", 0.0, LONGEST_STALL))
        stall = Stall(duration=self.duration or LONGEST_STALL, after=self.after, period=self.period)
        _put(self, "after", stall.after)
        _put(self, "period", stall.period)

    @property
    def stall(self) -> Stall | None:
        """The requested stall; None: pending ones are cancelled."""
        return Stall(duration=self.duration, after=self.after, period=self.period) if self.duration else None


@dataclass(frozen=True, slots=True)
class PlaceBox:
    """Puts a fixed box next to the arm, or moves the box of that name."""

    name: ClassVar[str] = "place_box"
    box: str
    """Its name."""
    size: Floats
    """Edges along its own x, y and z, shape (3,), [m]."""
    position: Floats
    """Of its centre in base, shape (3,), [m]."""
    wxyz: Floats = (1.0, 0.0, 0.0, 0.0)
    """Its orientation in base, shape (4,)."""

    def __post_init__(self) -> None:
        """Checks every value."""
        _put(self, "box", as_name(self.box, "box"))
        _put(self, "size", as_floats(self.size, 3, "size", "m"))
        _put(self, "position", as_floats(self.position, 3, "position", "m"))
        _put(self, "wxyz", _as_orientation(self.wxyz))
        for edge in self.size:
            as_float(edge, "size", "m", 0.001, _FARTHEST)
        for coordinate in self.position:
            as_float(coordinate, "position", "m", -_FARTHEST, _FARTHEST)


@dataclass(frozen=True, slots=True)
class RemoveBox:
    """Removes a box."""

    name: ClassVar[str] = "remove_box"
    box: str

    def __post_init__(self) -> None:
        """Checks it."""
        _put(self, "box", as_name(self.box, "box"))


@dataclass(frozen=True, slots=True)
class Floor:
    """Adds a floor under the base that the arm can hit, or removes it."""

    name: ClassVar[str] = "floor"
    on: bool

    def __post_init__(self) -> None:
        """Checks it."""
        _put(self, "on", as_flag(self.on, "on"))


@dataclass(frozen=True, slots=True)
class Walls:
    """Makes the faces of the active safety box solid walls for the links, or not."""

    name: ClassVar[str] = "walls"
    on: bool

    def __post_init__(self) -> None:
        """Checks it."""
        _put(self, "on", as_flag(self.on, "on"))


@dataclass(frozen=True, slots=True)
class Mount:
    """Attaches a physical load to the flange, independent of SetLoad; without a mass, the load of SetLoad again."""

    name: ClassVar[str] = "mount"
    mass: float | None = None
    """[kg]."""
    center_of_mass: Floats = (0.0, 0.0, 0.0)
    """In the flange frame, shape (3,), [m]."""
    inertia: Floats = (0.0,) * 9
    """About the centre of mass, row by row, shape (9,), [kg m^2]."""

    def __post_init__(self) -> None:
        """Checks every value."""
        if self.mass is not None:
            _put(self, "mass", as_float(self.mass, "mass", "kg", 0.0, 100.0))
        _put(self, "center_of_mass", as_floats(self.center_of_mass, 3, "center_of_mass", "m"))
        _put(self, "inertia", as_floats(self.inertia, 9, "inertia", "kg m^2"))


@dataclass(frozen=True, slots=True)
class PlaceArm:
    """Places the stationary arm at other joint angles; refused while it moves or follows commands."""

    name: ClassVar[str] = "place_arm"
    q: Floats
    """Joint angles, shape (n,), [rad]."""

    def __post_init__(self) -> None:
        """Checks the numbers; the controller checks count and range."""
        _put(self, "q", as_joints(self.q, "q", "rad"))


@dataclass(frozen=True, slots=True)
class SetTool:
    """Sets the tool as on the teach pendant: a reboot keeps it. Refused while the arm moves, like the next three."""

    name: ClassVar[str] = "set_tool"
    position: Floats
    """Of the tool in the flange frame, shape (3,), [m]."""
    wxyz: Floats = (1.0, 0.0, 0.0, 0.0)
    """Its orientation in the flange frame, shape (4,)."""

    def __post_init__(self) -> None:
        """Checks the numbers; the controller checks their range."""
        _put(self, "position", as_floats(self.position, 3, "position", "m"))
        _put(self, "wxyz", _as_orientation(self.wxyz))


@dataclass(frozen=True, slots=True)
class SetLoad:
    """Sets the load at the flange as on the teach pendant; see `Mount` for a physical load."""

    name: ClassVar[str] = "set_load"
    mass: float
    """[kg]."""
    center_of_mass: Floats = (0.0, 0.0, 0.0)
    """In the flange frame, shape (3,), [m]."""
    inertia: Floats = (0.0,) * 9
    """About the centre of mass, row by row, shape (9,), [kg m^2]."""

    def __post_init__(self) -> None:
        """Checks the numbers; the controller checks their range."""
        _put(self, "mass", as_float(self.mass, "mass", "kg", 0.0))
        _put(self, "center_of_mass", as_floats(self.center_of_mass, 3, "center_of_mass", "m"))
        _put(self, "inertia", as_floats(self.inertia, 9, "inertia", "kg m^2"))


@dataclass(frozen=True, slots=True)
class SetBox:
    """Sets the safety box as on the teach pendant, or without size and position switches that in force on or off."""

    name: ClassVar[str] = "set_box"
    size: Floats | None = None
    """Edges along its own x, y and z, shape (3,), [m]."""
    position: Floats | None = None
    """Of its centre in base, shape (3,), [m]."""
    wxyz: Floats = (1.0, 0.0, 0.0, 0.0)
    """Its orientation in base, shape (4,)."""
    active: bool = True
    """Whether it is enforced."""

    def __post_init__(self) -> None:
        """Checks the numbers; the controller checks their range."""
        _put(self, "wxyz", _as_orientation(self.wxyz))
        _put(self, "active", as_flag(self.active, "active"))
        if self.size is None and self.position is None and self.wxyz == (1.0, 0.0, 0.0, 0.0):
            return
        _put(self, "size", as_floats(self.size, 3, "size", "m"))
        _put(self, "position", as_floats(self.position, 3, "position", "m"))


@dataclass(frozen=True, slots=True)
class SetSoftLimits:
    """Sets the soft limits of the joints as on the teach pendant."""

    name: ClassVar[str] = "set_soft_limits"
    lower: Floats
    """Shape (n,), [rad]."""
    upper: Floats
    """Shape (n,), [rad]."""

    def __post_init__(self) -> None:
        """Checks the numbers; the controller checks count and range."""
        _put(self, "lower", as_joints(self.lower, "lower", "rad"))
        _put(self, "upper", as_joints(self.upper, "upper", "rad"))


@dataclass(frozen=True, slots=True)
class GetStatus:
    """Requests the status."""

    name: ClassVar[str] = "status"


WorldRequest: TypeAlias = (
    Push
    | Release
    | Press
    | Guide
    | SetInput
    | LoopBack
    | AutoLimit
    | Limits
    | OnLoss
    | Network
    | StallClock
    | PlaceBox
    | RemoveBox
    | Floor
    | Walls
    | Mount
    | PlaceArm
    | SetTool
    | SetLoad
    | SetBox
    | SetSoftLimits
    | GetStatus
)

REQUESTS: dict[str, type[WorldRequest]] = {kind.name: kind for kind in get_args(WorldRequest)}
"""Every request by its name."""


def _network_faults(value: Any) -> NetworkFaults:
    if isinstance(value, NetworkFaults):
        return value
    try:
        return NetworkFaults(**value)
    except TypeError:
        known = ", ".join(NetworkFaults().as_dict())
        raise InvalidValueError("faults", value, f"are not faults of a network; known: {known}") from None


def _as_orientation(value: object) -> Floats:
    wxyz = as_floats(value, 4, "wxyz", "")
    if not 1e-6 < sum(number * number for number in wxyz) < 1e6:
        raise InvalidValueError("wxyz", wxyz, "has no direction; a unit quaternion is expected")
    return wxyz


def _put(owner: object, name: str, value: object) -> None:
    object.__setattr__(owner, name, value)
