"""The numbers in requests and answers of the RCI, as enumerations."""

from __future__ import annotations

from enum import IntEnum
from typing import Final, TypeAlias

from rcilab.core.state import MotionGeneratorMode


class CommandCode(IntEnum):
    """The command of a TCP frame."""

    CONNECT = 0
    SET_MOTOR_POWER = 1
    GET_MOTOR_STATE = 2
    START_MOVE = 3
    STOP_MOVE = 4
    SET_CARTESIAN_LIMIT = 5
    SET_JOINT_LIMIT = 6
    SET_COLLISION_BEHAVIOR = 7
    SET_JOINT_IMPEDANCE = 8
    SET_CARTESIAN_IMPEDANCE = 9
    SET_COOR = 10
    SET_LOAD = 11
    SET_CART_IMP_DESIRED_TAU = 12
    SET_FILTERS = 13
    SET_TORQUE_FILTER_CUT_OFF_FREQUENCY = 14
    AUTOMATIC_ERROR_RECOVERY = 15
    LOAD_ROBOT_MODEL = 16
    SET_FC_COOR = 17
    ENABLE_VIRTUAL_GUIDE = 18
    SET_DO = 19
    GET_DI_STATE = 20
    START_DRAG = 21
    STOP_DRAG = 22
    GET_SAFETY_STOP_STATE = 23
    REBOOT_ROBOT = 24


WHILE_MOVING: Final = frozenset(
    {
        CommandCode.GET_MOTOR_STATE,
        CommandCode.LOAD_ROBOT_MODEL,
        CommandCode.GET_DI_STATE,
        CommandCode.GET_SAFETY_STOP_STATE,
        CommandCode.SET_DO,
        CommandCode.SET_CART_IMP_DESIRED_TAU,
    }
)
"""Commands that do not affect a moving arm: a controller grants them in every phase."""


class SettingStatus(IntEnum):
    """The answer to a plain setter."""

    SUCCESS = 0
    NOT_POSSIBLE = 1
    INVALID_ARGUMENT = 2


class StartStatus(IntEnum):
    """The answer to StartMove; both of the first two mean that the motion begins."""

    SUCCESS = 0
    MOTION_STARTED = 1
    PREEMPTED = 2
    NOT_POSSIBLE = 3
    SINGULAR_START_POSE = 4
    INVALID_ARGUMENT = 5
    REFLEX = 6
    USER_STOP = 7
    INVALID_INPUT = 8
    ABORTED = 9


class StopStatus(IntEnum):
    """The answer to StopMove. The vendor's client aborts at any but the first one."""

    SUCCESS = 0
    NOT_POSSIBLE = 1
    USER_STOP = 2
    REFLEX = 3
    ABORTED = 4


class RecoveryStatus(IntEnum):
    """The answer to AutomaticErrorRecovery."""

    SUCCESS = 0
    NOT_POSSIBLE = 1
    MANUAL_RECOVERY_NEEDED = 2
    REFLEX = 3
    USER_STOP = 4
    ABORTED = 5


class GuideStatus(IntEnum):
    """The answer to EnableVirtualGuide, and the first byte of the answer to LoadRobotModel."""

    SUCCESS = 0
    FAILED = 1


Status: TypeAlias = SettingStatus | StartStatus | StopStatus | RecoveryStatus | GuideStatus


class SafetyStop(IntEnum):
    """Which emergency stop is pressed; the manual counts from 1, the wire from 0."""

    NONE = 0
    ESTOP = 1
    GSTOP = 2


class StartMotionMode(IntEnum):
    """The kind of commands of a motion, as StartMove numbers it; the state numbers Cartesian 3, not 2."""

    IDLE = 0
    JOINT = 1
    CARTESIAN = 2

    @property
    def shown_as(self) -> MotionGeneratorMode:
        """The mode that the state reports once the motion runs."""
        return _SHOWN_AS[self]


_SHOWN_AS = {
    StartMotionMode.IDLE: MotionGeneratorMode.IDLE,
    StartMotionMode.JOINT: MotionGeneratorMode.JOINT_POSITION,
    StartMotionMode.CARTESIAN: MotionGeneratorMode.CARTESIAN_POSITION,
}


class DragSpace(IntEnum):
    """Space of a drag's constraints; the manual counts from 1, the wire from 0."""

    JOINT = 0
    CARTESIAN = 1


class DragType(IntEnum):
    """Free directions of a Cartesian drag; the manual counts from 1, the wire from 0."""

    TRANSLATION = 0
    ROTATION = 1
    FREE = 2
