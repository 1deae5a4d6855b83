"""What Panda and FR3 share: 7 axes with offsets at the elbow and the wrist, shapes, home pose, form of the tables.

The flange looks down at zero pose. `PANDA_PAGE` is the maker's page for the Panda, whose geometry the FR3 has.
`LIBRARY` stands for the comments of the maker's client library, with the ranges of settings that the pages leave out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import cos, inf, pi, sin, sqrt
from types import MappingProxyType
from typing import Any

import numpy as np

from rcilab.core.arrays import readonly_copy
from rcilab.core.condition import ConditionTable
from rcilab.core.limits import ArmAngleLimits, CartesianLimits, EndVelocity, JointLimits, Limits
from rcilab.core.spatial import Pose
from rcilab.makers.franka.errors import FrankaError
from rcilab.robots.description import CraigRow, Link, MountedTool, RobotDescription, Rod, rows_from_craig

PANDA_PAGE = "Franka's page Robot and interface specifications (Panda)"
LIBRARY = "comments of libfranka's robot.h"

CRAIG = (
    CraigRow(a=0.0, alpha=0.0, d=0.333),
    CraigRow(a=0.0, alpha=-pi / 2, d=0.0),
    CraigRow(a=0.0, alpha=+pi / 2, d=0.316),
    CraigRow(a=0.0825, alpha=+pi / 2, d=0.0),
    CraigRow(a=-0.0825, alpha=-pi / 2, d=0.384),
    CraigRow(a=0.0, alpha=+pi / 2, d=0.0),
    CraigRow(a=0.088, alpha=+pi / 2, d=0.0),
    CraigRow(a=0.0, alpha=0.0, d=0.107),
)
"""The table as the page prints it, by Craig's convention; the last row is the flange."""

ROTOR_INERTIA = 0.1
"""At each joint, [kg m^2]. The maker publishes none; public simulation models of the arm have this figure, and without
it the maker's own impedance examples are unstable."""
DAMPING = 1.0
"""Of each joint, [N m s/rad], from the same models."""
ELBOW_FLIP = -0.467002423653011  # [rad] Joint 4 with the arm stretched as far as possible; PANDA_PAGE.

_SHOULDER = 0.333  # [m]
_ELBOW = _SHOULDER + 0.316  # [m]
_WRIST = _ELBOW + 0.384  # [m]
_FLANGE = _WRIST - 0.107  # [m]
_ELBOW_AHEAD = 0.0825  # [m]
_HAND_AHEAD = 0.088  # [m]

_SETTINGS = {"torque_rate": 1000.0, "collision_threshold": inf, "stiffness": 14250.0}
_RATES = ("velocity", "acceleration", "jerk")


def franka_limits(
    table: Mapping[str, Sequence[float]],
    *,
    translation: tuple[float, float, float],
    rotation: tuple[float, float, float],
    elbow: tuple[float, float, float],
    near_ends: EndVelocity | None = None,
    sources: Mapping[str, str],
) -> Limits:
    """Returns the limits of an arm.

    Args:
        table: Bounds of the joints by name, 7 numbers each: lower, upper, velocity, acceleration, jerk, torque.
        translation: Velocity, acceleration and jerk of the tool, [m/s, m/s^2, m/s^3].
        rotation: The same of its rotation, [rad/s, ...].
        elbow: The same of joint 3, [rad/s, ...].
        near_ends: How the joints' velocities decrease towards the ends of their ranges; None: they do not.
        sources: Sources of the groups "joint", "translation", "rotation" and "elbow", of "near_ends" if there are such
            bounds, and of single bounds with another source, such as "joint.lower".
    """
    joint: dict[str, Any] = {name: readonly_copy(row) for name, row in table.items()}
    joint |= {name: readonly_copy([value] * 7) for name, value in _SETTINGS.items()}
    of_joints = {f"joint.{name}": sources.get(f"joint.{name}", sources["joint"]) for name in joint}
    of_tool = {f"cartesian.{kind}_{name}": sources[kind] for kind in ("translation", "rotation") for name in _RATES}
    of_elbow = {f"arm_angle.{name}": f"{sources['elbow']}; the arm angle is the elbow's" for name in _RATES}
    if near_ends is not None:
        of_joints["joint.near_ends"] = sources["near_ends"]
    others = {
        "joint.collision_threshold": "the maker names no bound",
        "joint.stiffness": f"{LIBRARY}, setJointImpedance",
        "cartesian.translation_stiffness": f"{LIBRARY}, setCartesianImpedance",
        "cartesian.rotation_stiffness": f"{LIBRARY}, setCartesianImpedance",
        "cartesian.force": "the interface takes no desired force",
        "cartesian.moment": "the interface takes no desired moment",
    }
    tool = dict(zip((f"translation_{name}" for name in _RATES), translation, strict=True))
    tool |= dict(zip((f"rotation_{name}" for name in _RATES), rotation, strict=True))
    return Limits(
        joint=JointLimits(**joint, near_ends=near_ends),
        cartesian=CartesianLimits(
            **tool, translation_stiffness=3000.0, rotation_stiffness=300.0, force=inf, moment=inf
        ),
        arm_angle=ArmAngleLimits(**dict(zip(_RATES, elbow, strict=True))),
        sources=MappingProxyType(of_joints | of_tool | of_elbow | others),
    )


