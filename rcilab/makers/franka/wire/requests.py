"""The commands of a client over TCP, each a frozen value with its layout table.

Numbers that name a mode or an axis are plain integers here, because a client may send any; the controller checks them.
A version numbers the commands in its own order, see `versions`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from rcilab.core.message_layout import Field, Layout

Numbers: TypeAlias = tuple[float, ...]


class Request:
    """A command to the controller."""

    layout: ClassVar[Layout]

    def __init_subclass__(cls, *, fields: tuple[Field, ...] = ()) -> None:
        cls.layout = Layout(cls.__name__, fields)


@dataclass(frozen=True)
class Connect(Request, fields=(Field("version", "u16"), Field("udp_port", "u16"))):
    """Begins a connection: the client's version of the interface, and its port for states."""

    version: int
    udp_port: int


_MOVE = (
    Field("controller_mode", "u32"),
    Field("motion_generator_mode", "u32"),
    Field("path_deviation", "f64", 3, "m, rad, rad"),
    Field("goal_deviation", "f64", 3, "m, rad, rad"),
)


@dataclass(frozen=True)
class Move(Request, fields=_MOVE):
    """Begins a motion; `MoveController` and `MoveGenerator` name the modes."""

    controller_mode: int
    motion_generator_mode: int
    path_deviation: Numbers
    goal_deviation: Numbers


@dataclass(frozen=True)
class AsyncMove(Move, fields=(*_MOVE, Field("is_asynchronous", "flag"), Field("largest_velocity", "f64", 7, "rad/s"))):
    """The Move of version 10: an asynchronous one takes joint angles as goals, at largest velocities."""

    is_asynchronous: bool = False
    largest_velocity: Numbers = (0.0,) * 7


@dataclass(frozen=True)
class StopMove(Request):
    """Ends a motion."""


@dataclass(frozen=True)
class GetCartesianLimit(Request, fields=(Field("number", "i32"),)):
    """Asks for one of the virtual walls that are set on the controller."""

    number: int


@dataclass(frozen=True)
class SetCollisionBehavior(
    Request,
    fields=(
        Field("lower_torque_acceleration", "f64", 7, "N m"),
        Field("upper_torque_acceleration", "f64", 7, "N m"),
        Field("lower_torque_nominal", "f64", 7, "N m"),
        Field("upper_torque_nominal", "f64", 7, "N m"),
        Field("lower_force_acceleration", "f64", 6, "N, N m"),
        Field("upper_force_acceleration", "f64", 6, "N, N m"),
        Field("lower_force_nominal", "f64", 6, "N, N m"),
        Field("upper_force_nominal", "f64", 6, "N, N m"),
    ),
):
    """Sets the external torques and forces that are a contact (lower) and a collision (upper)."""

    lower_torque_acceleration: Numbers
    upper_torque_acceleration: Numbers
    lower_torque_nominal: Numbers
    upper_torque_nominal: Numbers
    lower_force_acceleration: Numbers
    upper_force_acceleration: Numbers
    lower_force_nominal: Numbers
    upper_force_nominal: Numbers


@dataclass(frozen=True)
class SetJointImpedance(Request, fields=(Field("stiffness", "f64", 7, "N m/rad"),)):
    """Sets the stiffness of the internal joint impedance."""

    stiffness: Numbers


@dataclass(frozen=True)
class SetCartesianImpedance(Request, fields=(Field("stiffness", "f64", 6, "N/m, N m/rad"),)):
    """Sets the stiffness of the internal Cartesian impedance."""

    stiffness: Numbers


@dataclass(frozen=True)
class SetGuidingMode(Request, fields=(Field("axes", "u8", 6), Field("elbow", "u8"))):
    """Sets which axes of the tool, and whether the elbow, are free while the arm is guided by hand."""

    axes: tuple[int, ...]
    elbow: int


@dataclass(frozen=True)
class SetEEToK(Request, fields=(Field("EE_T_K", "f64", 16, "column-major, m"),)):
    """Sets the stiffness frame in the end-effector frame."""

    EE_T_K: Numbers


@dataclass(frozen=True)
class SetNEToEE(Request, fields=(Field("NE_T_EE", "f64", 16, "column-major, m"),)):
    """Sets the end-effector frame in the nominal one, which the controller's own settings give."""

    NE_T_EE: Numbers


@dataclass(frozen=True)
class SetLoad(
    Request,
    fields=(
        Field("mass", "f64", 1, "kg"),
        Field("center", "f64", 3, "m, in the flange frame"),
        Field("inertia", "f64", 9, "column-major, kg m^2, about the centre of mass"),
    ),
):
    """Sets the load."""

    mass: float
    center: Numbers
    inertia: Numbers


@dataclass(frozen=True)
class SetFilters(Request, fields=(Field("frequencies", "f64", 5, "Hz"),)):
    """Sets the low passes: joint position and velocity, Cartesian position and velocity, controller (version 5)."""

    frequencies: Numbers


@dataclass(frozen=True)
class AutomaticErrorRecovery(Request):
    """Clears the errors."""


@dataclass(frozen=True)
class GetRobotModel(Request):
    """Asks for the arm as a URDF (version 10)."""


@dataclass(frozen=True)
class LoadModelLibrary(Request, fields=(Field("architecture", "u8"), Field("system", "u8"))):
    """Asks for the arm as a shared library (version 5): architecture 0 is x86-64, 3 is ARM64; system 0 is Linux."""

    architecture: int
    system: int


SETTERS = (
    SetCollisionBehavior,
    SetJointImpedance,
    SetCartesianImpedance,
    SetGuidingMode,
    SetEEToK,
    SetNEToEE,
    SetLoad,
    SetFilters,
)
"""The commands that set parameters."""
