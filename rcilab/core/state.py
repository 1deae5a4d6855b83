"""The state of a robot in one cycle, and its modes.

Names follow RCI manual V1.3.1, section 3.2.2; `T_base_tool` is the pose of the tool in the base. Vectors have one
element per joint of the arm, without the unused seventh element that the RCI sends for a 6-axis arm.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, make_dataclass
from enum import IntEnum
from math import degrees, nan
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from rcilab.core.arrays import Array, JointVector, described, make_readonly
from rcilab.core.errors import InvalidValueError
from rcilab.core.fault import FaultCode, name_faults
from rcilab.core.spatial import IDENTITY, Pose

Mode: TypeAlias = Literal["joint_position", "joint_impedance", "cartesian_position", "cartesian_impedance", "torque"]
"""Command mode of a motion: the members of `ControllerMode` that move the arm, in lower case."""
MODES: tuple[Mode, ...] = get_args(Mode)
COMPLIANT_MODES: tuple[Mode, ...] = ("joint_impedance", "cartesian_impedance", "torque")
"""Modes in which forces move the arm, too: it may end next to its goal."""


class ControllerMode(IntEnum):
    """How the controller follows commands (manual 3.1.1)."""

    JOINT_POSITION = 0
    CARTESIAN_POSITION = 1
    JOINT_IMPEDANCE = 2
    CARTESIAN_IMPEDANCE = 3
    TORQUE = 4
    OTHER = 5


class MotionGeneratorMode(IntEnum):
    """Kind of command of a motion, numbered as in the state (a StartMove request numbers it differently)."""

    IDLE = 0
    JOINT_POSITION = 1
    JOINT_VELOCITY = 2
    CARTESIAN_POSITION = 3
    CARTESIAN_VELOCITY = 4


class RobotMode(IntEnum):
    """Operating state of the robot."""

    OTHER = 0
    IDLE = 1
    MOVE = 2
    GUIDING = 3
    REFLEX = 4
    USER_STOPPED = 5
    AUTOMATIC_ERROR_RECOVERY = 6


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RobotState:
    """Everything the robot reports in one cycle. Commanded values end in `_c`; all others are measured."""

    message_id: int
    """Number of the controller cycle; the command for this state repeats it."""
    q: JointVector
    """Joint angles, [rad]."""
    q_c: JointVector
    """Commanded joint angles, [rad]."""
    dq: JointVector
    """Joint velocities, [rad/s] (manual: dq_m)."""
    dq_c: JointVector
    """Commanded joint velocities, [rad/s]."""
    ddq_c: JointVector
    """Commanded joint accelerations, [rad/s^2]."""
    T_base_tool: Pose
    """Pose of the tool in base, [m] (manual: toolTobase_pos_m)."""
    T_base_tool_c: Pose
    """Commanded pose of the tool in base, [m]."""
    tool_velocity_c: Array
    """Commanded twist of the tool in base axes, linear first, (6,), [m/s, rad/s]."""
    tool_acceleration_c: Array
    """Commanded acceleration of the tool in base axes, linear first, (6,), [m/s^2, rad/s^2]."""
    psi: float
    """Arm angle, [rad]."""
    psi_c: float
    """Commanded arm angle, [rad]."""
    dpsi_c: float
    """Commanded arm-angle velocity, [rad/s]."""
    ddpsi_c: float
    """Commanded arm-angle acceleration, [rad/s^2]."""
    tau: JointVector
    """Joint torques, [N m]."""
    tau_filtered: JointVector
    """Filtered joint torques, [N m]."""
    tau_c: JointVector
    """Commanded joint torques, [N m]."""
    dtau_c: JointVector
    """Rate of the commanded joint torques, [N m/s] (manual: tau_vel_c)."""
    tau_ext_in_base: Array
    """External force and moment in the base frame, (6,), [N, N m]. The virtual controller reports what the environment
    exerts on the arm, unless it has `force_sign="by-arm"`; the sign of a real arm is not verified, see the README."""
    tau_ext_in_stiff: Array
    """External force and moment in the force-control frame, (6,), [N, N m]; sign as of `tau_ext_in_base`."""
    theta: JointVector
    """Motor positions, motor side of the gear, [rad] (manual: theta_m). The virtual controller assumes a gear ratio of
    101, typical of strain-wave gears of this size: the manual gives none."""
    dtheta: JointVector
    """Motor velocities, motor side of the gear, [rad/s] (manual: theta_vel_m)."""
    motor_tau: JointVector
    """Motor torques, motor side of the gear, [N m]."""
    motor_tau_filtered: JointVector
    """Filtered motor torques, [N m]."""
    faults: tuple[FaultCode, ...]
    """The error bits that are set, in wire order."""
    success_rate: float
    """Share of the last commands that arrived in time, 0 to 1; 1 until the first command of a motion arrives."""
    motion_generator_mode: MotionGeneratorMode
    controller_mode: ControllerMode
    robot_mode: RobotMode

    def __repr__(self) -> str:
        angles = " ".join(f"{degrees(angle):.2f}" for angle in self.q)
        faults = name_faults(self.faults) or "none"
        modes = f"{self.robot_mode.name}, {self.controller_mode.name}"
        return f"<RobotState {self.message_id}: q = {angles} deg; {modes}; faults: {faults}>"


_MutableState: Any = make_dataclass(
    "_MutableState", [field.name for field in fields(RobotState)], eq=False, repr=False, slots=True
)
"""A mutable class with the fields of `RobotState`, whose instances can change their class to it."""


def build_state(values: Iterable[object]) -> RobotState:
    """Returns a state with these values, one per field, in the order of the fields.

    For the 1 kHz path: the constructor of a frozen dataclass takes six times as long.
    """
    state = _MutableState(*values)
    state.__class__ = RobotState
    return state


def unknown_state(n: int) -> RobotState:
    """Returns a state without any known value, for controllers that report only some of the fields.

    A driver fills in the fields that its controller reports: `replace(unknown_state(6), message_id=1, q=q)`. Numbers
    are NaN, the modes idle, no fault is set.

    Args:
        n: Number of joints.
    """
    joints, six = make_readonly(np.full(n, nan)), make_readonly(np.full(6, nan))
    vectors = {
        "tool_velocity_c": six, "tool_acceleration_c": six, "tau_ext_in_base": six, "tau_ext_in_stiff": six
    }  # fmt: skip
    values = {
        "message_id": 0,
        "T_base_tool": IDENTITY,
        "T_base_tool_c": IDENTITY,
        "faults": (),
        "motion_generator_mode": MotionGeneratorMode.IDLE,
        "controller_mode": ControllerMode.OTHER,
        "robot_mode": RobotMode.IDLE,
    }
    floats = dict.fromkeys(("psi", "psi_c", "dpsi_c", "ddpsi_c", "success_rate"), nan)
    known: dict[str, Any] = {**vectors, **values, **floats}
    return build_state(known.get(field.name, joints) for field in fields(RobotState))


def require_mode(mode: object) -> Mode:
    """Returns `mode` if it is a command mode.

    Raises:
        InvalidValueError: It is not; the message lists the command modes.
    """
    for known in MODES:
        if isinstance(mode, str) and mode == known:
            return known
    raise InvalidValueError("mode", described(mode), f"is unknown; known: {', '.join(MODES)}")
