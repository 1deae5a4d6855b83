"""What the UFACTORY arms share: limits, form of their tables. At zero pose their forearms hang and flanges look down.

`MANUAL` is the maker's user manual, `PROTOCOL` that of its protocol, `KINEMATICS` its page on kinematic and dynamic
parameters, `ROS` its description package xarm_description, `SDK` the tables of its client library 1.18.4.

The links' frames of `ROS` are those of Craig's convention, turned about the joint's axis so that all joint angles are
zero at the arm's zero pose. All origins are then in the base's xz plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, radians
from types import MappingProxyType
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.limits import ArmAngleLimits, CartesianLimits, JointLimits, Limits
from rcilab.makers.ufactory.bounds import (
    JOINT_ACCELERATION,
    JOINT_JERK,
    JOINT_VELOCITY,
    SERVO_SPEED_FACTOR,
    TOOL_ACCELERATION,
    TOOL_JERK,
    TOOL_ROTATION,
)
from rcilab.makers.ufactory.conditions import ufactory_conditions
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.robots.description import DhRow, Link, RobotDescription, Rod

MANUAL = "user manual of UFACTORY Studio"
PROTOCOL = "maker's protocol manual"
KINEMATICS = "maker's page Kinematic and Dynamic Parameters"
ROS = "maker's description package xarm_description"
SDK = "tables of the client library 1.18.4"

JointOrigin = tuple[tuple[float, float, float], tuple[int, int, int]]
"""A joint as in the maker's description: position in the frame before, [m], and roll, pitch, yaw in quarter turns."""
Body = tuple[float, tuple[float, float, float], tuple[float, float, float, float, float, float]]
"""Mass, [kg], centre, [m], and Ixx, Ixy, Ixz, Iyy, Iyz, Izz about it, [kg m^2], in the maker's frame of the link."""


def ufactory_limits(
    lower: Sequence[float], upper: Sequence[float], torque: Sequence[float], tool_velocity: float
) -> Limits:
    """Returns the limits of an arm.

    Args:
        lower: Smallest joint angles, [rad].
        upper: Largest joint angles, [rad].
        torque: Of the joints, [N m].
        tool_velocity: [m/s].
    """
    n = len(lower)
    joint: dict[str, Any] = {
        "velocity": JOINT_VELOCITY,
        "acceleration": JOINT_ACCELERATION,
        "jerk": JOINT_JERK,
        "torque_rate": inf,
        "collision_threshold": inf,
        "stiffness": inf,
    }
    joint = {name: readonly_copy([value] * n) for name, value in joint.items()}
    sources = {
        "joint.lower": f"{SDK}, joint ranges",
        "joint.upper": f"{SDK}, joint ranges",
        "joint.velocity": f"{MANUAL}, 10, joint motion, speed",
        "joint.acceleration": f"{MANUAL}, 10, joint motion, acc; {SDK}",
        "joint.jerk": f"{MANUAL}, 10, joint motion, jerk",
        "joint.torque": f"{ROS}, effort of the joints",
        "joint.torque_rate": "the interface takes no torques",
        "joint.collision_threshold": "the interface has sensitivities from 0 to 5 instead",
        "joint.stiffness": "the interface has no impedance",
        "cartesian.translation_velocity": f"{MANUAL}, 10, TCP motion, speed",
        "cartesian.translation_acceleration": f"{MANUAL}, 10, TCP motion, acc",
        "cartesian.translation_jerk": f"{MANUAL}, 10, TCP motion, jerk",
        "cartesian.rotation_velocity": f"{PROTOCOL}, 4, speed of a pure rotation",
        "cartesian.rotation_acceleration": "the maker gives no figure; that of a joint",
        "cartesian.rotation_jerk": "the maker gives no figure; that of a joint",
        "cartesian.translation_stiffness": "the interface has no impedance",
        "cartesian.rotation_stiffness": "the interface has no impedance",
        "cartesian.force": "the interface takes no desired force",
        "cartesian.moment": "the interface takes no desired moment",
        "joint_tool_velocity": f"{SDK}, table of codes, 60, and set_linear_spd_limit_factor ({SERVO_SPEED_FACTOR:g})",
    }
    if n == 7:
        sources |= {
            f"arm_angle.{name}": "the maker gives no figure; that of joint 3, which is the arm angle"
            for name in ("velocity", "acceleration", "jerk")
        }
    return Limits(
        joint=JointLimits(
            lower=readonly_copy(lower),
            upper=readonly_copy(upper),
            torque=readonly_copy(torque),
            **joint,
        ),
        cartesian=CartesianLimits(
            translation_velocity=tool_velocity,
            translation_acceleration=TOOL_ACCELERATION,
            translation_jerk=TOOL_JERK,
            rotation_velocity=TOOL_ROTATION,
            rotation_acceleration=JOINT_ACCELERATION,
            rotation_jerk=JOINT_JERK,
            translation_stiffness=inf,
            rotation_stiffness=inf,
            force=inf,
            moment=inf,
        ),
        arm_angle=(
            ArmAngleLimits(velocity=JOINT_VELOCITY, acceleration=JOINT_ACCELERATION, jerk=JOINT_JERK)
            if n == 7
            else None
        ),
        joint_tool_velocity=SERVO_SPEED_FACTOR * tool_velocity,
        sources=MappingProxyType(sources),
    )


