"""Closeness of an arm with offsets to configurations at which a held elbow no longer determines the joints.

With joint 3 held, six joints are left for six directions. Where the determinant of their Jacobian is zero, two
solutions of the inverse meet, and commands of pose and elbow no longer select one of them. The maker of the Panda has
no such condition. It is rcilab's own, like that of the other arms, for the same reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.core.spatial import IDENTITY
from rcilab.model.kinematics.differential import jacobian_path, moving_frame
from rcilab.model.kinematics.jacobian import tool_jacobian
from rcilab.model.kinematics.solvers.offset7.arm import ELBOW, OffsetGeometry

HELD_SINGULAR = 3e-4  # [m^3]
"""Determinant of the six joints' Jacobian below which the arm counts as singular. Tuning value: four thousandths of
the largest, 1 of 36 random configurations; beyond it commands of 1 ms and the joints that follow agree to rounding."""

_FREE = [joint for joint in range(7) if joint != ELBOW]


def held_singularity_path(arm: OffsetGeometry, q: JointPath) -> Array:
    """Returns the closeness of N configurations to a singularity with joint 3 held, shape (N,); singular from 1 on.

    Args:
        arm: From `build_offset_geometry`.
        q: Joint angles, shape (N, 7), [rad].
    """
    J = jacobian_path(moving_frame(arm.chain, q, 7, IDENTITY))
    with np.errstate(divide="ignore", invalid="ignore"):
        return HELD_SINGULAR / np.abs(np.linalg.det(J[:, :, _FREE]))


def held_singularity(arm: OffsetGeometry, q: Sequence[float]) -> float:
    """Returns the closeness of one configuration, 7 plain floats, [rad]."""
    volume = abs(float(np.linalg.det(tool_jacobian(arm.chain, q)[0][:, _FREE])))
    return HELD_SINGULAR / volume if volume else inf
