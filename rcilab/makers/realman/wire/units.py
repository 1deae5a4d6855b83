"""The units of the wire: thousandths of degrees and of RPM, micrometres, thousandths of radians."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import degrees, pi, radians

from rcilab.core.spatial import Pose

_MILLI, _MICRO = 1e-3, 1e-6
_RPM = 2.0 * pi / 60.0  # [rad/s]


def angles_from_millidegrees(values: Iterable[int]) -> tuple[float, ...]:
    """Returns angles, [rad]."""
    return tuple(radians(_MILLI * value) for value in values)


def millidegrees_from_angles(angles: Iterable[float]) -> list[int]:
    """Returns angles in 0.001 deg."""
    return [round(degrees(angle) / _MILLI) for angle in angles]


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