def build_ufactory(
    *,
    name: str,
    limits: Limits,
    dh: tuple[DhRow, ...],
    origins: Sequence[JointOrigin],
    base: Link,
    bodies: Sequence[Body],
    body_source: str,
    rods: tuple[tuple[Rod, ...], ...],
    home_deg: Sequence[float],
    rated_payload: float,
) -> RobotDescription:
    """Returns an arm.

    Args:
        name: Name of the arm.
        limits: From `ufactory_limits`.
        dh: The maker's standard Denavit-Hartenberg rows.
        origins: The joints of the maker's description, with the lengths of `dh`.
        base: The base.
        bodies: The links, one per joint.
        body_source: Name of the file in the maker's description package that has them.
        rods: Shapes of base and links, fitted to the meshes of the maker's description package.
        home_deg: Joint angles away from limits and singularities, [deg].
        rated_payload: [kg].
    """
    source = f"{ROS}, {body_source}, the default of this arm"
    return RobotDescription(
        name=name,
        maker="ufactory",
        faults=UfactoryError,
        conditions=ufactory_conditions,
        dh=dh,
        dh_source=f"{KINEMATICS}, standard D-H parameters of the arm as designed; a real one is calibrated",
        base=base,
        links=tuple(_link(frame, body, source) for frame, body in zip(_zero_frames(origins), bodies, strict=True)),
        limits=limits,
        home=readonly_copy([radians(angle) for angle in home_deg]),
        rated_payload=rated_payload,
        rated_payload_source="maker's data sheet",
        rods=rods,
    )


def ufactory_base(body: Body, tensor_source: str = ROS) -> Link:
    """Returns the base, whose frame is that of the arm."""
    return _link(np.eye(4), body, ROS if tensor_source == ROS else f"mass and centre: {ROS}; tensor: {tensor_source}")


def _zero_frames(origins: Sequence[JointOrigin]) -> list[Array]:
    """Returns the maker's frames of the links in base when all joint angles are zero, shape (4, 4) each, [m]."""
    T, frames = np.eye(4), []
    for position, turns in origins:
        step = np.eye(4)
        step[:3, 3] = position
        for axis, turn in reversed(tuple(enumerate(turns))):
            step[:3, :3] = step[:3, :3] @ _quarter_turns(axis, turn)
        T = T @ step
        frames.append(T)
    return frames


def _quarter_turns(axis: int, count: int) -> Array:
    quarter = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    quarter[[i, i, j, j], [i, j, i, j]] = 0.0, -1.0, 1.0, 0.0
    return np.linalg.matrix_power(quarter, count % 4)


def _link(frame: Array, body: Body, source: str) -> Link:
    mass, centre, (xx, xy, xz, yy, yz, zz) = body
    R = frame[:3, :3]
    inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    return Link(
        mass=mass,
        center_of_mass=readonly_copy(R @ np.array(centre) + 0.0),
        inertia=readonly_copy(inertia + 0.0),
        origin_height=float(frame[2, 3]),
        origin_ahead=float(frame[0, 3]),
        source=source,
    )


def rod(start: tuple[float, float, float], end: tuple[float, float, float], radius: float) -> Rod:
    """Returns a rod in the frame of its link, lengths in [m]."""
    return Rod(start=start, end=end, radius=radius)
