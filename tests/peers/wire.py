"""The RCI in bytes, packed by hand: what a peer must know that shares no code with the package it tests.

TCP frames: length of the whole frame (u16), id (u32) and command code (u32) big-endian, then the payload. Doubles are
little-endian everywhere; of a datagram only the message id is big-endian. Poses are 16 numbers, row by row.
"""

from __future__ import annotations

import struct
from enum import IntEnum

STATE_SIZE = 1247  # [bytes]
COMMAND_SIZE = 290  # [bytes]
HEADER_SIZE = 10  # [bytes]


class Code(IntEnum):
    """Which command a frame carries."""

    CONNECT = 0
    MOTOR_POWER = 1
    MOTOR_STATE = 2
    START_MOVE = 3
    STOP_MOVE = 4
    CARTESIAN_LIMIT = 5
    JOINT_LIMIT = 6
    COLLISION_BEHAVIOR = 7
    JOINT_IMPEDANCE = 8
    CARTESIAN_IMPEDANCE = 9
    COOR = 10
    LOAD = 11
    DESIRED_TAU = 12
    FILTERS = 13
    TORQUE_FILTER = 14
    ERROR_RECOVERY = 15
    LOAD_MODEL = 16
    FC_COOR = 17
    VIRTUAL_GUIDE = 18
    SET_DO = 19
    GET_DI = 20
    START_DRAG = 21
    STOP_DRAG = 22
    SAFETY_STOP_STATE = 23
    REBOOT = 24


RESPONSE_SIZES = {Code.LOAD_MODEL: 1291, Code.GET_DI: 12}  # [bytes] All others: 11.

# Modes as a request names them, and motion modes as the state shows them.
JOINT_POSITION, CARTESIAN_POSITION, JOINT_IMPEDANCE, CARTESIAN_IMPEDANCE, TORQUE, OTHER = range(6)
IDLE, JOINT, CARTESIAN = range(3)
SHOWN_AS = {IDLE: 0, JOINT: 1, CARTESIAN: 3}

ROBOT_OTHER, ROBOT_IDLE, ROBOT_MOVE, ROBOT_GUIDING, ROBOT_REFLEX, ROBOT_USER_STOPPED, ROBOT_RECOVERING = range(7)

ERROR_NAMES = (
    "kActualJointPositionLimitsViolation",
    "kActualCartesianPositionLimitsViolation",
    "kActualCartesianMotionGeneratorElbowLimitViolation",
    "kActualJointVelocityLimitsViolation",
    "kActualCartesianVelocityLimitsViolation",
    "kActualJointAccelerationLimitsViolation",
    "kActualCartesianAccelerationLimitsViolation",
    "kCommandJointPositionLimitsViolation",
    "kCommandCartesianPositionLimitsViolation",
    "kCommandCartesianMotionGeneratorElbowLimitViolation",
    "kCommandJointVelocityLimitsViolation",
    "kCommandCartesianVelocityLimitsViolation",
    "kCommandJointAccelerationLimitsViolation",
    "kCommandCartesianAccelerationLimitsViolation",
    "kCommandJointAccelerationDiscontinuity",
    "kCollision",
    "kCartesianPositionMotionGeneratorInvalidFrame",
    "kCommandTorqueDiscontinuity",
    "kCommandTorqueRangeViolation",
    "kInstabilityDetection",
)

_FIELDS = {  # name: (offset, count)
    "q": (8, 7), "q_c": (64, 7), "dq_m": (120, 7), "dq_c": (176, 7), "ddq_c": (232, 7),
    "pos_m": (288, 16), "pos_c": (416, 16), "vel_c": (544, 6), "acc_c": (592, 6),
    "psi_m": (640, 1), "psi_c": (648, 1), "psi_vel_c": (656, 1), "psi_acc_c": (664, 1),
    "tau_m": (672, 7), "tau_m_filtered": (728, 7), "tau_c": (784, 7), "tau_vel_c": (840, 7),
    "tau_ext_in_base": (896, 6), "tau_ext_in_stiff": (944, 6), "theta_m": (992, 7), "theta_vel_m": (1048, 7),
    "motor_tau": (1104, 7), "motor_tau_filtered": (1160, 7), "success_rate": (1236, 1),
}  # fmt: skip
FIELD_NAMES = tuple(_FIELDS)
_READERS = {name: (offset, struct.Struct(f"<{count}d")) for name, (offset, count) in _FIELDS.items()}
_ID = struct.Struct(">Q")


class State:
    """A received state; fields are read from the bytes when they are asked for, as tuples of floats."""

    __slots__ = ("data",)

    def __init__(self, data: bytes) -> None:
        assert len(data) == STATE_SIZE, f"a state has {STATE_SIZE} bytes, not {len(data)}"
        self.data = data

    def __getattr__(self, name: str) -> tuple[float, ...]:
        if name not in _READERS:
            raise AttributeError(name)
        offset, reader = _READERS[name]
        return reader.unpack_from(self.data, offset)

    @property
    def message_id(self) -> int:
        return _ID.unpack_from(self.data)[0]

    @property
    def errors(self) -> tuple[int, ...]:
        """The numbers of the bits that are set."""
        return tuple(place for place, bit in enumerate(self.data[1216:1236]) if bit)

    @property
    def motion_mode(self) -> int:
        return self.data[1244]

    @property
    def controller_mode(self) -> int:
        return self.data[1245]

    @property
    def robot_mode(self) -> int:
        return self.data[1246]


def pack_frame(command_id: int, code: int, payload: bytes = b"") -> bytes:
    """Returns a request."""
    return struct.pack(">HII", HEADER_SIZE + len(payload), command_id, code) + payload


def doubles(*values: float) -> bytes:
    """Returns numbers as a payload holds them."""
    return struct.pack(f"<{len(values)}d", *values)


def pack_command(
    message_id: int,
    q: tuple[float, ...] = (0.0,) * 7,
    pose: tuple[float, ...] = (0.0,) * 16,
    psi: float = 0.0,
    tau: tuple[float, ...] = (0.0,) * 7,
    *,
    psi_valid: bool | None = None,
    finished: int = 0,
) -> bytes:
    """Returns a command datagram; an arm angle of exactly 0 goes out as none, as the vendor's client has it."""
    valid = psi != 0.0 if psi_valid is None else psi_valid
    middle = struct.pack("<BdB4d", valid, psi, finished, 0.0, 0.0, 0.0, 0.0)
    return _ID.pack(message_id) + doubles(*q) + doubles(*pose) + middle + doubles(*tau)
