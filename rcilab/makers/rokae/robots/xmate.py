"""The common data of the four xMate arms: the limits of the manual and the form of their tables.

`MANUAL` is the RCI user manual V1.3.1; `ROS2` the vendor's public ROS 2 description package (figures only).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, radians
from types import MappingProxyType
from typing import Any

import numpy as np

from rcilab.core.arrays import readonly_copy
from rcilab.core.limits import ArmAngleLimits, CartesianLimits, JointLimits, Limits
from rcilab.makers.rokae.conditions import rci_conditions
from rcilab.makers.rokae.faults import Fault
from rcilab.robots.description import DhRow, JointImperfection, Link, RobotDescription, ServoFigures

MANUAL = "RCI user manual V1.3.1"
ROS2 = "vendor's public ROS 2 description package"
SDK = "rate limiter of the vendor's client library"

_MANUAL_AXES_OF_SIX = (0, 1, 3, 4, 5, 6)
"""The 6-axis tables are the 7-axis tables without joint 3; the manual even keeps the column names."""

_SEVEN_AXIS = {
    "position": [radians(angle) for angle in (170, 120, 170, 120, 170, 120, 360)],
    "velocity": [2.175, 2.175, 2.175, 2.175, 2.610, 2.610, 2.610],
    "acceleration": [15.0, 7.5, 10.0, 10.0, 15.0, 15.0, 20.0],
    "jerk": [5000.0, 3500.0, 5000.0, 5000.0, 7500.0, 7500.0, 7500.0],
    "torque": [85.0, 85.0, 85.0, 85.0, 36.0, 36.0, 36.0],
    "torque_rate": [1500.0, 1500.0, 1500.0, 1500.0, 1000.0, 1000.0, 1000.0],
    "collision_threshold": [75.0, 75.0, 60.0, 45.0, 30.0, 30.0, 20.0],
    "stiffness": [3000.0, 3000.0, 3000.0, 3000.0, 300.0, 300.0, 300.0],
}

_JOINT_SOURCES = {
    "joint.lower": "4.4, joint motion limits, q min",
    "joint.upper": "4.4, joint motion limits, q max",
    "joint.velocity": "4.4, joint motion limits, dq max",
    "joint.acceleration": "4.4, joint motion limits, ddq max",
    "joint.jerk": "4.4, joint motion limits, dddq max",
    "joint.torque": "4.4, direct torque control limits, tau max",
    "joint.torque_rate": "4.4, direct torque control limits, dtau max",
}
_CARTESIAN_SOURCES = {
    "cartesian.translation_velocity": "4.4, Cartesian motion limits, Translation, dp",
    "cartesian.translation_acceleration": "4.4, Cartesian motion limits, Translation, ddp",
    "cartesian.translation_jerk": "4.4, Cartesian motion limits, Translation, dddp",
    "cartesian.rotation_velocity": "4.4, Cartesian motion limits, Rotation, dp",
    "cartesian.rotation_acceleration": "4.4, Cartesian motion limits, Rotation, ddp",
    "cartesian.rotation_jerk": "4.4, Cartesian motion limits, Rotation, dddp",
    "cartesian.translation_stiffness": "3.1.6, setCartesianImpedance",
    "cartesian.rotation_stiffness": "3.1.6, setCartesianImpedance",
}
_SEVEN_AXIS_NOTE = "; the manual prints the 6-axis range, this one is the vendor client's for 7 axes"


def build_xmate(
    *,
    name: str,
    dh: tuple[DhRow, ...],
    dh_source: str,
    base: Link,
    links: tuple[Link, ...],
    home_deg: tuple[float, ...],
    rated_payload: float,
) -> RobotDescription:
    """Returns an arm with what all xMate arms have in common.

    Args:
        name: Name of the arm.
        dh: Denavit-Hartenberg rows, one per joint.
        dh_source: Their source.
        base: The base.
        links: The links, one per joint.
        home_deg: Joint angles of the home pose, [deg].
        rated_payload: [kg].
    """
    n = len(dh)
    return RobotDescription(
        name=name,
        dh=dh,
        dh_source=dh_source,
        base=base,
        links=links,
        limits=xmate_limits(n),
        home=readonly_copy([radians(angle) for angle in home_deg]),
        rated_payload=rated_payload,
        rated_payload_source="range the vendor's client accepts for setLoad",
        maker="rokae",
        faults=Fault,
        conditions=rci_conditions,
        servos=xmate_servos(n),
        imperfections=xmate_imperfections(n),
    )


def xmate_limits(n: int) -> Limits:
    """Returns the limits of the 6-axis or the 7-axis arms."""
    axes = range(7) if n == 7 else _MANUAL_AXES_OF_SIX
    table: dict[str, Any] = {name: readonly_copy([row[axis] for axis in axes]) for name, row in _SEVEN_AXIS.items()}
    upper = table.pop("position")
    arms = "xMatePro3, xMatePro7" if n == 7 else "xMate3, xMate7"
    note = _SEVEN_AXIS_NOTE if n == 7 else ""
    sources = {name: f"{MANUAL}, {place} ({arms})" for name, place in _JOINT_SOURCES.items()}
    sources["joint.collision_threshold"] = f"{MANUAL}, 3.1.3, setCollisionBehavior{note}"
    sources["joint.stiffness"] = f"{MANUAL}, 3.1.5, setJointImpedance{note}"
    sources |= {name: f"{MANUAL}, {place} (all xMate arms)" for name, place in _CARTESIAN_SOURCES.items()}
    sources["cartesian.force"] = "range the vendor's client accepts for setCartImpDesiredTau"
    sources["cartesian.moment"] = "range the vendor's client accepts for setCartImpDesiredTau"
    if n == 7:
        for name in ("velocity", "acceleration", "jerk"):
            sources[f"arm_angle.{name}"] = f"{SDK}; the manual gives no figure"
    return Limits(
        joint=JointLimits(lower=readonly_copy(-upper), upper=upper, **table),
        cartesian=CartesianLimits(
            translation_velocity=1.0,
            translation_acceleration=10.0,
            translation_jerk=5000.0,
            rotation_velocity=2.5,
            rotation_acceleration=10.0,
            rotation_jerk=5000.0,
            translation_stiffness=3000.0,
            rotation_stiffness=300.0,
            force=60.0,
            moment=30.0,
        ),
        arm_angle=ArmAngleLimits(velocity=pi, acceleration=10.0, jerk=5000.0) if n == 7 else None,
        sources=MappingProxyType(sources),
    )


def xmate_servos(n: int) -> tuple[ServoFigures, ...]:
    """Returns the servos of an arm with 7 or 6 joints, fitted to 20 s of joint velocities of a real xMatePro3.

    Its commands stopped coming three times, for 12, 12 and 22 cycles (public identification data; docs/pauses.md has
    the figures). The other arms have drives of the same two sizes; there is no recording of one.
    """
    large, small = ServoFigures(bandwidth=110.0, damping=0.9), ServoFigures(bandwidth=190.0, damping=1.2)
    return (*(large,) * (n - 3), *(small,) * 3)


_FRICTION = (0.55, 0.59, 0.59, 0.59, 0.47, 0.44, 0.33)  # [N m]
_TORQUE_STEP = (0.0488,) * 4 + (0.0266,) * 3  # [N m]
_TORQUE_NOISE = (0.08, 0.12, 0.07, 0.15, 0.035, 0.07, 0.011)  # [N m]


def xmate_imperfections(n: int) -> tuple[JointImperfection, ...]:
    """Returns friction and torque sensors of an arm with 7 or 6 joints, from the recording of `xmate_servos`.

    The friction is that of a regression of its torques on those of a rigid arm and the sign of the velocity (0.33 to
    0.59 N m); the step is the smallest difference of two readings; the noise is their content above 20 Hz, pauses left
    out. The 6-axis arms have no joint 3.
    """
    joints = [
        JointImperfection(friction=friction, torque_step=step, torque_noise=noise)
        for friction, step, noise in zip(_FRICTION, _TORQUE_STEP, _TORQUE_NOISE, strict=True)
    ]
    return tuple(joints if n == 7 else (*joints[:2], *joints[3:]))


def pro_heights(d1: float, d3: float, d5: float, d7: float) -> tuple[float, ...]:
    """Returns the heights of the seven link frames at zero pose, [m].

    The manual gives shoulder, elbow, wrist and flange. Joints 3 and 5 lie between them, in the proportions of the
    ROS 2 description of the xMatePro3 (its xMatePro7 repeats the xMatePro3's numbers).
    """
    elbow, wrist = d1 + d3, d1 + d3 + d5
    joint_3 = d1 + d3 * 0.23744 / (0.23744 + 0.15550)
    joint_5 = elbow + d5 * 0.22045 / (0.22045 + 0.14513)
    return 0.0, d1, joint_3, elbow, joint_5, wrist, wrist + d7


def tabled_link(mass: float, center: Sequence[float], tensor: Sequence[float], height: float, source: str) -> Link:
    """Returns a link whose tensor is (Ixx, Iyy, Izz) or (Ixx, Iyy, Izz, Iyz), [kg m^2]."""
    ixx, iyy, izz, iyz = (*tensor, 0.0)[:4]
    inertia = readonly_copy([[ixx, 0.0, 0.0], [0.0, iyy, iyz], [0.0, iyz, izz]])
    return Link(mass=mass, center_of_mass=readonly_copy(center), inertia=inertia, origin_height=height, source=source)


def solid_link(mass: float, center: Sequence[float], radius: float, length: float, height: float) -> Link:
    """Returns a link with the tensor of a solid cylinder along z, lengths in [m].

    The tensors printed for the Pro arms are rounded placeholders: their Izz exceeds `mass * radius**2`, which no body
    of that radius can have. Masses and centres are real.
    """
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    inertia = readonly_copy(np.diag([across, across, mass * radius**2 / 2.0]))
    source = (
        f"mass and centre: {ROS2}; tensor: computed, solid cylinder of radius {radius} m and length "
        f"{length:.3f} m, because the published one is impossible for a link of that radius"
    )
    return Link(mass=mass, center_of_mass=readonly_copy(center), inertia=inertia, origin_height=height, source=source)
