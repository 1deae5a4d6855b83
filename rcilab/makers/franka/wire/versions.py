"""What differs between the versions of the interface: numbers of commands and statuses, and sizes of datagrams."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, IntEnum
from types import MappingProxyType

from rcilab.makers.franka.wire.requests import (
    SETTERS,
    AsyncMove,
    AutomaticErrorRecovery,
    Connect,
    GetCartesianLimit,
    GetRobotModel,
    LoadModelLibrary,
    Move,
    Request,
    SetCartesianImpedance,
    SetCollisionBehavior,
    SetEEToK,
    SetFilters,
    SetGuidingMode,
    SetJointImpedance,
    SetLoad,
    SetNEToEE,
    StopMove,
)


class Status(Enum):
    """The meaning of a status; its number depends on the command and the version."""

    SUCCESS = "success"
    MOTION_STARTED = "the motion has started"
    PREEMPTED = "the client ended the motion"
    PREEMPTED_BY_SAFETY = "a safety function ended the motion"
    REJECTED_BY_SAFETY = "a safety function is active"
    NOT_POSSIBLE = "not possible in this mode"
    START_SINGULAR = "the arm stands at a singular pose"
    INVALID_ARGUMENT = "an argument is not valid"
    MANUAL_RECOVERY_REQUIRED = "the error must be cleared by hand"
    REFLEX_ABORTED = "an error aborted the motion"
    EMERGENCY_ABORTED = "the user stop aborted the motion"
    INPUT_ERROR_ABORTED = "a command that is not valid aborted the motion"
    ABORTED = "the motion was aborted"
    INCOMPATIBLE = "the client has another version of the interface"
    ERROR = "an error"


class MoveController(IntEnum):
    """The controller of a motion in Move, and in the state."""

    JOINT_IMPEDANCE = 0
    CARTESIAN_IMPEDANCE = 1
    EXTERNAL = 2


class MoveGenerator(IntEnum):
    """The motion generator in Move; in the state its number is larger by one."""

    JOINT_POSITION = 0
    JOINT_VELOCITY = 1
    CARTESIAN_POSITION = 2
    CARTESIAN_VELOCITY = 3
    NONE = 4


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FciVersion:
    """A version of the interface."""

    number: int
    commands: tuple[type[Request], ...]
    """By their number."""
    statuses: Mapping[type[Request], tuple[Status, ...]]
    """The statuses of the answer to a command, by their number."""
    has_floats: bool
    """Whether the state has single precision, and the acceleration sensors."""
    finishes_torques: bool
    """Whether a command indicates by itself that the torques have ended."""
    generators: tuple[MoveGenerator, ...]
    """The motion generators of Move."""

    def number_of(self, command: type[Request]) -> int:
        """Returns the number of a command."""
        return self.commands.index(command)

    def status_number(self, command: type[Request], status: Status) -> int:
        """Returns the number of a status in the answer to a command; the nearest one that the version has."""
        statuses = self.statuses[command]
        while status not in statuses:
            status = _NEAREST[status]
        return statuses.index(status)


_NEAREST = {
    Status.REJECTED_BY_SAFETY: Status.NOT_POSSIBLE,
    Status.PREEMPTED_BY_SAFETY: Status.EMERGENCY_ABORTED,
    Status.MANUAL_RECOVERY_REQUIRED: Status.NOT_POSSIBLE,
    Status.INVALID_ARGUMENT: Status.NOT_POSSIBLE,
    Status.NOT_POSSIBLE: Status.ERROR,
    Status.EMERGENCY_ABORTED: Status.ABORTED,
    Status.REFLEX_ABORTED: Status.ABORTED,
    Status.INPUT_ERROR_ABORTED: Status.ABORTED,
    Status.ABORTED: Status.NOT_POSSIBLE,
}
"""Which status stands for one that a version lacks."""

_CONNECT = {Connect: (Status.SUCCESS, Status.INCOMPATIBLE)}
_ABORTS = (Status.REFLEX_ABORTED, Status.EMERGENCY_ABORTED, Status.INPUT_ERROR_ABORTED, Status.ABORTED)
_SETTING = (Status.SUCCESS, Status.NOT_POSSIBLE, Status.INVALID_ARGUMENT)

VERSION_5 = FciVersion(
    number=5,
    commands=(
        Connect,
        Move,
        StopMove,
        GetCartesianLimit,
        SetCollisionBehavior,
        SetJointImpedance,
        SetCartesianImpedance,
        SetGuidingMode,
        SetEEToK,
        SetNEToEE,
        SetLoad,
        SetFilters,
        AutomaticErrorRecovery,
        LoadModelLibrary,
    ),
    statuses=MappingProxyType(
        {
            **_CONNECT,
            **dict.fromkeys((*SETTERS, GetCartesianLimit), _SETTING),
            Move: (
                Status.SUCCESS,
                Status.MOTION_STARTED,
                Status.PREEMPTED,
                Status.NOT_POSSIBLE,
                Status.START_SINGULAR,
                Status.INVALID_ARGUMENT,
                *_ABORTS,
            ),
            StopMove: (
                Status.SUCCESS,
                Status.NOT_POSSIBLE,
                Status.EMERGENCY_ABORTED,
                Status.REFLEX_ABORTED,
                Status.ABORTED,
            ),
            AutomaticErrorRecovery: (
                Status.SUCCESS,
                Status.NOT_POSSIBLE,
                Status.MANUAL_RECOVERY_REQUIRED,
                Status.REFLEX_ABORTED,
                Status.EMERGENCY_ABORTED,
                Status.ABORTED,
            ),
            LoadModelLibrary: (Status.SUCCESS, Status.ERROR),
        }
    ),
    has_floats=False,
    finishes_torques=False,
    generators=(
        MoveGenerator.JOINT_POSITION,
        MoveGenerator.JOINT_VELOCITY,
        MoveGenerator.CARTESIAN_POSITION,
        MoveGenerator.CARTESIAN_VELOCITY,
    ),
)
"""Of the Panda, as libfranka 0.9 speaks it."""

VERSION_10 = FciVersion(
    number=10,
    commands=(
        Connect,
        AsyncMove,
        StopMove,
        SetCollisionBehavior,
        SetJointImpedance,
        SetCartesianImpedance,
        SetGuidingMode,
        SetEEToK,
        SetNEToEE,
        SetLoad,
        AutomaticErrorRecovery,
        GetRobotModel,
    ),
    statuses=MappingProxyType(
        {
            **_CONNECT,
            **dict.fromkeys(SETTERS, (*_SETTING, Status.REJECTED_BY_SAFETY)),
            AsyncMove: (
                Status.SUCCESS,
                Status.MOTION_STARTED,
                Status.PREEMPTED,
                Status.PREEMPTED_BY_SAFETY,
                Status.REJECTED_BY_SAFETY,
                Status.NOT_POSSIBLE,
                Status.START_SINGULAR,
                Status.INVALID_ARGUMENT,
                *_ABORTS,
            ),
            StopMove: (
                Status.SUCCESS,
                Status.NOT_POSSIBLE,
                Status.REJECTED_BY_SAFETY,
                Status.EMERGENCY_ABORTED,
                Status.REFLEX_ABORTED,
                Status.ABORTED,
            ),
            AutomaticErrorRecovery: (
                Status.SUCCESS,
                Status.NOT_POSSIBLE,
                Status.REJECTED_BY_SAFETY,
                Status.MANUAL_RECOVERY_REQUIRED,
                Status.REFLEX_ABORTED,
                Status.EMERGENCY_ABORTED,
                Status.ABORTED,
            ),
            GetRobotModel: (Status.SUCCESS, Status.NOT_POSSIBLE, Status.REJECTED_BY_SAFETY),
        }
    ),
    has_floats=True,
    finishes_torques=True,
    generators=tuple(MoveGenerator),
)
"""Of the FR3, as libfranka 0.18 and later speak it."""

VERSIONS = MappingProxyType({version.number: version for version in (VERSION_5, VERSION_10)})
