"""The functions of the private protocol and the layouts of their payloads.

A layout is a text of `struct`; the parts between bars have their own byte order. A function with several layouts is
older than some of its arguments: the longest one that a payload fills is that of the request, and what follows it is
ignored.
"""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import Any

from rcilab.core.errors import DecodeError, InvalidValueError


class Function(IntEnum):
    """A function code."""

    GET_VERSION = 1
    GET_SERIAL_NUMBERS = 2
    CHECK_VERIFICATION = 3
    RELOAD_DYNAMICS = 4
    GET_REPORT_CURRENT = 5
    GET_APPROXIMATE = 7
    SYSTEM_CONTROL = 10
    MOTION_ENABLE = 11
    SET_STATE = 12
    GET_STATE = 13
    GET_COMMAND_COUNT = 14
    GET_ERROR = 15
    CLEAN_ERROR = 16
    CLEAN_WARNING = 17
    SET_BRAKE = 18
    SET_MODE = 19
    MOVE_LINE = 21
    MOVE_LINE_BLENDED = 22
    MOVE_JOINT = 23
    MOVE_JOINT_BLENDED = 24
    MOVE_HOME = 25
    SLEEP = 26
    MOVE_CIRCLE = 27
    MOVE_LINE_TOOL = 28
    SERVO_JOINT = 29
    SERVO_CARTESIAN = 30
    SET_TCP_JERK = 31
    SET_TCP_ACCELERATION = 32
    SET_JOINT_JERK = 33
    SET_JOINT_ACCELERATION = 34
    SET_TCP_OFFSET = 35
    SET_LOAD = 36
    SET_COLLISION_SENSITIVITY = 37
    SET_TEACH_SENSITIVITY = 38
    CLEAN_CONFIGURATION = 39
    SAVE_CONFIGURATION = 40
    GET_TCP_POSE = 41
    GET_JOINTS = 42
    GET_IK = 43
    GET_FK = 44
    IS_JOINT_LIMIT = 45
    IS_TCP_LIMIT = 46
    SET_REDUCED_TCP_SPEED = 47
    SET_REDUCED_JOINT_SPEED = 48
    GET_REDUCED_MODE = 49
    SET_REDUCED_MODE = 50
    SET_GRAVITY_DIRECTION = 51
    SET_BOUNDARY = 52
    GET_REDUCED_STATE = 53
    GET_JOINT_TORQUE = 55
    SET_REDUCED_JOINT_RANGE = 58
    SET_FENCE = 59
    SET_COLLISION_REBOUND = 60
    SET_APPROXIMATE = 66
    GET_DH = 67
    GET_MOVEMENT = 69
    SET_REPORT_CURRENT = 70
    SET_WORLD_OFFSET = 73
    RESET_COUNTER = 74
    INCREASE_COUNTER = 75
    GET_POSE_OFFSET = 76
    SET_SELF_COLLISION = 77
    SET_COLLISION_TOOL = 78
    SET_SIMULATION = 79
    SET_CARTESIAN_CONTINUOUS = 80
    JOINT_VELOCITY = 81
    CARTESIAN_VELOCITY = 82
    MOVE_RELATIVE = 83
    GET_TCP_POSE_AXIS_ANGLE = 91
    MOVE_LINE_AXIS_ANGLE = 92
    SERVO_CARTESIAN_AXIS_ANGLE = 93
    SERVO_READ_16 = 102
    SERVO_READ_32 = 104
    SERVO_STATUS = 106
    SET_TOOL_MODBUS_TIMEOUT = 123
    RS485 = 124
    GET_TOOL_ERROR = 125
    TOOL_WRITE_16 = 127
    TOOL_READ_16 = 128
    TOOL_WRITE_32 = 129
    TOOL_READ_32 = 130
    GET_INPUTS = 131
    GET_ANALOG_1 = 132
    GET_ANALOG_2 = 133
    SET_OUTPUTS = 134
    SET_ANALOG_1 = 135
    SET_ANALOG_2 = 136
    SET_INPUT_FUNCTION = 137
    SET_OUTPUT_FUNCTION = 138
    GET_IO_STATE = 139
    GET_POWER_VERSION = 140
    GET_HARDWARE_TYPES = 141
    DELAYED_OUTPUT = 142
    DELAYED_TOOL_OUTPUT = 143
    OUTPUT_AT_POSITION = 144
    TOOL_OUTPUT_AT_POSITION = 145
    SET_IO_RESET = 146
    ANALOG_AT_POSITION = 147
    GET_FORCE_OF_OLD_FIRMWARE = 150
    GET_FORCE = 200
    GET_FORCE_MODE = 203
    GET_FORCE_CONFIGURATION = 212
    SET_COMMON_PARAMETER = 232
    GET_COMMON_PARAMETER = 233
    GET_COMMON_INFORMATION = 234
    CHECK_FEEDBACK = 253
    SET_FEEDBACK = 254


