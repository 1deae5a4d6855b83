"""The singularities of the arms without offsets."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, degrees, hypot, sin, sqrt

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.model.kinematics.solvers.spherical.inverse import ArmGeometry, upright_angles

SINGULAR = 0.02
"""Sine of an angle, or share of the reach, below which an arm counts as singular. Tuning value: about a degree."""


def find_singularity(arm: ArmGeometry, q: Sequence[float]) -> str | None:
    """Returns the description of the singularity of a configuration, or None.

    7 axes follow a pose at an arm angle: seven numbers for seven joints. These lose a direction where sin q4 = 0, where
    sin q2 = 0 (axes 1 and 3 in line) or sin q6 = 0 (axes 5 and 7), and where shoulder and wrist are above each other.
    6 axes: sin q3 = 0, sin q5 = 0, and the wrist on axis 1 (Siciliano et al., Robotics, 2009, section 3.3).

    Args:
        arm: From `build_geometry`.
        q: Joint angles, n plain floats, [rad].
    """
    upright = q if arm.is_upright else upright_angles(arm, q)
    if arm.n == 7:
        return _singular_seven(arm, upright)
    return _singular_six(arm, upright)


def singularity_path(arm: ArmGeometry, q: JointPath) -> Array:
    """Returns the closeness to a singularity along a path, shape (N,); from 1 on `find_singularity` finds one.

    It is `SINGULAR` divided by the sine, or the share of the reach, that separates the arm from the singularity.

    Args:
        arm: From `build_geometry`.
        q: Joint angles, shape (N, n), [rad].
    """
    upright = np.array(arm.signs) * (q - np.array(arm.offsets))
    away = _away_seven(arm, upright) if arm.n == 7 else _away_six(arm, upright)
    with np.errstate(divide="ignore"):
        return SINGULAR / away


def _away_seven(arm: ArmGeometry, q: JointPath) -> Array:
    c2, c3, c4 = (np.cos(q[:, i]) for i in (1, 2, 3))
    s2, s3, s4, s6 = (np.sin(q[:, i]) for i in (1, 2, 3, 5))
    side, along = arm.fore * s4, arm.upper + arm.fore * c4
    horizontal = np.hypot(s2 * along + c2 * c3 * side, s3 * side) / np.sqrt(side * side + along * along)
    return np.minimum.reduce((np.abs(s2), np.abs(s4), np.abs(s6), horizontal))


def _away_six(arm: ArmGeometry, q: JointPath) -> Array:
    radius = arm.upper * np.sin(q[:, 1]) + arm.fore * np.sin(q[:, 1] + q[:, 2])
    off_axis = np.abs(radius) / (arm.upper + arm.fore)
    return np.minimum.reduce((np.abs(np.sin(q[:, 2])), np.abs(np.sin(q[:, 4])), off_axis))


def _singular_seven(arm: ArmGeometry, q: Sequence[float]) -> str | None:
    if abs(sin(q[3])) < SINGULAR:
        return f"the arm is stretched or folded: joint 4 is at {degrees(q[3]):.2f} deg"
    if abs(sin(q[1])) < SINGULAR:
        return f"axes 1 and 3 are in line: joint 2 is at {degrees(q[1]):.2f} deg"
    if abs(sin(q[5])) < SINGULAR:
        return f"axes 5 and 7 are in line: joint 6 is at {degrees(q[5]):.2f} deg"
    c2, c3, c4 = cos(q[1]), cos(q[2]), cos(q[3])
    side, along = arm.fore * sin(q[3]), arm.upper + arm.fore * c4
    # Wrist from shoulder in the plane of the upper arm; its distance from the vertical through the shoulder.
    horizontal = hypot(sin(q[1]) * along + c2 * c3 * side, sin(q[2]) * side)
    if horizontal < SINGULAR * sqrt(side * side + along * along):
        return "shoulder and wrist are above each other, where the arm angle has no meaning"
    return None


def _singular_six(arm: ArmGeometry, q: Sequence[float]) -> str | None:
    if abs(sin(q[2])) < SINGULAR:
        return f"the arm is stretched or folded: joint 3 is at {degrees(q[2]):.2f} deg"
    if abs(sin(q[4])) < SINGULAR:
        return f"axes 4 and 6 are in line: joint 5 is at {degrees(q[4]):.2f} deg"
    radius = arm.upper * sin(q[1]) + arm.fore * sin(q[1] + q[2])
    if abs(radius) < SINGULAR * (arm.upper + arm.fore):
        return "the wrist is on axis 1"
    return None
