"""Where the tool is and how it moves, in one pass of plain floats: what a 1 kHz loop asks for in every cycle."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import TypeAlias

from rcilab.kinematics.forward import Chain
from rcilab.spatial import Pose

Twist: TypeAlias = tuple[float, float, float, float, float, float]
"""Linear and angular velocity, [m/s, rad/s]."""


def tool_motion(
    chain: Chain, q: Sequence[float], dq: Sequence[float], T_flange_tool: Pose | None
) -> tuple[Pose, Twist]:
    """Returns the pose of the tool in base and its twist at the tool's origin, base axes: `jacobian(q) @ dq`.

    With z_i and p_i the axis and origin of joint i, the angular velocity is w = sum dq_i z_i and the linear one
    w x p_tool - sum dq_i z_i x p_i: the columns of the Jacobian, summed before they are built.

    Args:
        chain: From `rcilab.kinematics.forward.build_chain`.
        q: Joint angles as plain floats, [rad].
        dq: Joint velocities as plain floats, [rad/s].
        T_flange_tool: Pose of the tool in the flange frame; None is the flange itself.
    """
    # Columns x, y, z of the rotation and the position p, all in base; then the two sums.
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    px = py = pz = 0.0
    wx = wy = wz = mx = my = mz = 0.0
    for (offset, d, a, ca, sa), angle, rate in zip(chain, q, dq, strict=True):
        ax, ay, az = rate * zx, rate * zy, rate * zz
        wx, wy, wz = wx + ax, wy + ay, wz + az
        mx, my, mz = mx + ay * pz - az * py, my + az * px - ax * pz, mz + ax * py - ay * px
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
    pose = Pose.from_parts((xx, yx, zx, xy, yy, zy, xz, yz, zz), (px, py, pz))
    if T_flange_tool is not None:
        pose = pose @ T_flange_tool
        px, py, pz = pose.parts[1]
    return pose, (wy * pz - wz * py - mx, wz * px - wx * pz - my, wx * py - wy * px - mz, wx, wy, wz)