_LAYOUTS: dict[Function, tuple[str, ...]] = {
    Function.SYSTEM_CONTROL: ("B",),
    Function.MOTION_ENABLE: ("2B",),
    Function.SET_STATE: ("B",),
    Function.SET_BRAKE: ("2B",),
    Function.SET_MODE: ("B", "2B"),
    # Pose, speed, acceleration, time; then: only check, motion type. With radius: coordinates, is axis-angle, only
    # check, motion type.
    Function.MOVE_LINE: ("<9f", "<9fB", "<9f2B", "<10f", "<10f3B", "<10f4B"),
    Function.MOVE_LINE_BLENDED: ("<10f", "<10fB", "<10f2B"),
    Function.MOVE_JOINT: ("<10f", "<10fB"),
    Function.MOVE_JOINT_BLENDED: ("<10f", "<10fB"),
    Function.MOVE_HOME: ("<3f", "<3fB"),
    Function.SLEEP: ("<f",),
    Function.MOVE_CIRCLE: ("<16f", "<16fB", "<16f3B"),
    Function.MOVE_LINE_TOOL: ("<9f", "<9fB", "<9f2B"),
    Function.SERVO_JOINT: ("<10f",),
    Function.SERVO_CARTESIAN: ("<9f",),
    Function.SET_TCP_JERK: ("<f",),
    Function.SET_TCP_ACCELERATION: ("<f",),
    Function.SET_JOINT_JERK: ("<f",),
    Function.SET_JOINT_ACCELERATION: ("<f",),
    Function.SET_TCP_OFFSET: ("<6f",),
    Function.SET_LOAD: ("<4f",),
    Function.SET_COLLISION_SENSITIVITY: ("B",),
    Function.SET_TEACH_SENSITIVITY: ("B",),
    Function.GET_JOINTS: ("", "B"),
    Function.GET_IK: ("<6f", "<6fB", "<6fB7f"),
    Function.GET_FK: ("<7f",),
    Function.IS_JOINT_LIMIT: ("<7f",),
    Function.IS_TCP_LIMIT: ("<6f",),
    Function.SET_REDUCED_TCP_SPEED: ("<f",),
    Function.SET_REDUCED_JOINT_SPEED: ("<f",),
    Function.SET_REDUCED_MODE: ("B",),
    Function.SET_GRAVITY_DIRECTION: ("<3f",),
    Function.SET_BOUNDARY: ("<6i",),
    Function.SET_REDUCED_JOINT_RANGE: ("<14f",),
    Function.SET_FENCE: ("B",),
    Function.SET_COLLISION_REBOUND: ("B",),
    Function.SET_APPROXIMATE: ("B",),
    Function.SET_REPORT_CURRENT: ("B",),
    Function.SET_WORLD_OFFSET: ("<6f",),
    Function.GET_POSE_OFFSET: ("<12f2B",),
    Function.SET_SELF_COLLISION: ("B",),
    Function.SET_COLLISION_TOOL: ("B", "<fB", "<2fB", "<3fB", "<6fB"),
    Function.SET_SIMULATION: ("B",),
    Function.SET_CARTESIAN_CONTINUOUS: ("B",),
    Function.JOINT_VELOCITY: ("<7fB", "<7fBf"),
    Function.CARTESIAN_VELOCITY: ("<6fB", "<6fBf"),
    # 7 values, speed, acceleration, time, radius; is joint motion, is axis-angle, only check, motion type.
    Function.MOVE_RELATIVE: ("<11f2B", "<11f3B", "<11f4B"),
    Function.MOVE_LINE_AXIS_ANGLE: ("<9f2B", "<9f3B", "<9f4B"),
    Function.SERVO_CARTESIAN_AXIS_ANGLE: ("<8fiB",),
    Function.SERVO_READ_16: (">BH",),
    Function.SERVO_READ_32: (">BH",),
    Function.SET_TOOL_MODBUS_TIMEOUT: (">H",),
    Function.TOOL_WRITE_16: (">BH|<f", ">BH|<fB"),
    Function.TOOL_READ_16: (">BH",),
    Function.TOOL_WRITE_32: (">BH|<f",),
    Function.TOOL_READ_32: (">BH",),
    Function.SET_ANALOG_1: (">H", ">HB"),
    Function.SET_ANALOG_2: (">H", ">HB"),
    Function.SET_INPUT_FUNCTION: ("2B",),
    Function.SET_OUTPUT_FUNCTION: ("2B",),
    Function.DELAYED_OUTPUT: ("<2Bf",),
    Function.DELAYED_TOOL_OUTPUT: ("<2Bf",),
    Function.OUTPUT_AT_POSITION: ("<2B4f",),
    Function.TOOL_OUTPUT_AT_POSITION: ("<2B4f",),
    Function.SET_IO_RESET: ("2B",),
    Function.ANALOG_AT_POSITION: (">BH|<4f",),
    Function.SET_COMMON_PARAMETER: ("<Bf",),
    Function.GET_COMMON_PARAMETER: ("B",),
    Function.GET_COMMON_INFORMATION: ("B",),
    Function.SET_FEEDBACK: ("B",),
}


