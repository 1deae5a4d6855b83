"""The units of the wire: thousandths of degrees and of RPM, micrometres, thousandths of radians."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import copysign, degrees, pi, radians
from typing import Final

from rcilab.core.spatial import Pose

SPEED_STEP: Final = 0.12
"""Unit of the joint speeds that are pushed, [deg/s]: 0.02 RPM, by the maker's page."""

_MILLI, _MICRO = 1e-3, 1e-6
_PART = 0.3  # Of a unit of the wire; the client library truncates, and its numbers are of single precision.
_RPM = 2.0 * pi / 60.0  # [rad/s]


def angles_from_millidegrees(values: Iterable[int]) -> tuple[float, ...]:
    """Returns angles, [rad]."""
    return tuple(radians(_MILLI * value) for value in values)


def millidegrees_from_angles(angles: Iterable[float]) -> list[int]:
    """Returns angles in 0.001 deg."""
    return [round(degrees(angle) / _MILLI) for angle in angles]


def degrees_for_client(angles: Iterable[float]) -> list[float]:
    """Returns angles, [deg], that the client library sends as the nearest numbers of the wire: it truncates them."""
    return [_MILLI * (number + copysign(_PART, number)) for number in millidegrees_from_angles(angles)]


def pose_from_client(values: Sequence[float]) -> Pose:
    """Returns the pose of x, y, z, [m], and rx, ry, rz, [rad]: R = Rz Ry Rx."""
    return Pose.from_rpy(list(values[:3]), list(values[3:]))


def pose_for_client(pose: Pose) -> list[float]:
    """Returns x, y, z, [m], and rx, ry, rz, [rad], that the client library sends as the nearest numbers of the wire."""
    units = (*(_MICRO,) * 3, *(_MILLI,) * 3)
    return [unit * (number + copysign(_PART, number)) for unit, number in zip(units, wire_from_pose(pose), strict=True)]


def speed_for_client(speed: float) -> float:
    """Returns a speed of a joint, [deg/s], or an acceleration, that the client library sends as the nearest number."""
    return degrees(_MILLI * _RPM) * (millirpm_from_speed(speed) + _PART)


def speed_from_millirpm(value: int) -> float:
    """Returns a speed, [rad/s], or an acceleration, [rad/s^2]."""
    return _MILLI * value * _RPM


def millirpm_from_speed(speed: float) -> int:
    """Returns a speed in 0.001 RPM, or an acceleration in 0.001 RPM/s."""
    return round(speed / (_MILLI * _RPM))


def pose_from_wire(values: Sequence[int]) -> Pose:
    """Returns the pose of x, y, z in 0.000001 m and rx, ry, rz in 0.001 rad: R = Rz Ry Rx."""
    return Pose.from_rpy([_MICRO * value for value in values[:3]], [_MILLI * value for value in values[3:]])


def pose_from_wire_quaternion(values: Sequence[int]) -> Pose:
    """Returns the pose of x, y, z in 0.000001 m and a quaternion w, x, y, z in 0.000001, not all zero."""
    return Pose([_MICRO * value for value in values[:3]], [_MICRO * value for value in values[3:]])


def wire_from_pose(pose: Pose) -> list[int]:
    """Returns x, y, z in 0.000001 m and rx, ry, rz in 0.001 rad."""
    return [*microns_from_lengths(pose.position.tolist()), *(round(angle / _MILLI) for angle in pose.rpy.tolist())]


def microns_from_lengths(lengths: Iterable[float]) -> list[int]:
    """Returns lengths in 0.000001 m."""
    return [round(length / _MICRO) for length in lengths]


def quaternion_to_wire(pose: Pose) -> list[int]:
    """Returns the quaternion w, x, y, z in 0.000001."""
    return [round(value / _MICRO) for value in pose.wxyz.tolist()]
