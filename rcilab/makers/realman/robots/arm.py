"""What the RealMan arms share: the sources of their figures, their limits, and their form as a description.

`ALGO` is the offline part of the maker's client library, which has geometry and limits of every arm. `PACKAGE` is the
maker's public ROS 2 description package.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf, radians, sqrt
from types import MappingProxyType

from rcilab.core.arrays import readonly_copy
from rcilab.core.limits import ArmAngleLimits, CartesianLimits, JointLimits, Limits
from rcilab.makers.realman.bounds import (
    ANGULAR_ACCELERATION,
    ANGULAR_SPEED,
    DEGREES_PER_TURN,
    LINE_ACCELERATION,
    LINE_SPEED,
    SECONDS_PER_MINUTE,
)
from rcilab.makers.realman.conditions import realman_conditions
from rcilab.makers.realman.errors import RealManError
from rcilab.robots.description import DhRow, Link, RobotDescription, Rod

ALGO = "the maker's client library (Robotic_Arm 1.1.6), class Algo"
PAGES = "maker's pages on the JSON protocol"
PACKAGE = "maker's public ROS 2 description package, inertials, in the axes of rcilab's link frames"

_ACCELERATION = radians(100.0 * DEGREES_PER_TURN / SECONDS_PER_MINUTE)  # [rad/s^2] 100 RPM/s.
_DISC_RADIUS, _DISC_REACH = 0.014, 0.018  # [m] Of the rods that make the disc of a flange.
_RISE = 0.01  # [s] Time to full acceleration, from which the jerk follows: rcilab's own value.

Figures = tuple[float, tuple[float, float, float], tuple[float, float, float, float, float, float]]
"""Mass [kg]; centre of mass in the link's frame [m]; Ixx, Ixy, Ixz, Iyy, Iyz, Izz about it [kg m^2]."""


def realman_limits(
    *,
    lower_deg: Sequence[float],
    upper_deg: Sequence[float],
    speed_deg: Sequence[float],
    torque: Sequence[float],
    torque_source: str,
) -> Limits:
    """Returns the limits of an arm.

    Args:
        lower_deg: Smallest joint angles, [deg].
        upper_deg: Largest joint angles, [deg].
        speed_deg: Largest joint speeds, [deg/s].
        torque: Largest joint torques, [N m].
        torque_source: Source of the torques.
    """
    n = len(lower_deg)
    unused = "the interface has none; a value that no command reaches"
    joint = JointLimits(
        lower=readonly_copy([radians(angle) for angle in lower_deg]),
        upper=readonly_copy([radians(angle) for angle in upper_deg]),
        velocity=readonly_copy([radians(speed) for speed in speed_deg]),
        acceleration=readonly_copy([_ACCELERATION] * n),
        jerk=readonly_copy([_ACCELERATION / _RISE] * n),
        torque=readonly_copy(torque),
        torque_rate=readonly_copy([1000.0] * n),
        collision_threshold=readonly_copy([inf] * n),
        stiffness=readonly_copy([inf] * n),
    )
    sources = {
        "joint.lower": f"{ALGO}, joint_min_limit",
        "joint.upper": f"{ALGO}, joint_max_limit",
        "joint.velocity": f"{ALGO}, joint_max_speed, in deg/s",
        "joint.acceleration": f"{ALGO}, joint_max_acc: 100 RPM/s",
        "joint.jerk": f"rcilab: the acceleration within {_RISE} s; the maker names none",
        "joint.torque": torque_source,
        "joint.torque_rate": unused,
        "joint.collision_threshold": unused,
        "joint.stiffness": unused,
        "cartesian.translation_velocity": f"{PAGES}, set_arm_init",
        "cartesian.translation_acceleration": f"{PAGES}, set_arm_init",
        "cartesian.rotation_velocity": f"{PAGES}, set_arm_init",
        "cartesian.rotation_acceleration": f"{PAGES}, set_arm_init",
        "cartesian.translation_jerk": f"rcilab: the acceleration within {_RISE} s; the maker names none",
        "cartesian.rotation_jerk": f"rcilab: the acceleration within {_RISE} s; the maker names none",
        "cartesian.translation_stiffness": unused,
        "cartesian.rotation_stiffness": unused,
        "cartesian.force": unused,
        "cartesian.moment": unused,
    }
    arm_angle = None
    if n == 7:
        arm_angle = ArmAngleLimits(velocity=radians(180.0), acceleration=_ACCELERATION, jerk=_ACCELERATION / _RISE)
        names = ("velocity", "acceleration", "jerk")
        sources |= {f"arm_angle.{name}": "rcilab: as for joint 3; the maker names none" for name in names}
    return Limits(
        joint=joint,
        cartesian=CartesianLimits(
            translation_velocity=LINE_SPEED,
            translation_acceleration=LINE_ACCELERATION,
            translation_jerk=LINE_ACCELERATION / _RISE,
            rotation_velocity=ANGULAR_SPEED,
            rotation_acceleration=ANGULAR_ACCELERATION,
            rotation_jerk=ANGULAR_ACCELERATION / _RISE,
            translation_stiffness=inf,
            rotation_stiffness=inf,
            force=inf,
            moment=inf,
        ),
        arm_angle=arm_angle,
        sources=MappingProxyType(sources),
    )


