"""The Franka Panda: 7 axes, 3 kg, offsets at the elbow and the wrist; the flange looks down at zero pose.

`SPECIFICATION` is the maker's page "Robot and interface specifications" for the Panda. `LIBRARY` stands for the
comments of the maker's client library, which gives the ranges of settings that the page leaves out. `IDENTIFIED` are
figures that were identified on a real arm, because the maker does not publish them.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, pi
from types import MappingProxyType
from typing import Any

import numpy as np

from rcilab.core.arrays import readonly_copy
from rcilab.core.limits import ArmAngleLimits, CartesianLimits, JointLimits, Limits
from rcilab.makers.franka.conditions import fci_conditions
from rcilab.makers.franka.errors import FrankaError
from rcilab.robots.description import CraigRow, Link, RobotDescription, Rod, rows_from_craig

SPECIFICATION = "Franka's page Robot and interface specifications (Panda)"
LIBRARY = "comments of libfranka's robot.h"
IDENTIFIED = (
    "identified on a real arm by Gaz et al., IEEE Robotics and Automation Letters 4(4), 2019, in the form of the "
    "maker's public description package; together they give the arm's torques, single figures need not be a body's"
)

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

ELBOW_FLIP = -0.467002423653011  # [rad] Joint 4 with the arm stretched as far as possible; SPECIFICATION.

_SHOULDER = 0.333  # [m]
_ELBOW = _SHOULDER + 0.316  # [m]
_WRIST = _ELBOW + 0.384  # [m]
_FLANGE = _WRIST - 0.107  # [m]
_ELBOW_AHEAD = 0.0825  # [m]
_HAND_AHEAD = 0.088  # [m]

_TABLE = {
    "lower": [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
    "upper": [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
    "velocity": [2.175, 2.175, 2.175, 2.175, 2.610, 2.610, 2.610],
    "acceleration": [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0],
    "jerk": [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0],
    "torque": [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
    "torque_rate": [1000.0] * 7,
    "collision_threshold": [inf] * 7,
    "stiffness": [14250.0] * 7,
}


def _limits() -> Limits:
    joint = {f"joint.{name}": f"{SPECIFICATION}, joint space limits" for name in _TABLE}
    cartesian = {
        f"cartesian.{kind}_{name}": f"{SPECIFICATION}, Cartesian limits, {kind.capitalize()}"
        for kind in ("translation", "rotation")
        for name in ("velocity", "acceleration", "jerk")
    }
    elbow = {
        f"elbow.{name}": f"{SPECIFICATION}, Cartesian limits, Elbow" for name in ("velocity", "acceleration", "jerk")
    }
    others = {
        "joint.collision_threshold": "the maker names no bound",
        "joint.stiffness": f"{LIBRARY}, setJointImpedance",
        "cartesian.translation_stiffness": f"{LIBRARY}, setCartesianImpedance",
        "cartesian.rotation_stiffness": f"{LIBRARY}, setCartesianImpedance",
        "cartesian.force": "the interface takes no desired force",
        "cartesian.moment": "the interface takes no desired moment",
    }
    arm_angle = {
        name.replace("elbow", "arm_angle"): f"{source}; the arm angle is the elbow's" for name, source in elbow.items()
    }
    bounds: dict[str, Any] = {name: readonly_copy(row) for name, row in _TABLE.items()}
    velocity, acceleration, jerk = 2.175, 10.0, 5000.0
    return Limits(
        joint=JointLimits(**bounds),
        cartesian=CartesianLimits(
            translation_velocity=1.7,
            translation_acceleration=13.0,
            translation_jerk=6500.0,
            rotation_velocity=2.5,
            rotation_acceleration=25.0,
            rotation_jerk=12500.0,
            translation_stiffness=3000.0,
            rotation_stiffness=300.0,
            force=inf,
            moment=inf,
        ),
        arm_angle=ArmAngleLimits(velocity=velocity, acceleration=acceleration, jerk=jerk),
        sources=MappingProxyType(joint | cartesian | arm_angle | others),
    )


_TURNS = {  # Axes of Craig's frames in base at zero pose, by their turn about x: 0, +90, -90 and 180 degrees.
    "x0": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "x+": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "x-": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "xx": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
}


def _link(
    turn: str,
    ahead: float,
    height: float,
    mass: float,
    center: Sequence[float],
    tensor: Sequence[float],
    above: float = 0.0,
) -> Link:
    """Returns a link from figures in Craig's frame, whose origin is `above` the link's own at zero pose, [m].

    The tensor is (Ixx, Ixy, Ixz, Iyy, Iyz, Izz) about the centre of mass, [kg m^2].
    """
    R = np.array(_TURNS[turn], dtype=np.float64)
    xx, xy, xz, yy, yz, zz = tensor
    inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    return Link(
        mass=mass,
        center_of_mass=readonly_copy(R @ np.array(center) + (0.0, 0.0, above)),
        inertia=readonly_copy((inertia + inertia.T) / 2.0 + 0.0),
        origin_height=height,
        origin_ahead=ahead,
        source=IDENTIFIED,
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

DESCRIPTION = RobotDescription(
    name="Panda",
    maker="franka",
    faults=FrankaError,
    conditions=fci_conditions,
    elbow_flip=ELBOW_FLIP,
    dh=rows_from_craig(CRAIG),
    dh_source=f"{SPECIFICATION}, Denavit-Hartenberg parameters (Craig's convention), written as standard rows",
    base=_link(
        "x0",
        0.0,
        0.0,
        0.629769,
        (-0.041018, -0.00014, 0.049974),
        (0.00315, 8.2904e-7, 0.00015, 0.00388, 8.2299e-6, 0.004285),
    ),
    links=(
        _link(
            "x0",
            0.0,
            _SHOULDER,
            4.970684,
            (0.003875, 0.002081, -0.04762),
            (0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117),
        ),
        _link(
            "x-",
            0.0,
            _SHOULDER,
            0.646926,
            (-0.003141, -0.02872, 0.003495),
            (0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995),
        ),
        _link(
            "x0",
            0.0,
            _ELBOW,
            3.228604,
            (0.027518, 0.039252, -0.066502),
            (0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083),
        ),
        _link(
            "x+",
            _ELBOW_AHEAD,
            _ELBOW,
            3.587895,
            (-0.05317, 0.104419, 0.027454),
            (0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323),
        ),
        _link(
            "x0",
            0.0,
            _WRIST,
            1.225946,
            (-0.011953, 0.041065, -0.038437),
            (0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627),
        ),
        _link(
            "x+",
            0.0,
            _WRIST,
            1.666555,
            (0.060149, -0.014117, -0.010517),
            (0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433),
        ),
        _link(
            "xx",
            _HAND_AHEAD,
            _FLANGE,
            0.735522,
            (0.010517, -0.004252, 0.061597),
            (0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815),
            above=0.107,
        ),
    ),
    limits=_limits(),
    home=readonly_copy([0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4]),
    rated_payload=3.0,
    rated_payload_source="maker's data sheet of the Panda",
    rods=_RODS,
)
