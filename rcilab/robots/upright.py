"""Upright link frames, parallel to the base frame at zero pose.

Denavit-Hartenberg frames are used for kinematics. For drawing, URDF, MJCF and rigid-body dynamics each link has the
frame of its mass data: parallel to the base when all joint angles are zero, origin in the base's xz plane (that of
the xMates on the base z axis).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Vector3, readonly_copy
from rcilab.core.errors import ModelError
from rcilab.core.spatial import Pose
from rcilab.robots.description import RobotDescription

_TOLERANCE = 1e-12  # [m] and axis components: axes and origins of the tables are exactly on the base z axis.


@dataclass(frozen=True, slots=True, eq=False)
class UprightJoint:
    """One revolute joint between two upright link frames."""

    origin: Vector3
    """Origin of the link's frame in the previous link's frame (the base's for joint 1), shape (3,), [m]."""
    axis: Vector3
    """Unit axis of the joint, the same in both frames, shape (3,)."""


def upright_joints(description: RobotDescription) -> tuple[UprightJoint, ...]:
    """Returns the joints between upright link frames, base to flange; the last origin is the flange's.

    Of a calibrated arm they are those of the maker's table, for drawing and collisions.

    Raises:
        ModelError: The arm is not upright at zero, as with the manual's 6-axis table taken literally.
    """
    description = description.nominal or description
    T = np.eye(4)
    joints: list[UprightJoint] = []
    below = np.zeros(3)
    for number, (row, link) in enumerate(zip(description.dh, description.links, strict=True), start=1):
        axis, foot, origin = T[:3, 2].copy(), T[:3, 3].copy(), link.origin
        on_axis = foot + axis * (axis @ (origin - foot))
        if np.abs(on_axis - origin).max() > _TOLERANCE:
            ahead = f"{link.origin_ahead} m ahead of " if link.origin_ahead else ""
            raise ModelError(
                f"{description.name}: joint {number} does not pass through {ahead}the base axis at "
                f"{link.origin_height} m at zero pose; the theta offsets must make the arm upright"
            )
        joints.append(UprightJoint(readonly_copy(origin - below), readonly_copy(np.round(axis, 12) + 0.0)))
        below = origin
        T = T @ _dh_matrix(row.a, row.alpha, row.d, row.theta_offset)
    if np.abs(T[:3, 3] - below).max() > _TOLERANCE or not _is_square(T[:3, :3]):
        raise ModelError(f"{description.name}: the flange is not upright above the base at zero pose")
    return tuple(joints)


def upright_flange(description: RobotDescription) -> Pose:
    """Returns the pose of the flange in the last link's frame; rotated if it does not face up at zero pose."""
    T = np.eye(4)
    for row in (description.nominal or description).dh:
        T = T @ _dh_matrix(row.a, row.alpha, row.d, row.theta_offset)
    turned = np.eye(4)
    turned[:3, :3] = np.round(T[:3, :3]) + 0.0
    return Pose.from_matrix(turned)


def link_frames(description: RobotDescription) -> tuple[Pose, ...]:
    """Returns the pose of each link's frame in the Denavit-Hartenberg frame after its joint."""
    T, frames = np.eye(4), []
    nominal = description.nominal or description
    for row, link in zip(nominal.dh, nominal.links, strict=True):
        T = T @ _dh_matrix(row.a, row.alpha, row.d, row.theta_offset)
        upright = np.eye(4)
        upright[:3, 3] = link.origin
        frames.append(Pose.from_matrix(np.linalg.inv(T) @ upright))
    return tuple(frames)


def _is_square(R: np.ndarray) -> bool:
    """Returns whether a rotation only permutes and reverses axes, within rounding."""
    return bool(np.abs(R - np.round(R)).max() < _TOLERANCE)


def _dh_matrix(a: float, alpha: float, d: float, theta: float) -> np.ndarray:
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array(
        [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
