"""Orientation paths: smooth functions of the share of a path, 0 to 1."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.spatial import Rotation9, rotation_between

_LOOKS = 200
"""Evenly spaced points at which the largest rate of a rotation through a middle orientation is searched."""
_STEEPEST = 1.5
"""Slope at the middle, in mean slopes of the slower part, up to which a cubic that is straight there does not overshoot
its other end."""


@dataclass(frozen=True, slots=True)
class Slerp:
    """A uniform rotation about one axis; between two orientations it is their slerp."""

    start: Rotation9
    """Orientation at the start, row-major."""
    turn: tuple[float, float, float]
    """The whole turn as a rotation vector in the axes of the start, of any angle, [rad]."""

    @property
    def fastest(self) -> float:
        """Largest rate of the turn by the share of the way: here the whole angle, [rad]."""
        return math.hypot(*self.turn)

    def sample(self, shares: Array) -> Array:
        """Returns the orientations at many shares of the way, shape (N, 3, 3)."""
        angle = self.fastest
        R = np.array(self.start).reshape(3, 3)
        K = _crossing(np.array(self.turn) / (angle or 1.0))
        # Rodrigues: 1 + sin K + (1 - cos) K^2, its constant parts multiplied out once.
        still, across, along = R @ (np.eye(3) + K @ K), R @ K, -R @ K @ K
        # One element after the other in memory, as what follows along the path.
        rows = np.multiply.outer(across, np.sin(shares * angle))
        rows += np.multiply.outer(along, np.cos(shares * angle))
        rows += still[:, :, np.newaxis]
        return rows.transpose(2, 0, 1)


@dataclass(frozen=True, slots=True)
class ViaOrientation:
    """A rotation exactly through a middle orientation at a share of the path, with continuous acceleration.

    The orientation is R_middle exp(p(u)) with a rotation vector p(u) in the axes of the middle one: on each side of
    the middle a cubic whose slope there is the same on both sides and whose bend is zero. So the rotation velocity and
    acceleration are continuous all the way. Three orientations that a slerp would pass in proportion are turned through
    by exactly that slerp.
    """

    middle: Rotation9
    """Orientation at the middle, row-major."""
    place: float
    """Share of the way at which it is passed, between 0 and 1."""
    before: tuple[float, float, float]
    """Rotation vector from the middle back to the start, in the axes of the middle, [rad]."""
    after: tuple[float, float, float]
    """Rotation vector from the middle to the end, in the axes of the middle, [rad]."""

    @property
    def fastest(self) -> float:
        """Largest rate of the turn by the share of the way, [rad]."""
        turns = turns_between(self.sample(np.linspace(0.0, 1.0, _LOOKS + 1)))
        return _LOOKS * math.sqrt(float((turns * turns).sum(axis=1).max()))

    def sample(self, shares: Array) -> Array:
        """Returns the orientations at many shares of the way, shape (N, 3, 3)."""
        u = shares - self.place
        lead, rest, slope = self.place, 1.0 - self.place, self._slope()
        bend = np.where(u < 0.0, u / -lead, u / rest) ** 3
        p = np.multiply.outer(slope, u)
        p += np.multiply.outer(np.array(self.before) + slope * lead, np.where(u < 0.0, bend, 0.0))
        p += np.multiply.outer(np.array(self.after) - slope * rest, np.where(u < 0.0, 0.0, bend))
        turned = np.array(self.middle).reshape(3, 3) @ _exponential(p).reshape(3, -1)
        return turned.reshape(3, 3, -1).transpose(2, 0, 1)  # One element after the other in memory, as above.

    def _slope(self) -> Array:
        """Returns dp/du at the middle, shape (3,): towards the slower of both parts, so that nothing overshoots.

        For turns about one axis in one direction it is the harmonic mean of the mean slopes, and zero where the
        direction changes, as in Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5(2), 1984.
        """
        a, b = -np.array(self.before) / self.place, np.array(self.after) / (1.0 - self.place)
        size_a, size_b = float(np.linalg.norm(a)), float(np.linalg.norm(b))
        if min(size_a, size_b) == 0.0:
            return np.zeros(3)
        mean = (size_b * a + size_a * b) / (size_a + size_b)
        size = float(np.linalg.norm(mean))
        return mean * min(1.0, _STEEPEST * min(size_a, size_b) / size) if size > 0.0 else mean


Turning: TypeAlias = Slerp | ViaOrientation


def turn_to(start: Rotation9, goal: Rotation9) -> Slerp:
    """Returns the turn by slerp from one orientation to another, the shorter way, both row-major."""
    return Slerp(start, _turn_of(start, goal))


def turn_through(start: Rotation9, middle: Rotation9, goal: Rotation9, place: float) -> ViaOrientation:
    """Returns the turn from start to goal that passes the middle orientation at a place.

    Both parts turn the shorter way, so that the whole may turn by up to 2 pi.

    Args:
        start: Orientation, row-major.
        middle: Orientation, row-major.
        goal: Orientation, row-major.
        place: Share of the way at which the middle one is passed, between 0 and 1.
    """
    return ViaOrientation(middle, place, _turn_of(middle, start), _turn_of(middle, goal))


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
    """Returns the rotation matrices of rotation vectors, shape (3, 3, N) for (3, N), [rad]."""
    x, y, z = p
    xx, yy, zz = p * p
    angle = np.sqrt(xx + yy + zz)
    # sin(a / 2) / a: what sin(a) / a and (1 - cos(a)) / a^2 are made of, exact at zero too.
    part = np.divide(np.sin(0.5 * angle), angle, out=np.full(len(angle), 0.5), where=angle > 0.0)
    across, along = 2.0 * part * np.cos(0.5 * angle), 2.0 * part * part
    sx, sy, sz = across * p
    cx, cy = along * x, along * y
    xy, xz, yz = cx * y, cx * z, cy * z
    xx, yy, zz = along * xx, along * yy, along * zz
    rows = (1.0 - yy - zz, xy - sz, xz + sy, xy + sz, 1.0 - xx - zz, yz - sx, xz - sy, yz + sx, 1.0 - xx - yy)
    return np.array(rows).reshape(3, 3, -1)


def _crossing(p: Array) -> Array:
    """Returns the matrix of the cross product with a vector, shape (3, 3) for (3,)."""
    x, y, z = p.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
