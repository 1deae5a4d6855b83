"""Rotations as matrices and as rotation vectors (axis times angle), for stop planner and rate limiter."""

from __future__ import annotations

import math

import numpy as np

from rcilab.core.arrays import Array, Matrix
from rcilab.core.spatial import Rotation9, rotation_between

_TINY = 1e-12  # [rad] Below it the axis of a rotation is not defined numerically.


def rotation_vector(R_old: Matrix, R_new: Matrix) -> Array:
    """Returns the rotation vector from one orientation to another, in their common axes, shape (3,), [rad].

    Args:
        R_old: Shape (3, 3).
        R_new: Shape (3, 3).
    """
    return np.array(rotation_between(as_rotation9(R_old), as_rotation9(R_new)))


def rotation_matrix(vector: Array) -> Matrix:
    """Returns the rotation matrix, shape (3, 3), of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector if angle < _TINY else vector / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < _TINY:
        return np.eye(3) + K
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K)


def as_rotation9(R: Matrix) -> Rotation9:
    """Returns a rotation matrix, shape (3, 3), as nine floats, row-major."""
    a, b, c, d, e, f, g, h, i = R.ravel().tolist()
    return a, b, c, d, e, f, g, h, i
