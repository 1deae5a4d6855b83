"""The 25 commands of a client over TCP, each a frozen value with its layout table.

Arrays have 7 elements on the wire for every arm; a 6-element value is padded with a zero, and on 6-axis arms the
seventh element is undefined. Modes, signals and types are plain integers here, because a client may send any byte; the
enumerations in `statuses` name the known ones, and the controller checks them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

from rcilab.core.errors import InvalidValueError
from rcilab.core.message_layout import Field, Layout
from rcilab.makers.rokae.wire.statuses import CommandCode

Numbers: TypeAlias = tuple[float, ...]


class Request:
    """A command to the controller."""

    code: ClassVar[CommandCode]
    layout: ClassVar[Layout]

    def __init_subclass__(cls, *, code: CommandCode, fields: tuple[Field, ...] = ()) -> None:
        cls.code = code
        cls.layout = Layout(cls.__name__, fields)
        REQUESTS[code] = cls

    def __post_init__(self) -> None:
        for field in self.layout.fields:
            object.__setattr__(self, field.name, _normalised(field, getattr(self, field.name)))


REQUESTS: dict[CommandCode, type[Request]] = {}
"""The class of each command."""


@dataclass(frozen=True)
class Connect(Request, code=CommandCode.CONNECT, fields=(Field("udp_port", "u16", order="big"),)):
    """Gives the client's UDP port. Declared by the vendor, but its client never sends it."""

    udp_port: int


@dataclass(frozen=True)
class SetMotorPower(Request, code=CommandCode.SET_MOTOR_POWER, fields=(Field("power", "u8"),)):
    """Switches the motors: 1 on, 0 off."""

    power: int


@dataclass(frozen=True)
class GetMotorState(Request, code=CommandCode.GET_MOTOR_STATE):
    """Asks whether the motors are on."""


@dataclass(frozen=True)
class StartMove(
    Request,
    code=CommandCode.START_MOVE,
    fields=(
        Field("controller_mode", "u8"),
        Field("motion_mode", "u8"),
    ),
):
    """Begins a motion: see `ControllerMode` and `StartMotionMode` (numbered otherwise than in the state)."""

    controller_mode: int
    motion_mode: int


@dataclass(frozen=True)
class StopMove(Request, code=CommandCode.STOP_MOVE):
    """Ends a motion."""


@dataclass(frozen=True)
class SetCartesianLimit(
    Request,
    code=CommandCode.SET_CARTESIAN_LIMIT,
    fields=(
        Field("size", "f64", 3, "m"),
        Field("frame", "f64", 16, "row-major, m"),
        Field("active", "flag"),
    ),
):
    """Sets the safety box: its edges and its centre's pose in base; the vendor's client always sends active."""

    size: Numbers
    frame: Numbers
    active: bool = True


@dataclass(frozen=True)
class SetJointLimit(
    Request,
    code=CommandCode.SET_JOINT_LIMIT,
    fields=(
        Field("upper", "f64", 7, "rad"),
        Field("lower", "f64", 7, "rad"),
    ),
):
    """Sets the soft limits of the joint angles."""

    upper: Numbers
    lower: Numbers


@dataclass(frozen=True)
class SetCollisionBehavior(
    Request, code=CommandCode.SET_COLLISION_BEHAVIOR, fields=(Field("thresholds", "f64", 7, "N m"),)
):
    """Sets the external torques that count as a collision."""

    thresholds: Numbers


@dataclass(frozen=True)
class SetJointImpedance(
    Request, code=CommandCode.SET_JOINT_IMPEDANCE, fields=(Field("stiffness", "f64", 7, "N m/rad"),)
):
    """Sets the stiffness of joint impedance."""

    stiffness: Numbers


@dataclass(frozen=True)
class SetCartesianImpedance(
    Request, code=CommandCode.SET_CARTESIAN_IMPEDANCE, fields=(Field("stiffness", "f64", 6, "N/m, N m/rad"),)
):
    """Sets the stiffness of Cartesian impedance: three translations, three rotations."""

    stiffness: Numbers


@dataclass(frozen=True)
class SetCoor(Request, code=CommandCode.SET_COOR, fields=(Field("T_flange_tool", "f64", 16, "row-major, m"),)):
    """Sets the tool: its pose in the flange frame."""

    T_flange_tool: Numbers


@dataclass(frozen=True)
class SetLoad(
    Request,
    code=CommandCode.SET_LOAD,
    fields=(
        Field("mass", "f64", 1, "kg"),
        Field("center_of_mass", "f64", 3, "m"),
        Field("inertia", "f64", 9, "row-major, kg m^2"),
    ),
):
    """Sets the load at the flange."""

    mass: float
    center_of_mass: Numbers
    inertia: Numbers


