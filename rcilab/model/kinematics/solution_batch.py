"""All branches of the inverse at many poses, and validation of the poses."""

from __future__ import annotations

from math import tau
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import PERPENDICULAR_TOLERANCE, UNIT_TOLERANCE, Pose

Columns: TypeAlias = tuple[Array, Array, Array]
"""Three components of one vector per pose, each of shape (N,)."""


class SolutionBatch:
    """Every branch of the inverse at N poses. Read-only.

    Args:
        q: Branches, shape (N, M, n), [rad]; NaN for a pose out of reach.
        lower: Smallest joint angles, shape (n,), [rad].
        upper: Largest joint angles, shape (n,), [rad].
    """

    __slots__ = ("_lower", "_upper", "inside", "q")

    def __init__(self, q: Array, lower: Array, upper: Array) -> None:
        q.flags.writeable = False
        self.q = q
        """All branches in the order of `Solutions.all`, shape (N, M, n), [rad]."""
        self._lower, self._upper = lower, upper
        inside = np.ones(q.shape[:2], dtype=np.bool_)
        for joint in range(q.shape[2]):
            angle = q[:, :, joint]
            inside &= (angle > lower[joint]) & (angle < upper[joint])
        inside.flags.writeable = False
        self.inside: NDArray[np.bool_] = inside
        """Whether each branch is inside every joint limit, shape (N, M)."""

    def __len__(self) -> int:
        return len(self.q)

    @property
    def reachable(self) -> NDArray[np.bool_]:
        """Whether each pose has a branch inside the joint limits, shape (N,)."""
        return np.asarray(self.inside.any(axis=1), dtype=np.bool_)

    def nearest(self, near: ArrayLike) -> Array:
        """Returns the branch inside the limits that is closest to `near` at each pose.

        A joint whose range is longer than a full turn may be moved by full turns to come closer.

        Args:
            near: Joint angles, shape (n,) or (N, n), [rad].

        Returns:
            Shape (N, n), [rad]; NaN if no branch is inside the limits.

        Raises:
            InvalidValueError: `near` has another shape or is not finite.
        """
        count, _, n = self.q.shape
        reference = np.asarray(near, dtype=np.float64)
        if reference.shape not in ((n,), (count, n)) or not np.isfinite(reference).all():
            raise InvalidValueError("near", near, f"needs shape ({n},) or ({count}, {n}), finite [rad]")
        reference = np.broadcast_to(reference, (count, n))[:, None, :]
        shifted = self.q + np.round((reference - self.q) / tau) * tau
        shifted = np.where((shifted > self._lower) & (shifted < self._upper), shifted, self.q)
        distance = np.where(self.inside, np.square(shifted - reference).sum(axis=2), np.inf)
        chosen = shifted[np.arange(count), distance.argmin(axis=1)]
        return np.where(self.reachable[:, None], chosen, np.nan)

    def __repr__(self) -> str:
        return f"<SolutionBatch of {len(self)} poses, {int(self.reachable.sum())} inside the limits: .q, .inside>"


def as_pose_batch(value: ArrayLike) -> Array:
    """Returns checked homogeneous transforms, shape (N, 4, 4).

    Raises:
        InvalidValueError: They have another shape, or one is not a proper rigid transform; the message names it.
    """
    T = np.asarray(value, dtype=np.float64)
    if T.ndim != 3 or T.shape[1:] != (4, 4) or not len(T):
        raise InvalidValueError("T", f"an array of shape {T.shape}", "needs shape (N, 4, 4)")
    x, y, z = ((T[:, 0, i], T[:, 1, i], T[:, 2, i]) for i in range(3))
    with np.errstate(invalid="ignore", over="ignore"):
        is_valid = dot(cross(x, y), z) > 0.0
        for a, b in ((x, y), (y, z), (z, x)):
            is_valid &= abs(dot(a, b)) <= PERPENDICULAR_TOLERANCE
            is_valid &= abs(dot(a, a) - 1.0) <= 2.0 * UNIT_TOLERANCE
        is_valid &= np.isfinite(T[:, 0, 3] + T[:, 1, 3] + T[:, 2, 3])
    for column, value in enumerate((0.0, 0.0, 0.0, 1.0)):
        is_valid &= T[:, 3, column] == value
    if not is_valid.all():
        row = int(np.argmin(is_valid))
        Pose.from_matrix(T[row])  # Its error is more specific than the one below.
        raise InvalidValueError(f"T at row {row} (from 0)", T[row].tolist(), "is not a proper rigid transform")
    return T


def dot(a: Columns, b: Columns) -> Array:
    """Returns the scalar products of N pairs of vectors, shape (N,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Columns, b: Columns) -> Columns:
    """Returns the cross products of N pairs of vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
