"""The geometric Jacobian: how joint velocities move the tool."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.arrays import Matrix
from rcilab.kinematics.forward import Chain, joint_frames
from rcilab.spatial import IDENTITY, Pose


def jacobian(chain: Chain, q: Sequence[float], T_flange_tool: Pose = IDENTITY) -> Matrix:
    """Returns the Jacobian at the tool tip in base axes.

    Column i is `[z x (p_tool - p_i); z]` for the axis z and origin p_i of joint i (Siciliano et al., Robotics, 2009,
    eq. 3.30).

    Args:
        chain: From `rcilab.kinematics.forward.build_chain`.
        q: Joint angles as plain floats, [rad].
        T_flange_tool: Pose of the tool in the flange frame.

    Returns:
        Shape (6, n), linear rows first, [m/rad] and [rad/rad].
    """
    frames = (IDENTITY, *joint_frames(chain, q))
    _, (x, y, z) = (frames[-1] @ T_flange_tool).parts
    columns: list[tuple[float, ...]] = []
    for frame in frames[:-1]:
        r, (px, py, pz) = frame.parts
        ax, ay, az = r[2], r[5], r[8]
        dx, dy, dz = x - px, y - py, z - pz
        columns.append((ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx, ax, ay, az))
    return np.array(columns).T