@dataclass(frozen=True)
class SetCartImpDesiredTau(
    Request, code=CommandCode.SET_CART_IMP_DESIRED_TAU, fields=(Field("wrench", "f64", 6, "N, N m"),)
):
    """Sets the desired force and moment of Cartesian impedance."""

    wrench: Numbers


@dataclass(frozen=True)
class SetFilters(
    Request,
    code=CommandCode.SET_FILTERS,
    fields=(
        Field("joint_frequency", "f64", 1, "Hz"),
        Field("cartesian_frequency", "f64", 1, "Hz"),
        Field("torque_frequency", "f64", 1, "Hz"),
    ),
):
    """Sets the cut-off frequencies of the controller's own filters."""

    joint_frequency: float
    cartesian_frequency: float
    torque_frequency: float


@dataclass(frozen=True)
class SetTorqueFilterCutOffFrequency(
    Request, code=CommandCode.SET_TORQUE_FILTER_CUT_OFF_FREQUENCY, fields=(Field("frequency", "f64", 1, "Hz"),)
):
    """Sets the cut-off frequency of the reported torques' filter."""

    frequency: float


@dataclass(frozen=True)
class AutomaticErrorRecovery(Request, code=CommandCode.AUTOMATIC_ERROR_RECOVERY):
    """Asks the controller to clear its faults."""


@dataclass(frozen=True)
class LoadRobotModel(Request, code=CommandCode.LOAD_ROBOT_MODEL):
    """Asks for the figures of the arm."""


@dataclass(frozen=True)
class SetFcCoor(
    Request,
    code=CommandCode.SET_FC_COOR,
    fields=(
        Field("frame", "f64", 16, "row-major, m"),
        Field("type", "u8"),
    ),
):
    """Sets the force-control frame: its pose in the flange and its `ForceFrame`."""

    frame: Numbers
    type: int


@dataclass(frozen=True)
class EnableVirtualGuide(
    Request,
    code=CommandCode.ENABLE_VIRTUAL_GUIDE,
    fields=(
        Field("enable", "flag"),
        Field("unused", "u8", 48),
    ),
):
    """Switches the virtual guide. The vendor's client sends 48 bytes of uninitialised memory after the switch."""

    enable: bool
    unused: tuple[int, ...] = (0,) * 48


@dataclass(frozen=True)
class SetDO(
    Request,
    code=CommandCode.SET_DO,
    fields=(
        Field("signal", "u8"),
        Field("level", "flag"),
    ),
):
    """Sets a digital output, 0 to 5."""

    signal: int
    level: bool


@dataclass(frozen=True)
class GetDIState(Request, code=CommandCode.GET_DI_STATE, fields=(Field("signal", "u8"),)):
    """Asks for the level of a digital input, 0 to 5."""

    signal: int


@dataclass(frozen=True)
class StartDrag(
    Request,
    code=CommandCode.START_DRAG,
    fields=(
        Field("space", "u8"),
        Field("type", "u8"),
    ),
):
    """Starts hand guiding: see `DragSpace` and `DragType`."""

    space: int
    type: int


@dataclass(frozen=True)
class StopDrag(Request, code=CommandCode.STOP_DRAG):
    """Ends hand guiding."""


@dataclass(frozen=True)
class GetSafetyStopState(Request, code=CommandCode.GET_SAFETY_STOP_STATE):
    """Asks which emergency stop is pressed."""


@dataclass(frozen=True)
class RebootRobot(Request, code=CommandCode.REBOOT_ROBOT):
    """Restarts the controller."""


def _normalised(field: Field, value: Any) -> Any:
    convert = _CONVERTERS.get(field.type, _integer)
    if field.count == 1:
        return convert(field, value)
    try:
        items = tuple(value)
    except TypeError as error:
        raise InvalidValueError(field.name, value, f"is not {field.count} numbers") from error
    if field.count == 7 and len(items) == 6:  # A 6-axis arm leaves the seventh place empty.
        items = (*items, 0.0)
    if len(items) != field.count:
        raise InvalidValueError(field.name, value, f"has {len(items)} elements, needs {field.count}")
    return tuple(convert(field, item) for item in items)


def _flag(field: Field, value: Any) -> bool:
    return bool(value)


def _number(field: Field, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise InvalidValueError(field.name, value, f"is not a number [{field.unit}]") from error


def _integer(field: Field, value: Any) -> int:
    largest = 256 ** (field.size // field.count) - 1
    try:
        number = int(value)
    except (TypeError, ValueError) as error:
        raise InvalidValueError(field.name, value, "is not a whole number") from error
    if not 0 <= number <= largest:
        raise InvalidValueError(field.name, value, f"does not fit: needs 0 to {largest}")
    return number


_CONVERTERS = {"f64": _number, "flag": _flag}