_PLAIN = (Function.RS485, Function.SET_OUTPUTS)
"""Functions whose payload is passed on as it is: frames of a bus, and one or two words with an optional byte."""


class _Layout:
    """One layout of a payload."""

    def __init__(self, text: str) -> None:
        parts = [Struct(part if part[:1] in "<>" else f"<{part}") for part in text.split("|")]
        self._parts = parts
        self.size = sum(part.size for part in parts)

    def unpack(self, payload: bytes) -> tuple[Any, ...]:
        values: list[Any] = []
        offset = 0
        for part in self._parts:
            values += part.unpack_from(payload, offset)
            offset += part.size
        return tuple(values)


_PAYLOADS = {
    function: sorted((_Layout(text) for text in texts), key=lambda layout: -layout.size)
    for function, texts in _LAYOUTS.items()
}


def decode_payload(function: Function, payload: bytes) -> tuple[Any, ...]:
    """Returns the values of a request's payload, by its longest layout that fits.

    Raises:
        DecodeError: It is shorter than every layout of the function.
    """
    if function in _PLAIN:
        return (payload,)
    layouts = _PAYLOADS.get(function, ())
    for layout in layouts:
        if layout.size <= len(payload):
            return layout.unpack(payload)
    if not layouts:
        return ()
    raise DecodeError(f"{function.name} needs {layouts[-1].size} bytes, got {len(payload)}")


def encode_values(code: str, *values: float) -> bytes:
    """Returns numbers of one type: "f" little-endian floats, "B" bytes, "H", "h" and "i" big-endian integers.

    Raises:
        InvalidValueError: A number is beyond the range of single precision.
    """
    if code == "f":
        try:
            return Struct(f"<{len(values)}f").pack(*values)
        except OverflowError:
            raise InvalidValueError("answer", list(values), "is beyond single precision") from None
    return Struct(f">{len(values)}{code}").pack(*(int(value) for value in values))
