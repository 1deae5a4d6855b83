"""Poses on the wire: millimetres, and roll, pitch, yaw about fixed axes or a rotation vector, [rad]."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, sin

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import IDENTITY, Pose, rotation_between

MILLIMETRE = 1e-3  # [m]
_IDENTITY_ROTATION = IDENTITY.parts[0]


def pose_from_mm_rpy(values: Sequence[float]) -> Pose:
    """Returns the pose of x, y, z in mm and roll, pitch, yaw in rad.

    Raises:
        InvalidValueError: A number is not finite.
    """
    return Pose.from_rpy([MILLIMETRE * value for value in values[:3]], list(values[3:6]))


def pose_from_mm_rotation(values: Sequence[float]) -> Pose:
    """Returns the pose of x, y, z in mm and a rotation vector in rad.

    Raises:
        InvalidValueError: A number is not finite.
    """
    x, y, z = values[3:6]
    angle = hypot(x, y, z)
    if not angle < 1e6:
        raise InvalidValueError("rotation vector", list(values[3:6]), "rad: must be finite numbers")
    if angle == 0.0:
        return Pose([MILLIMETRE * value for value in values[:3]])
    s = sin(0.5 * angle) / angle
    return Pose([MILLIMETRE * value for value in values[:3]], (cos(0.5 * angle), s * x, s * y, s * z))


def pose_as_mm_rpy(pose: Pose) -> tuple[float, ...]:
    """Returns x, y, z in mm and roll, pitch, yaw in rad."""
    return (*position_as_mm(pose), *pose.rpy.tolist())


def pose_as_mm_rotation(pose: Pose) -> tuple[float, ...]:
    """Returns x, y, z in mm and the rotation vector in rad."""
    return (*position_as_mm(pose), *rotation_vector(pose))


def position_as_mm(pose: Pose) -> tuple[float, float, float]:
    """Returns x, y, z in mm."""
    x, y, z = pose.parts[1]
    return x / MILLIMETRE, y / MILLIMETRE, z / MILLIMETRE


def rotation_vector(pose: Pose) -> tuple[float, float, float]:
    """Returns the rotation vector of a pose, [rad]."""
    return rotation_between(_IDENTITY_ROTATION, pose.parts[0])
