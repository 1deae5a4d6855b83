"""The FCI in bytes, packed by hand: what a peer must know that shares no code with the package it tests.

Everything is little-endian and packed, matrices are column-major. Offsets of a state are written out for each version
rather than added up, so that a wrong count shows.
"""

from __future__ import annotations

import struct

VERSIONS = (5, 10)
STATE_SIZES = {5: 2373, 10: 1377}  # [bytes]
COMMAND_SIZES = {5: 370, 10: 371}  # [bytes]
HEADER_SIZE = 12  # [bytes]

COMMANDS = {  # name: number in version 5 and in version 10.
    "connect": (0, 0), "move": (1, 1), "stop_move": (2, 2), "get_cartesian_limit": (3, None),
    "set_collision_behavior": (4, 3), "set_joint_impedance": (5, 4), "set_cartesian_impedance": (6, 5),
    "set_guiding_mode": (7, 6), "set_ee_to_k": (8, 7), "set_ne_to_ee": (9, 8), "set_load": (10, 9),
    "set_filters": (11, None), "automatic_error_recovery": (12, 10), "get_robot_model": (None, 11),
    "load_model_library": (13, None),
}  # fmt: skip
SETTERS = tuple(name for name in COMMANDS if name.startswith("set_"))

_SETTER = ("success", "not possible", "invalid argument")
_MOVE_5 = (
    "success", "started", "preempted", "not possible", "singular", "invalid argument", "reflex", "emergency",
    "input error", "aborted",
)  # fmt: skip
_MOVE_10 = (
    "success", "started", "preempted", "preempted by safety", "rejected by safety", "not possible", "singular",
    "invalid argument", "reflex", "emergency", "input error", "aborted",
)  # fmt: skip
_RECOVERY_5 = ("success", "not possible", "manual recovery", "reflex", "emergency", "aborted")
_RECOVERY_10 = ("success", "not possible", "safety", "manual recovery", "reflex", "emergency", "aborted")
_STOP_5 = ("success", "not possible", "emergency", "reflex", "aborted")
_STOP_10 = ("success", "not possible", "safety", "emergency", "reflex", "aborted")
STATUSES = {
    5: {"move": _MOVE_5, "stop_move": _STOP_5, "automatic_error_recovery": _RECOVERY_5,
        "load_model_library": ("success", "error"), "connect": ("success", "incompatible")},
    10: {"move": _MOVE_10, "stop_move": _STOP_10, "automatic_error_recovery": _RECOVERY_10,
         "connect": ("success", "incompatible")},
}  # fmt: skip

JOINT_IMPEDANCE, CARTESIAN_IMPEDANCE, EXTERNAL, OTHER = range(4)
JOINT_POSITION, JOINT_VELOCITY, CARTESIAN_POSE, CARTESIAN_VELOCITY, NONE = range(5)  # In Move; in the state one more.
ROBOT_OTHER, ROBOT_IDLE, ROBOT_MOVE, ROBOT_GUIDING, ROBOT_REFLEX, ROBOT_USER_STOPPED, ROBOT_RECOVERING = range(7)

ERROR_NAMES = (
    "joint_position_limits_violation", "cartesian_position_limits_violation", "self_collision_avoidance_violation",
    "joint_velocity_violation", "cartesian_velocity_violation", "force_control_safety_violation", "joint_reflex",
    "cartesian_reflex", "max_goal_pose_deviation_violation", "max_path_pose_deviation_violation",
    "cartesian_velocity_profile_safety_violation", "joint_position_motion_generator_start_pose_invalid",
    "joint_motion_generator_position_limits_violation", "joint_motion_generator_velocity_limits_violation",
    "joint_motion_generator_velocity_discontinuity", "joint_motion_generator_acceleration_discontinuity",
    "cartesian_position_motion_generator_start_pose_invalid", "cartesian_motion_generator_elbow_limit_violation",
    "cartesian_motion_generator_velocity_limits_violation", "cartesian_motion_generator_velocity_discontinuity",
    "cartesian_motion_generator_acceleration_discontinuity", "cartesian_motion_generator_elbow_sign_inconsistent",
    "cartesian_motion_generator_start_elbow_invalid", "force_controller_desired_force_tolerance_violation",
    "start_elbow_sign_inconsistent", "communication_constraints_violation", "power_limit_violation",
    "cartesian_motion_generator_joint_position_limits_violation",
    "cartesian_motion_generator_joint_velocity_limits_violation",
    "cartesian_motion_generator_joint_velocity_discontinuity",
    "cartesian_motion_generator_joint_acceleration_discontinuity",
    "cartesian_position_motion_generator_invalid_frame_flag", "controller_torque_discontinuity",
    "joint_p2p_insufficient_torque_for_planning", "tau_J_range_violation", "instability_detected",
    "joint_move_in_wrong_direction", "cartesian_spline_motion_generator_violation",
    "joint_via_motion_generator_planning_joint_limit_violation", "base_acceleration_initialization_timeout",
    "base_acceleration_invalid_reading",
)  # fmt: skip