_TURNS = {  # Axes of Craig's frames in base at zero pose, by their turn about x: 0, +90, -90 and 180 degrees.
    "x0": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "x+": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "x-": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "xx": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
}
_FRAMES = (  # Turn of Craig's frame, origin of the link's frame ahead and high, height of Craig's origin above it.
    ("x0", 0.0, 0.0, 0.0),
    ("x0", 0.0, _SHOULDER, 0.0),
    ("x-", 0.0, _SHOULDER, 0.0),
    ("x0", 0.0, _ELBOW, 0.0),
    ("x+", _ELBOW_AHEAD, _ELBOW, 0.0),
    ("x0", 0.0, _WRIST, 0.0),
    ("x+", 0.0, _WRIST, 0.0),
    ("xx", _HAND_AHEAD, _FLANGE, 0.107),
)


def craig_link(number: int, mass: float, center: Sequence[float], tensor: Sequence[float], source: str) -> Link:
    """Returns a link from figures in Craig's frame of its joint, as URDF descriptions of the maker have them.

    Args:
        number: 0 for the base, 1 to 7 for the links.
        mass: [kg].
        center: Centre of mass, 3 numbers, [m].
        tensor: Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the centre of mass, [kg m^2].
        source: Source of the figures.
    """
    turn, ahead, height, above = _FRAMES[number]
    R = np.array(_TURNS[turn], dtype=np.float64)
    xx, xy, xz, yy, yz, zz = tensor
    inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    return Link(
        mass=mass,
        center_of_mass=readonly_copy(R @ np.array(center) + (0.0, 0.0, above)),
        inertia=readonly_copy((inertia + inertia.T) / 2.0 + 0.0),
        origin_height=height,
        origin_ahead=ahead,
        source=source,
    )


def _rod(start: tuple[float, float, float], end: tuple[float, float, float], radius: float) -> Rod:
    return Rod(start=start, end=end, radius=radius)


_RODS = (
    (_rod((-0.09, 0.0, 0.066), (0.0, 0.0, 0.066), 0.062), _rod((0.0, 0.0, 0.070), (0.0, 0.0, 0.130), 0.066)),
    (_rod((0.0, 0.0, -0.140), (0.0, 0.0, -0.060), 0.060),),
    (_rod((0.0, -0.058, 0.0), (0.0, 0.058, 0.0), 0.060), _rod((0.0, 0.0, 0.0), (0.0, 0.0, 0.120), 0.060)),
    (_rod((0.0, 0.0, -0.130), (0.0, 0.0, -0.080), 0.060), _rod((0.0, 0.0, -0.080), (0.0725, 0.0, -0.045), 0.055)),
    (_rod((0.0, -0.058, 0.0), (0.0, 0.058, 0.0), 0.060), _rod((0.0, 0.0, 0.0), (-0.0825, 0.0, 0.110), 0.058)),
    (_rod((0.0, 0.0, -0.220), (0.0, 0.0, -0.190), 0.052), _rod((0.0, 0.032, -0.178), (0.0, 0.094, -0.090), 0.032)),
    (_rod((0.0, -0.025, 0.0), (0.0, 0.065, 0.0), 0.050), _rod((0.0, 0.0, 0.0), (0.080, 0.0, 0.010), 0.045)),
    (_rod((0.0, 0.0, 0.100), (0.0, 0.0, 0.045), 0.045),),
)  # After pictures of the arm: rounder than an xMate, and inside the real housings' reach.

_OPEN = 0.03  # [m] Of each finger, between closed and open: rcilab's own choice, as the capsules.
_DIAGONAL = sqrt(0.5)  # Of the hand's y axis, turned by -45 degrees, in the flange's.


def _across(half: float, height: float, radius: float) -> Rod:
    """Returns the body of the hand, along its y axis."""
    y = _DIAGONAL * half
    return _rod((-y, -y, height), (y, y, height), radius)


def _finger(y: float) -> Rod:
    """Returns a finger, 9 mm longer than the distance of the hand's frame."""
    x = _DIAGONAL * y
    return _rod((x, x, 0.066), (x, x, 0.1024), 0.01)


HAND = MountedTool(
    name="hand",
    T_flange_tool=Pose((0.0, 0.0, 0.1034), (cos(pi / 8.0), 0.0, 0.0, -sin(pi / 8.0))),
    mass=0.73,
    center_of_mass=readonly_copy([-0.01, 0.0, 0.03]),
    inertia=readonly_copy(np.diag([0.001, 0.0025, 0.0017])),
    source="the state of an arm with its hand that the maker's client library shows on its page Getting started",
    rods=(_across(0.0705, 0.033, 0.033), *(_finger(side * _OPEN) for side in (-1.0, 1.0))),
)
"""The hand; its frame is between the fingertips, turned by -45 degrees."""


def build_franka(
    *,
    name: str,
    limits: Limits,
    conditions: Callable[[], ConditionTable],
    bodies: Sequence[Link],
    dh_source: str,
    rated_payload_source: str,
) -> RobotDescription:
    """Returns an arm with what both have in common.

    Args:
        name: Name of the arm.
        limits: Its limits.
        conditions: Returns the conditions of its interface.
        bodies: Base and links.
        dh_source: Source of the geometry.
        rated_payload_source: Source of the payload of 3 kg.
    """
    base, *links = bodies
    return RobotDescription(
        name=name,
        maker="franka",
        faults=FrankaError,
        conditions=conditions,
        elbow_flip=ELBOW_FLIP,
        rotor_inertia=readonly_copy([ROTOR_INERTIA] * 7),
        damping=readonly_copy([DAMPING] * 7),
        dh=rows_from_craig(CRAIG),
        dh_source=dh_source,
        base=base,
        links=tuple(links),
        limits=limits,
        home=readonly_copy([0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4]),
        rated_payload=3.0,
        rated_payload_source=rated_payload_source,
        rods=_RODS,
        tools=(HAND,),
    )