def build_realman(
    *,
    name: str,
    dh: tuple[DhRow, ...],
    dh_source: str,
    limits: Limits,
    bodies: Sequence[Figures],
    origins: Sequence[tuple[float, float, float]],
    body_source: str = PACKAGE,
    rods: tuple[tuple[Rod, ...], ...],
    home_deg: Sequence[float],
    rated_payload: float,
) -> RobotDescription:
    """Returns an arm.

    Args:
        name: Name of the arm.
        dh: Standard Denavit-Hartenberg rows, one per joint.
        dh_source: Their source.
        limits: From `realman_limits`.
        bodies: Base and links.
        origins: Origins of the links' frames in base at zero pose, [m]; the last one is the flange.
        body_source: Source of the bodies.
        rods: Shapes of base and links.
        home_deg: Joint angles of the home pose, [deg].
        rated_payload: [kg].
    """
    base, *links = (
        _link(figures, origin, body_source) for figures, origin in zip(bodies, ((0.0, 0.0, 0.0), *origins), strict=True)
    )
    return RobotDescription(
        name=name,
        maker="realman",
        faults=RealManError,
        conditions=realman_conditions,
        dh=dh,
        dh_source=dh_source,
        base=base,
        links=tuple(links),
        limits=limits,
        home=readonly_copy([radians(angle) for angle in home_deg]),
        rated_payload=rated_payload,
        rated_payload_source="maker's data sheet",
        rods=rods,
    )


def chain_rods(
    points: Sequence[tuple[float, float, float]],
    spans: Sequence[Sequence[int]],
    radii: Sequence[float],
    origins: Sequence[tuple[float, float, float]],
    direction: tuple[int, int, int] = (0, 0, 1),
) -> tuple[tuple[Rod, ...], ...]:
    """Returns the rods of base and links along a line through an arm, after its figures and pictures.

    Args:
        points: Points of the line in base at zero pose, [m].
        spans: For base and all links but the last, the indices of their points; the last link is a disc.
        radii: Their radii, [m].
        origins: Origins of the links' frames in base at zero pose, [m].
        direction: Direction of the flange in base at zero pose, along an axis.
    """

    def rods(span: Sequence[int], radius: float, origin: tuple[float, float, float]) -> tuple[Rod, ...]:
        local = [_less(points[index], origin) for index in span]
        return tuple(Rod(start=a, end=b, radius=radius) for a, b in pairwise(local))

    frames = ((0.0, 0.0, 0.0), *origins[:-1])
    return *(rods(span, r, origin) for span, r, origin in zip(spans, radii, frames, strict=True)), _disc(direction)


def _disc(direction: tuple[int, int, int]) -> tuple[Rod, ...]:
    """Returns the disc of the flange as a star of rods, in the last link's frame."""
    axis = direction.index(1)
    first, second = (other for other in range(3) if other != axis)

    def rod(a: float, b: float) -> Rod:
        ends = []
        for sign in (-1.0, 1.0):
            end = [-_DISC_RADIUS * value for value in direction]
            end[first], end[second] = sign * a, sign * b
            ends.append((end[0], end[1], end[2]))
        return Rod(start=ends[0], end=ends[1], radius=_DISC_RADIUS)

    slant = _DISC_REACH * sqrt(0.5)
    return rod(_DISC_REACH, 0.0), rod(0.0, _DISC_REACH), rod(slant, slant), rod(slant, -slant)


def _less(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _link(figures: Figures, origin: tuple[float, float, float], source: str) -> Link:
    mass, center, (xx, xy, xz, yy, yz, zz) = figures
    ahead, aside, height = origin
    return Link(
        mass=mass,
        center_of_mass=readonly_copy(center),
        inertia=readonly_copy([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]),
        origin_height=height,
        origin_ahead=ahead,
        origin_aside=aside,
        source=source,
    )
