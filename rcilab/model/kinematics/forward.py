"""Forward kinematics by the standard Denavit-Hartenberg convention.

Two forms of the same mathematics: plain floats for one configuration (fastest in a 1 kHz loop) and numpy for a path.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.robots.description import DhRow

Chain: TypeAlias = tuple[tuple[float, float, float, float, float], ...]
"""Per joint: theta offset, d, a, cos(alpha), sin(alpha); lengths in [m], angles in [rad]."""

_EXACT = 1e-12  # cos(pi/2) is 6e-17 in floats; right angles in the table are exact.


def build_chain(dh: Sequence[DhRow]) -> Chain:
    """Returns the constants of a Denavit-Hartenberg table in the form used by the functions below."""
    return tuple((row.theta_offset, row.d, row.a, _snap(cos(row.alpha)), _snap(sin(row.alpha))) for row in dh)


def forward(chain: Chain, q: Sequence[float]) -> Pose:
    """Returns the pose of the flange in base.

    Args:
        chain: From `build_chain`.
        q: Joint angles as plain floats, [rad].
    """
    # Columns x, y, z of the rotation and the position p, all in base.
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    px = py = pz = 0.0
    for (offset, d, a, ca, sa), angle in zip(chain, q, strict=True):
        angle += offset
        c, s = cos(angle), sin(angle)
        ux, uy, uz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
        vx, vy, vz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
        if d:
            px, py, pz = px + d * zx, py + d * zy, pz + d * zz
        if a:
            px, py, pz = px + a * ux, py + a * uy, pz + a * uz
        xx, xy, xz = ux, uy, uz
        if sa:
            yx, yy, yz, zx, zy, zz = (
                ca * vx + sa * zx,
                ca * vy + sa * zy,
                ca * vz + sa * zz,
                ca * zx - sa * vx,
                ca * zy - sa * vy,
                ca * zz - sa * vz,
            )
        else:
            yx, yy, yz, zx, zy, zz = ca * vx, ca * vy, ca * vz, ca * zx, ca * zy, ca * zz
    return Pose.from_parts((xx, yx, zx, xy, yy, zy, xz, yz, zz), (px, py, pz))


def joint_frames(chain: Chain, q: Sequence[float]) -> tuple[Pose, ...]:
    """Returns the poses in base of the frames after joint 1, 2, ..., n; the last one is the flange."""
    frames: list[Pose] = []
    T = IDENTITY
    for (offset, d, a, ca, sa), angle in zip(chain, q, strict=True):
        c, s = cos(angle + offset), sin(angle + offset)
        T = T @ Pose.from_parts((c, -s * ca, s * sa, s, c * ca, -c * sa, 0.0, sa, ca), (a * c, a * s, d))
        frames.append(T)
    return tuple(frames)


def forward_path(chain: Chain, q: JointPath) -> Array:
    """Returns the poses of the flange in base along a path.

    Args:
        chain: From `build_chain`.
        q: Joint angles, shape (N, n), [rad].

    Returns:
        Homogeneous transforms, shape (N, 4, 4), [m].
    """
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for row, angle in zip(chain, q.T, strict=True):
        T = T @ _step_path(row, angle)
    return T


def joint_frame_paths(chain: Chain, q: JointPath) -> list[Array]:
    """Returns the poses in base of the frames after joint 1, 2, ..., n along a path, each of shape (N, 4, 4), [m].

    Args:
        chain: From `build_chain`.
        q: Joint angles, shape (N, n), [rad].
    """
    frames: list[Array] = []
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for row, angle in zip(chain, q.T, strict=True):
        T = T @ _step_path(row, angle)
        frames.append(T)
    return frames


def position_path(chain: Chain, q: JointPath, point: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """Returns the positions of a point of the flange in base along a path; a tenth of the time of `forward_path`.

    Args:
        chain: From `build_chain`.
        q: Joint angles, shape (N, n), [rad].
        point: In the flange frame, three numbers, [m].

    Returns:
        Shape (N, 3), [m].
    """
    x, y, z = (np.full(len(q), float(value)) for value in point)
    for (offset, d, a, ca, sa), angle in zip(reversed(chain), reversed(q.T), strict=True):
        c, s = np.cos(angle + offset), np.sin(angle + offset)
        x, y, z = x + a, ca * y - sa * z, sa * y + ca * z + d
        x, y = c * x - s * y, s * x + c * y
    return np.stack((x, y, z), axis=1)


def _step_path(row: tuple[float, float, float, float, float], angle: Array) -> Array:
    """Returns the transform of one row of the table at every angle, shape (N, 4, 4)."""
    offset, d, a, ca, sa = row
    c, s = np.cos(angle + offset), np.sin(angle + offset)
    step = np.zeros((len(angle), 4, 4))
    step[:, 0, 0], step[:, 0, 1], step[:, 0, 2], step[:, 0, 3] = c, -s * ca, s * sa, a * c
    step[:, 1, 0], step[:, 1, 1], step[:, 1, 2], step[:, 1, 3] = s, c * ca, -c * sa, a * s
    step[:, 2, 1], step[:, 2, 2], step[:, 2, 3], step[:, 3, 3] = sa, ca, d, 1.0
    return step


def _snap(value: float) -> float:
    nearest = round(value)
    return float(nearest) if abs(value - nearest) < _EXACT else value
