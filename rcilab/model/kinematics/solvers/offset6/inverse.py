"""The inverse of a 6-axis arm with an offset wrist: every solution, as the roots of one polynomial.

By joint 6 alone the wrist W and axis 5 are known. With v = W - S from the shoulder, r its distance from axis 1, z its
height, and t the direction of axis 5, the condition is that axis 4, which turns with the forearm, is at a right angle
to t. The forearm of the planar arm is k v + u J v, J a quarter turn; both sides of axis 1 (the sign of r) and both
elbows (that of u) satisfy

    r P A + B Q = 0,   A = c K - s u,   B = s K + c u,   P = t v,   Q = v^2 t_z - z P,
    K = (v^2 + fore^2 - upper^2) / 2,   u^2 = fore^2 v^2 - K^2,   c, s: the angle from forearm to axis 4.

Its product over both signs of r is X + Y u = 0 times v^2, and over both of u F = X^2 - Y^2 u^2, which are trigonometric
polynomials in joint 6. F is of degree 8, as required for 16 solutions: higher terms cancel (found by evaluation, and
covered by a test). Its values at a few angles give its coefficients.

Without an offset the wrist does not depend on joint 6, and axis 5 follows from axes 4 and 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin, tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.model.kinematics.solvers.newton import refine
from rcilab.model.kinematics.solvers.offset6.arm import OffsetSixGeometry
from rcilab.model.kinematics.solvers.trigonometric_roots import find_roots, fourier_coefficients

DEGREE = 8
"""Of the polynomial: 16 roots on the circle at most."""
_NODES = 24
"""Angles of joint 6 at which it is evaluated. Tuning value: 17 determine it, some more even out the rounding."""
_ANGLES: Array = np.arange(_NODES, dtype=np.float64) * (tau / _NODES)
_NEAR = (
    0.1  # Cosine between axes 4 and 5 up to which a branch is tried at a root: a root near a singularity is inexact.
)
_AXIS_LOST = 1e-9  # Sine of the angle between axes 4 and 6 below which axis 5 may have any direction.
_FOLDED = 1e-9  # [m^2] Square of the wrist's distance from axis 1 or the shoulder below which a direction is lost.
_SLACK = 1e-9  # How far, in shares of the fourth power of the forearm, a wrist may seem out of reach by rounding.
_BLOCK = 512  # Poses computed together, so that intermediate arrays fit into the cache; tuning value.
_SIDES: Array = np.array((1.0, 1.0, -1.0, -1.0))[:, None]
_ELBOWS: Array = np.array((1.0, -1.0, 1.0, -1.0))[:, None]


def solve_poses(
    arm: OffsetSixGeometry, rotations: Array, positions: Array, near: Sequence[float] | None = None
) -> tuple[NDArray[np.intp], Array]:
    """Returns solutions at many poses, also outside the joint limits; some may be double.

    Args:
        arm: From `build_offset_six`.
        rotations: Flange in base, shape (N, 3, 3).
        positions: Flange in base, shape (N, 3), [m].
        near: Joint angles, [rad], of which joints 1 and 4 are taken where any angle is a solution; None: zeros.

    Returns:
        Which pose each solution belongs to, shape (R,), and the solutions, shape (R, 6), [rad].
    """
    solve = _offset_block if arm.wrist else _spherical_block
    guess = (0.0,) * 6 if near is None else near
    parts = [
        solve(arm, rotations[i : i + _BLOCK], positions[i : i + _BLOCK], guess)
        for i in range(0, len(positions), _BLOCK)
    ]
    rows, q = zip(*parts, strict=True)
    return np.concatenate([part + i * _BLOCK for i, part in enumerate(rows)]), np.concatenate(q)


def polynomial(arm: OffsetSixGeometry, rotations: Array, positions: Array, theta: Array) -> Array:
    """Returns F, whose roots are angles of joint 6, shape (N, K), at K angles of joint 6, [rad]; see `solve_poses`."""
    v, _, t = _wrists(arm, rotations[:, None], positions[:, None], theta[None])
    z, tz = v[..., 2], t[..., 2]
    square, P = (v * v).sum(axis=-1), (t * v).sum(axis=-1)
    Q = square * tz - z * P
    K = 0.5 * (square + arm.fore**2 - arm.upper**2)
    c, s = cos(arm.lean), sin(arm.lean)
    M = P * P + square * tz * tz - 2.0 * z * tz * P
    X = (c * c - s * s) * K * K * M + arm.fore**2 * (s * s * (square - z * z) * P * P - c * c * Q * Q)
    Y = 2.0 * c * s * K * M
    return X * X - Y * Y * (arm.fore**2 * square - K * K)


class _Trunks:
    """The first three joints for wrists, on both sides of axis 1 and with both elbows; shapes (4, R) and (4, R, 3)."""

    def __init__(self, arm: OffsetSixGeometry, v: Array, guess: Sequence[float]) -> None:
        flat = v[:, 0] ** 2 + v[:, 1] ** 2
        r, height = _SIDES * np.sqrt(flat) - arm.ahead, arm.rise * v[:, 2]
        square = r * r + height * height
        first = np.where(flat < _FOLDED, guess[0] + arm.offsets[0], np.arctan2(v[:, 1], v[:, 0]))
        first = first + np.where(_SIDES > 0.0, 0.0, pi)
        K = 0.5 * (square + arm.fore**2 - arm.upper**2)
        rest = arm.fore**2 * square - K * K
        u = _ELBOWS * np.sqrt(np.maximum(rest, 0.0))
        self.exists = np.broadcast_to((rest > -_SLACK * arm.fore**4) & (square > _FOLDED), u.shape)
        with np.errstate(invalid="ignore", divide="ignore"):
            f, g = (K * r - u * height) / square, (K * height + u * r) / square
        along = np.arctan2(g, f)
        second = np.arctan2(height - g, r - f)
        plane = along + arm.lean - arm.forward * pi / 2.0
        third = arm.same * (plane - second)
        self.theta = np.stack((first, second, third), axis=-1)
        ahead = np.stack((np.cos(first), np.sin(first), np.zeros_like(first)), axis=-1)
        up = np.array((0.0, 0.0, arm.rise))
        self.x = np.cos(plane)[..., None] * ahead + np.sin(plane)[..., None] * up
        axis = along + arm.lean
        self.z = np.cos(axis)[..., None] * ahead + np.sin(axis)[..., None] * up
        """The x axis of row 3, and axis 4, in base."""


def _offset_block(
    arm: OffsetSixGeometry, rotations: Array, positions: Array, guess: Sequence[float]
) -> tuple[NDArray[np.intp], Array]:
    rows, theta = find_roots(fourier_coefficients(polynomial(arm, rotations, positions, _ANGLES), DEGREE))
    R, p = rotations[rows], positions[rows]
    v, x5, t = _wrists(arm, R, p, theta)
    trunks = _Trunks(arm, v, guess)
    branch, root = np.nonzero(trunks.exists & (np.abs((trunks.z * t).sum(axis=-1)) < _NEAR))
    head = trunks.theta[branch, root]
    wrist = _wrist_angles(arm, trunks.x[branch, root], trunks.z[branch, root], t[root], x5[root])
    q = np.column_stack((head, wrist, theta[root])) - np.array(arm.offsets)
    q, good = refine(arm.chain, None, R[root], p[root], q)
    return rows[root][good], q[good]


def _spherical_block(
    arm: OffsetSixGeometry, rotations: Array, positions: Array, guess: Sequence[float]
) -> tuple[NDArray[np.intp], Array]:
    X, Y, Z = (rotations[:, :, i] for i in range(3))
    v, _, _ = _wrists(arm, rotations, positions, np.zeros(len(positions)))
    trunks = _Trunks(arm, v, guess)
    fourth = guess[3] + arm.offsets[3]
    free = arm.turns[0] * (sin(fourth) * trunks.x - cos(fourth) * np.cross(trunks.z, trunks.x))
    t = np.cross(trunks.z, Z)
    size = np.linalg.norm(t, axis=-1, keepdims=True)
    t = np.where(size < _AXIS_LOST, free, t / np.maximum(size, _AXIS_LOST))
    found: list[tuple[NDArray[np.intp], Array]] = []
    for axis in (t, -t):
        theta = np.arctan2(arm.turns[1] * (axis * X).sum(axis=-1), arm.turns[1] * (axis * Y).sum(axis=-1))
        x5 = np.cos(theta)[..., None] * X - np.sin(theta)[..., None] * Y
        wrist = _wrist_angles(arm, trunks.x, trunks.z, axis, x5)
        q = np.concatenate((trunks.theta, wrist, theta[..., None]), axis=-1) - np.array(arm.offsets)
        found.append((np.nonzero(trunks.exists)[1], q[trunks.exists]))
    return np.concatenate([rows for rows, _ in found]), np.concatenate([q for _, q in found])


def _wrists(arm: OffsetSixGeometry, rotations: Array, positions: Array, theta: Array) -> tuple[Array, Array, Array]:
    """Returns the wrist from the shoulder, the x axis of row 5 and axis 5, in base, at angles of joint 6."""
    X, Y, Z = (rotations[..., i] for i in range(3))
    c, s = np.cos(theta)[..., None], np.sin(theta)[..., None]
    x5 = c * X - s * Y
    v = positions - arm.hand * Z - arm.wrist * x5 - np.array((0.0, 0.0, arm.shoulder))
    return v, x5, arm.turns[1] * (s * X + c * Y)


def _wrist_angles(arm: OffsetSixGeometry, x3: Array, z3: Array, z4: Array, x5: Array) -> Array:
    """Returns the angles of joints 4 and 5 with their theta offsets, shape (..., 2), [rad]."""
    y3 = np.cross(z3, x3)
    fourth = np.arctan2(arm.turns[0] * (z4 * x3).sum(axis=-1), -arm.turns[0] * (z4 * y3).sum(axis=-1))
    x4 = np.cos(fourth)[..., None] * x3 + np.sin(fourth)[..., None] * y3
    fifth = np.arctan2((x5 * np.cross(z4, x4)).sum(axis=-1), (x5 * x4).sum(axis=-1))
    return np.stack((fourth, fifth), axis=-1)
