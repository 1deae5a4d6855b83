"""The geometric Jacobian: how joint velocities move the tool."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np

from rcilab.core.arrays import Matrix
from rcilab.core.spatial import IDENTITY, Pose, Rotation9
from rcilab.model.kinematics.forward import Chain


def jacobian(chain: Chain, q: Sequence[float], T_flange_tool: Pose = IDENTITY) -> Matrix:
    """Returns the Jacobian at the tool tip in base axes.

    Column i is `[z x (p_tool - p_i); z]` for the axis z and origin p_i of joint i (Siciliano et al., Robotics, 2009,
    eq. 3.30).

    Args:
        chain: From `rcilab.model.kinematics.forward.build_chain`.
        q: Joint angles as plain floats, [rad].
        T_flange_tool: Pose of the tool in the flange frame.

    Returns:
        Shape (6, n), linear rows first, [m/rad] and [rad/rad].
    """
    return tool_jacobian(chain, q, T_flange_tool)[0]


def tool_jacobian(chain: Chain, q: Sequence[float], T_flange_tool: Pose = IDENTITY) -> tuple[Matrix, Rotation9]:
    """Returns the Jacobian as `jacobian` does, and the rotation of the tool in base, nine numbers row by row.

    One pass along the arm in plain floats takes a third of the time of one over `Pose` objects.
    """
    # Columns x, y, z of the rotation and the position p, all in base.
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    px = py = pz = 0.0
    axes: list[tuple[float, float, float, float, float, float]] = []
    for (offset, d, a, ca, sa), angle in zip(chain, q, strict=True):
        axes.append((zx, zy, zz, px, py, pz))
        angle += offset
        c, s = cos(angle), sin(angle)
        ux, uy, uz = c * xx + s * yx, c * xy + s * yy, c * xz + s * yz
        vx, vy, vz = c * yx - s * xx, c * yy - s * xy, c * yz - s * xz
        if d:
            px, py, pz = px + d * zx, py + d * zy, pz + d * zz
        if a:
            px, py, pz = px + a * ux, py + a * uy, pz + a * uz
        xx, xy, xz = ux, uy, uz
        if not ca:  # Most neighbouring axes are perpendicular.
            yx, yy, yz, zx, zy, zz = sa * zx, sa * zy, sa * zz, -sa * vx, -sa * vy, -sa * vz
        else:
            yx, yy, yz, zx, zy, zz = (
                ca * vx + sa * zx,
                ca * vy + sa * zy,
                ca * vz + sa * zz,
                ca * zx - sa * vx,
                ca * zy - sa * vy,
                ca * zz - sa * vz,
            )
    rotation, (x, y, z) = (xx, yx, zx, xy, yy, zy, xz, yz, zz), (px, py, pz)
    if T_flange_tool is not IDENTITY:
        rotation, (x, y, z) = (Pose.from_parts(rotation, (x, y, z)) @ T_flange_tool).parts
    columns: list[float] = []
    for ax, ay, az, ox, oy, oz in axes:
        dx, dy, dz = x - ox, y - oy, z - oz
        columns += (ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx, ax, ay, az)
    return np.array(columns).reshape(-1, 6).T, rotation
