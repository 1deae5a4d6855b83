"""How close a configuration is to losing a direction of motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, degrees, hypot, sin, sqrt

import numpy as np

from rcilab.core.arrays import Array, JointPath, Matrix
from rcilab.model.kinematics.inverse import ArmGeometry

SINGULAR = (
    0.02  # Sine of an angle, or share of the reach: about one degree from a singularity counts as on it; a choice.
)


@dataclass(frozen=True, slots=True)
class Manipulability:
    """What the singular values of the Jacobian say about a configuration."""

    manipulability: float
    """sqrt(det(J J^T)): product of the singular values (Yoshikawa 1985); 0 at a singularity."""
    smallest: float
    """Smallest singular value: the tool velocity that unit joint velocity gives in the worst direction."""
    condition: float
    """Largest over smallest singular value; infinite at a singularity."""


def dexterity(J: Matrix) -> Manipulability:
    """Returns the dexterity measures of a Jacobian, shape (6, n), metres and radians taken as they are."""
    values = np.linalg.svd(J, compute_uv=False)
    smallest, largest = float(values[-1]), float(values[0])
    return Manipulability(float(np.prod(values)), smallest, largest / smallest if smallest > 0.0 else float("inf"))


@dataclass(frozen=True, slots=True, eq=False)
class ManipulabilityPath:
    """The measures of `Manipulability` for N configurations, each of shape (N,)."""

    manipulability: Array
    smallest: Array
    condition: Array

    def __repr__(self) -> str:
        return f"<ManipulabilityPath of {len(self.smallest)} rows: .manipulability, .smallest, .condition>"


def dexterity_path(J: Array) -> ManipulabilityPath:
    """Returns the dexterity measures of many Jacobians, shape (N, 6, n)."""
    values = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
    smallest, largest = values[:, -1], values[:, 0]
    with np.errstate(divide="ignore"):
        condition = np.where(smallest > 0.0, largest / smallest, np.inf)
    return ManipulabilityPath(np.prod(values, axis=1), smallest, condition)


def find_singularity(arm: ArmGeometry, q: Sequence[float]) -> str | None:
    """Returns which singularity an arm is at, in words, or None where it can move its tool in every direction.

    7 axes follow a pose at an arm angle: seven numbers for seven joints. These lose a direction where sin q4 = 0, where
    sin q2 = 0 (axes 1 and 3 in line) or sin q6 = 0 (axes 5 and 7), and where shoulder and wrist are above each other.
    6 axes: sin q3 = 0, sin q5 = 0, and the wrist on axis 1 (Siciliano et al., Robotics, 2009, section 3.3).

    Args:
        arm: From `rcilab.model.kinematics.inverse.build_geometry`.
        q: Joint angles, n plain floats, [rad].
    """
    upright = q
    if any(arm.offsets):
        upright = [angle - offset for angle, offset in zip(q, arm.offsets, strict=True)]
    if arm.n == 7:
        return _singular_seven(arm, upright)
    return _singular_six(arm, upright)


def singularity_path(arm: ArmGeometry, q: JointPath) -> Array:
    """Returns how near an arm is to a singularity along a path, shape (N,): from 1 on `find_singularity` finds one.

    It is `SINGULAR` over the sine, or the share of the reach, that the nearest singularity is away.

    Args:
        arm: From `rcilab.model.kinematics.inverse.build_geometry`.
        q: Joint angles, shape (N, n), [rad].
    """
    upright = q - np.array(arm.offsets)
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
