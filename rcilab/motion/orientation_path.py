"""Orientation of the tool as a smooth function of the share of a path, 0 to 1."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.spatial import Rotation9, rotation_between

_SAMPLES = 200
"""Number of intervals over which the largest rate of a rotation through a via orientation is searched."""
_MAX_SLOPE_RATIO = 1.5
"""Slope at via, relative to the mean slope of the slower part, up to which a cubic without curvature there does not
overshoot its other end."""


@dataclass(frozen=True, slots=True)
class Slerp:
    """A uniform rotation about one axis; between two orientations it is their slerp."""

    start: Rotation9
    """Orientation at the start, row-major."""
    turn: tuple[float, float, float]
    """The whole rotation as a rotation vector in the axes of the start, of any angle, [rad]."""

    @property
    def max_rate(self) -> float:
        """Largest rate of rotation by the share: here the whole angle, [rad]."""
        return math.hypot(*self.turn)

    def sample(self, shares: Array) -> Array:
        """Returns the orientations, shape (N, 3, 3), at many shares, shape (N,)."""
        angle = self.max_rate
        R = np.array(self.start).reshape(3, 3)
        K = _cross_product_matrix(np.array(self.turn) / (angle or 1.0))
        # Rodrigues: 1 + sin K + (1 - cos) K^2, with the constant parts multiplied out once.
        constant, sine, cosine = R @ (np.eye(3) + K @ K), R @ K, -R @ K @ K
        # Each element contiguous in memory, because path computations use columns.
        rows = np.multiply.outer(sine, np.sin(shares * angle))
        rows += np.multiply.outer(cosine, np.cos(shares * angle))
        rows += constant[:, :, np.newaxis]
        return rows.transpose(2, 0, 1)


@dataclass(frozen=True, slots=True)
class ViaOrientation:
    """A rotation exactly through a via orientation at a share of the path, with continuous acceleration.

    The orientation is R_via exp(p(u)) with a rotation vector p(u) in the axes of via. On each side of via p is a cubic;
    at via the slopes of both are equal and the second derivatives zero, so that rotation velocity and acceleration are
    continuous. If via lies on the slerp from start to goal at its share, the rotation is exactly that slerp.
    """

    via: Rotation9
    """Via orientation, row-major."""
    via_share: float
    """Share of the path at which it is passed, between 0 and 1."""
    before: tuple[float, float, float]
    """Rotation vector from via back to the start, in the axes of via, [rad]."""
    after: tuple[float, float, float]
    """Rotation vector from via to the goal, in the axes of via, [rad]."""

    @property
    def max_rate(self) -> float:
        """Largest rate of rotation by the share, [rad]."""
        turns = turns_between(self.sample(np.linspace(0.0, 1.0, _SAMPLES + 1)))
        return _SAMPLES * math.sqrt(float((turns * turns).sum(axis=1).max()))

    def sample(self, shares: Array) -> Array:
        """Returns the orientations, shape (N, 3, 3), at many shares, shape (N,)."""
        u = shares - self.via_share
        length_before, length_after, slope = self.via_share, 1.0 - self.via_share, self._slope()
        cubic = np.where(u < 0.0, u / -length_before, u / length_after) ** 3
        p = np.multiply.outer(slope, u)
        p += np.multiply.outer(np.array(self.before) + slope * length_before, np.where(u < 0.0, cubic, 0.0))
        p += np.multiply.outer(np.array(self.after) - slope * length_after, np.where(u < 0.0, 0.0, cubic))
        turned = np.array(self.via).reshape(3, 3) @ _exponential(p).reshape(3, -1)
        return turned.reshape(3, 3, -1).transpose(2, 0, 1)  # Each element contiguous, as above.

    def _slope(self) -> Array:
        """Returns dp/du at via, shape (3,), weighted towards the slower part, so that nothing overshoots.

        For rotations about one axis in one direction it is the harmonic mean of the mean slopes, and zero where the
        direction changes, as in Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5(2), 1984.
        """
        a, b = -np.array(self.before) / self.via_share, np.array(self.after) / (1.0 - self.via_share)
        size_a, size_b = float(np.linalg.norm(a)), float(np.linalg.norm(b))
        if min(size_a, size_b) == 0.0:
            return np.zeros(3)
        mean = (size_b * a + size_a * b) / (size_a + size_b)
        size = float(np.linalg.norm(mean))
        return mean * min(1.0, _MAX_SLOPE_RATIO * min(size_a, size_b) / size) if size > 0.0 else mean


Turning: TypeAlias = Slerp | ViaOrientation


def turn_to(start: Rotation9, goal: Rotation9) -> Slerp:
    """Returns the slerp from one orientation to another, in the shorter direction; both row-major."""
    return Slerp(start, _turn_of(start, goal))


def turn_through(start: Rotation9, via: Rotation9, goal: Rotation9, via_share: float) -> ViaOrientation:
    """Returns the rotation from start to goal that passes a via orientation at a share of the path.

    Both parts turn in the shorter direction, so the whole rotation is up to 2 pi.

    Args:
        start: Orientation, row-major.
        via: Orientation, row-major.
        goal: Orientation, row-major.
        via_share: Share of the path at which via is passed, between 0 and 1.
    """
    return ViaOrientation(via, via_share, _turn_of(via, start), _turn_of(via, goal))


def turns_between(rotations: Array) -> Array:
    """Returns the rotation vectors from each orientation to the next, in base axes.

    Args:
        rotations: Orientations in base, shape (N, 3, 3), less than a quarter turn from one to the next.

    Returns:
        Shape (N - 1, 3), [rad].
    """
    R = rotations[1:] @ rotations[:-1].transpose(0, 2, 1)
    sines = 0.5 * np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1)
    size = np.sqrt((sines * sines).sum(axis=1))
    scale = np.where(size > 0.0, np.arcsin(np.minimum(size, 1.0)) / np.where(size > 0.0, size, 1.0), 1.0)
    return sines * scale[:, np.newaxis]


def _turn_of(a: Rotation9, b: Rotation9) -> tuple[float, float, float]:
    """Returns the rotation vector that turns a into b, in the axes of a: log(R_a^T R_b)."""
    x, y, z = rotation_between(a, b)  # In base.
    return (a[0] * x + a[3] * y + a[6] * z, a[1] * x + a[4] * y + a[7] * z, a[2] * x + a[5] * y + a[8] * z)


def _exponential(p: Array) -> Array:
    """Returns the matrices, shape (3, 3, N), of rotation vectors, shape (3, N), [rad]."""
    x, y, z = p
    xx, yy, zz = p * p
    angle = np.sqrt(xx + yy + zz)
    # sin(a / 2) / a gives sin(a) / a and (1 - cos(a)) / a^2, accurate at zero too.
    part = np.divide(np.sin(0.5 * angle), angle, out=np.full(len(angle), 0.5), where=angle > 0.0)
    across, along = 2.0 * part * np.cos(0.5 * angle), 2.0 * part * part
    sx, sy, sz = across * p
    cx, cy = along * x, along * y
    xy, xz, yz = cx * y, cx * z, cy * z
    xx, yy, zz = along * xx, along * yy, along * zz
    rows = (1.0 - yy - zz, xy - sz, xz + sy, xy + sz, 1.0 - xx - zz, yz - sx, xz - sy, yz + sx, 1.0 - xx - yy)
    return np.array(rows).reshape(3, 3, -1)


def _cross_product_matrix(p: Array) -> Array:
    """Returns the skew-symmetric matrix of a vector, shape (3,) to (3, 3)."""
    x, y, z = p.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
