"""The inverse of an arm with offsets at many poses: one after the other, in one table."""

from __future__ import annotations

import numpy as np

from rcilab.arrays import Array
from rcilab.errors import UnreachableError
from rcilab.kinematics.offset_arm import OffsetGeometry, SelfMotion
from rcilab.spatial import Pose

_LEAST = 8  # Columns, as many as the other arms have branches.


def inverse_offset_batch(arm: OffsetGeometry, T_base_flange: Array, psi: Array) -> Array:
    """Returns every solution at many poses, without regard to joint limits; some milliseconds a pose.

    Args:
        arm: From `build_offset_geometry`.
        T_base_flange: Poses of the flange in base, shape (N, 4, 4).
        psi: Arm angles, shape (N,), [rad].

    Returns:
        Shape (N, M, 7), [rad], M from the pose with the most; not a number behind the last solution of a pose.
    """
    found = [_solutions(arm, T, angle) for T, angle in zip(T_base_flange, psi.tolist(), strict=True)]
    table = np.full((len(found), max(_LEAST, *map(len, found)), 7), np.nan)
    for row, solutions in zip(table, found, strict=True):
        if solutions:
            row[: len(solutions)] = solutions
    return table


def _solutions(arm: OffsetGeometry, T: Array, psi: float) -> list[tuple[float, ...]]:
    try:
        return SelfMotion(arm, Pose.from_matrix(T), None).branches(psi)
    except UnreachableError:
        return []