FIELDS = {  # name: (count, offset in version 10, offset in version 5)
    "O_T_EE": (16, 8, 8), "O_T_EE_d": (16, 72, 136), "F_T_EE": (16, 136, 264), "EE_T_K": (16, 200, 392),
    "F_T_NE": (16, 264, 520), "NE_T_EE": (16, 328, 648), "m_ee": (1, 392, 776), "I_ee": (9, 396, 784),
    "F_x_Cee": (3, 432, 856), "m_load": (1, 444, 880), "I_load": (9, 448, 888), "F_x_Cload": (3, 484, 960),
    "elbow": (2, 496, 984), "elbow_d": (2, 504, 1000), "tau_J": (7, 512, 1016), "tau_J_d": (7, 540, 1072),
    "dtau_J": (7, 568, 1128), "q": (7, 596, 1184), "q_d": (7, 624, 1240), "dq": (7, 652, 1296),
    "dq_d": (7, 680, 1352), "ddq_d": (7, 708, 1408), "joint_contact": (7, 736, 1464),
    "cartesian_contact": (6, 764, 1520), "joint_collision": (7, 788, 1568), "cartesian_collision": (6, 816, 1624),
    "tau_ext_hat_filtered": (7, 840, 1672), "O_F_ext_hat_K": (6, 868, 1728), "K_F_ext_hat_K": (6, 892, 1776),
    "O_dP_EE_d": (6, 916, 1824), "O_ddP_O": (3, 940, 1872), "elbow_c": (2, 952, 1896), "delbow_c": (2, 960, 1912),
    "ddelbow_c": (2, 968, 1928), "O_T_EE_c": (16, 976, 1944), "O_dP_EE_c": (6, 1040, 2072),
    "O_ddP_EE_c": (6, 1064, 2120), "theta": (7, 1088, 2168), "dtheta": (7, 1116, 2224),
    "accelerometer_top": (18, 1144, None), "accelerometer_bottom": (18, 1216, None),
}  # fmt: skip
_TAILS = {5: 2280, 10: 1288}  # Offsets of the motion generator's byte.


class State:
    """A received state; fields are read from the bytes when they are asked for, as tuples of floats."""

    __slots__ = ("data", "version")

    def __init__(self, data: bytes, version: int) -> None:
        assert len(data) == STATE_SIZES[version], f"a state has {STATE_SIZES[version]} bytes, not {len(data)}"
        self.data, self.version = data, version

    def __getattr__(self, name: str) -> tuple[float, ...]:
        if name not in FIELDS:
            raise AttributeError(name)
        count, single, double = FIELDS[name]
        if self.version == 10:
            return struct.unpack_from(f"<{count}f", self.data, single)
        assert double is not None, f"version 5 has no {name}"
        return struct.unpack_from(f"<{count}d", self.data, double)

    @property
    def names(self) -> tuple[str, ...]:
        """The fields of this version."""
        return tuple(name for name, (_, _, double) in FIELDS.items() if self.version == 10 or double is not None)

    @property
    def message_id(self) -> int:
        return struct.unpack_from("<Q", self.data)[0]

    @property
    def generator(self) -> int:
        return self.data[_TAILS[self.version]]

    @property
    def controller(self) -> int:
        return self.data[_TAILS[self.version] + 1]

    @property
    def flags(self) -> bytes:
        """All 82 bytes of errors and reflex reason."""
        start = _TAILS[self.version] + 2
        return self.data[start : start + 82]

    @property
    def errors(self) -> tuple[str, ...]:
        return _named(self.flags[:41])

    @property
    def reflex_reason(self) -> tuple[str, ...]:
        return _named(self.flags[41:])

    @property
    def robot_mode(self) -> int:
        return self.data[_TAILS[self.version] + 84]

    @property
    def success_rate(self) -> float:
        return struct.unpack_from("<f" if self.version == 10 else "<d", self.data, _TAILS[self.version] + 85)[0]


def _named(flags: bytes) -> tuple[str, ...]:
    return tuple(name for name, flag in zip(ERROR_NAMES, flags, strict=True) if flag)


def number_of(name: str, version: int) -> int:
    """Returns the number of a command."""
    number = COMMANDS[name][VERSIONS.index(version)]
    assert number is not None, f"version {version} has no {name}"
    return number


def commands_of(version: int) -> tuple[str, ...]:
    """Returns the commands of a version."""
    return tuple(name for name, numbers in COMMANDS.items() if numbers[VERSIONS.index(version)] is not None)


def status_name(name: str, version: int, status: int) -> str:
    """Returns the meaning of a status."""
    names = STATUSES[version].get(name)
    if names is None:
        names = _SETTER if version == 5 or name not in SETTERS else (*_SETTER, "safety")
    return names[status]


def pack_frame(number: int, command_id: int, payload: bytes = b"") -> bytes:
    """Returns a request."""
    return struct.pack("<III", number, command_id, HEADER_SIZE + len(payload)) + payload


def doubles(*values: float) -> bytes:
    """Returns numbers as a payload holds them."""
    return struct.pack(f"<{len(values)}d", *values)


DEVIATION = (10.0, 3.12, 6.283185307179586)
"""What the client library sends when its program gives none: [m, rad, rad]."""


def pack_move(
    version: int,
    controller: int,
    generator: int,
    path: tuple[float, ...] = DEVIATION,
    goal: tuple[float, ...] = DEVIATION,
    goal_velocity: tuple[float, ...] | None = None,
) -> bytes:
    """Returns the payload of Move; `goal_velocity` makes it asynchronous, in version 10."""
    payload = struct.pack("<II", controller, generator) + doubles(*path, *goal)
    if version == 10:
        payload += bytes([goal_velocity is not None]) + doubles(*(goal_velocity or (0.0,) * 7))
    assert goal_velocity is None or version == 10
    return payload


def pack_command(
    version: int,
    message_id: int,
    *,
    q: tuple[float, ...],
    dq: tuple[float, ...],
    pose: tuple[float, ...],
    twist: tuple[float, ...],
    elbow: tuple[float, ...],
    has_elbow: bool,
    finished: bool,
    tau: tuple[float, ...],
    torques_finished: bool,
) -> bytes:
    """Returns a command datagram."""
    data = struct.pack("<Q", message_id) + doubles(*q, *dq, *pose, *twist, *elbow) + bytes([has_elbow, finished])
    data += doubles(*tau)
    return data + bytes([torques_finished]) if version == 10 else data
