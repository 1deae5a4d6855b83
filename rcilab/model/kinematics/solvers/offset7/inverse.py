"""The inverse of an arm with offsets at a held elbow: every solution, as the roots of one polynomial.

With joint 3 held at psi the arm has six joints and at most 16 solutions. Let v be the shoulder from the wrist, f the
direction of the forearm and x, z the axes of link 3 across and along the upper arm, all in base. By joint 7 alone v is
known; with it, up to a sign of the sine S of joint 4 behind the flip, so are that joint and the lengths of v across and
along the forearm. What is left is the angle of joint 6, which turns f in a plane:

    f v = along                              the triangle of shoulder, elbow and wrist,
    (c4 v + k f) sin psi + (f x v) cos psi   has no vertical part: joint 3 is at psi, or half a turn away.

Both are linear in the sine and cosine of joint 6, whose squares add up to 1. That leaves H0 + H1 S = 0, hence
H0^2 - (1 - C^2) H1^2 = 0, where H0, H1 and the cosine C are trigonometric polynomials in joint 7. The whole is one of
degree 8, as required for 16 solutions: higher terms cancel (found by evaluation, and covered by a test). Its values
at a few angles of joint 7 give its coefficients, and its sign changes on a fine grid bracket the roots.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.newton import refine, refine_near
from rcilab.model.kinematics.solvers.offset7.arm import ELBOW, OffsetGeometry, SelfMotion, trace, wrapped
from rcilab.model.kinematics.solvers.trigonometric_roots import find_roots, fourier_coefficients

DEGREE = 8
"""Of the polynomial: 16 roots on the circle at most."""
_NODES = 20
"""Angles of joint 7 at which it is evaluated. Tuning value: 17 determine it, some more even out the rounding."""
_STEP = 1e-5  # [rad] Of joint 7, by which derivatives are formed.
_FAR = 0.05  # [rad] How far from psi joint 3 may be at a root: where several coincide, rounding spreads them.
_SMALL = 1e-8  # [rad] What a joint may still have to turn so that a straight line is exact to rounding.
_SAME = 1e-6  # [rad] Solutions that differ by less are equal.
_SPREAD = 64  # Number of solutions to return if there are infinitely many; tuning value.
_COLUMNS = 8  # At least, as many as the other arms have branches.
_BLOCK = 512  # Poses computed together, so that intermediate arrays fit into the cache; tuning value.

_ANGLES: Array = np.arange(_NODES, dtype=np.float64) * (tau / _NODES)


def solve_held(arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array) -> tuple[NDArray[np.intp], Array]:
    """Returns every solution at many poses, joint 3 held, also outside the joint limits.

    Args:
        arm: From `build_offset_geometry`.
        rotations: Flange in base, shape (N, 3, 3).
        positions: Flange in base, shape (N, 3), [m].
        psi: Angles of joint 3, shape (N,), [rad].

    Returns:
        Which pose each solution belongs to, shape (R,), not decreasing, and the solutions, shape (R, 7), [rad], each
        angle within half a turn of the middle of its joint's range.
    """
    parts = [
        _solve_block(arm, rotations[i : i + _BLOCK], positions[i : i + _BLOCK], psi[i : i + _BLOCK])
        for i in range(0, len(psi), _BLOCK)
    ]
    rows, q = zip(*parts, strict=True)
    return np.concatenate([part + i * _BLOCK for i, part in enumerate(rows)]), np.concatenate(q)


def inverse_held(
    arm: OffsetGeometry, T_base_flange: Pose, psi: float, near: Sequence[float] | None
) -> list[tuple[float, ...]]:
    """Returns every solution at one pose, [rad], joint 3 held, also outside the joint limits.

    Args:
        arm: From `build_offset_geometry`.
        T_base_flange: Pose of the flange in base.
        psi: Angle of joint 3, [rad].
        near: Joint angles, [rad], next to which a solution is looked for, too: where two are about to meet, rounding
            may hide both; or None.

    Raises:
        UnreachableError: The pose is out of reach at every angle of joint 3.
    """
    rotation, position = T_base_flange.rotation, T_base_flange.position
    _, q = solve_held(arm, rotation[None], position[None], np.array((psi,)))
    adjacent = None if near is None else refine_near(arm.chain, ELBOW, rotation, position, psi, near)
    if adjacent is not None:
        middles = np.array(arm.middles)
        first = wrapped(np.array(adjacent) - middles) + middles
        q = np.concatenate((first[None], q[np.abs(wrapped(q - first)).max(axis=1) >= _SAME]))
    if not len(q):
        q = _without_a_crossing(arm, T_base_flange, psi)
    return [tuple(row) for row in q.tolist()]


def _without_a_crossing(arm: OffsetGeometry, T_base_flange: Pose, psi: float) -> Array:
    """Returns some solutions of a pose with constant joint 3 on the whole self-motion, as on an axis of symmetry.

    Raises:
        UnreachableError: The pose is out of reach at every angle of joint 3.
    """
    guesses = SelfMotion(arm, T_base_flange).starts
    guesses = guesses[np.abs(wrapped(guesses[:, ELBOW] - psi)) < _SAME]
    guesses = guesses[:: 1 + len(guesses) // _SPREAD]
    guesses[:, ELBOW] = psi
    count, middles = len(guesses), np.array(arm.middles)
    rotations = np.broadcast_to(T_base_flange.rotation, (count, 3, 3))
    q, good = refine(arm.chain, ELBOW, rotations, np.broadcast_to(T_base_flange.position, (count, 3)), guesses)
    return wrapped(q[good] - middles) + middles


def inverse_held_batch(arm: OffsetGeometry, T_base_flange: Array, psi: Array) -> Array:
    """Returns every solution at many poses, joint 3 held, also outside the joint limits.

    Args:
        arm: From `build_offset_geometry`.
        T_base_flange: Poses of the flange in base, shape (N, 4, 4).
        psi: Angles of joint 3, shape (N,), [rad].

    Returns:
        Shape (N, M, 7), [rad], M from the pose with the most; NaN after the last solution of a pose.
    """
    rows, q = solve_held(arm, T_base_flange[:, :3, :3], T_base_flange[:, :3, 3], psi)
    counts = np.bincount(rows, minlength=len(psi))
    table = np.full((len(psi), max(_COLUMNS, int(counts.max())), 7), np.nan)
    table[rows, np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)] = q
    return table


def _solve_block(arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array) -> tuple[NDArray[np.intp], Array]:
    rows, q7 = find_roots(harmonics(arm, rotations, positions, psi))
    rows, q = _joint_angles(arm, rotations[rows], positions[rows], psi[rows], rows, q7)
    middles = np.array(arm.middles)
    q = wrapped(q - middles) + middles
    order = np.lexsort((*q.T[::-1], rows))
    rows, q = rows[order], q[order]
    is_new = _are_new(rows, q)
    return rows[is_new], q[is_new]


def harmonics(arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array) -> NDArray[np.complex128]:
    """Returns the Fourier coefficients of the polynomial in joint 7, of order 0 to `DEGREE`, shape (N, DEGREE + 1).

    Its value at an angle t is the real part of the sum of c_k exp(i k t). Arguments as of `solve_held`.
    """
    return fourier_coefficients(polynomial(arm, rotations, positions, psi, _ANGLES), DEGREE)


def polynomial(arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array, q7: Array) -> Array:
    """Returns H0^2 - (1 - C^2) H1^2, shape (N, K), at K angles of joint 7, [rad]."""
    theta = q7 + arm.offsets[6]
    c7, s7 = np.cos(theta), np.sin(theta)
    X, Y, Z = (rotations[:, :, i] for i in range(3))
    v0 = np.array((0.0, 0.0, arm.shoulder)) - positions + arm.hand * Z

    def turning(x: Array, y: Array) -> Array:
        """Returns a component of joint 6's x axis from those of the flange's x and y axes."""
        return x[:, None] * c7 - y[:, None] * s7

    x6z, y6z = turning(X[:, 2], Y[:, 2]), -Z[:, 2:]
    along_x = turning((X * v0).sum(axis=1), (Y * v0).sum(axis=1))
    vx, vy = along_x + arm.wrist, -(Z * v0).sum(axis=1)[:, None]
    vz = v0[:, 2:] + arm.wrist * x6z
    square = (v0 * v0).sum(axis=1)[:, None] + arm.wrist**2 + 2.0 * arm.wrist * along_x
    # Vertical parts of the cross products of both axes with v.
    x_cross = turning(X[:, 0] * v0[:, 1] - X[:, 1] * v0[:, 0], Y[:, 0] * v0[:, 1] - Y[:, 1] * v0[:, 0])
    y_cross = (Z[:, 1] * v0[:, 0] - Z[:, 0] * v0[:, 1])[:, None] - arm.wrist * turning(
        Z[:, 0] * X[:, 1] - Z[:, 1] * X[:, 0], Z[:, 0] * Y[:, 1] - Z[:, 1] * Y[:, 0]
    )
    upper, elbow, bend, fore = arm.upper, arm.elbow, arm.bend, arm.fore
    F, G = 2.0 * (upper * fore - elbow * bend), -2.0 * (bend * upper + elbow * fore)
    size = (F * F + G * G) ** 0.5
    cf, sf = F / size, G / size
    C = (square - (elbow * elbow + bend * bend + upper * upper + fore * fore)) / size
    rest = 1.0 - C * C
    # Everything that depends on joint 4 is a pair: without the sine of it, and in proportion to it.
    c4, s4 = (cf * C, -sf), (sf * C, cf)
    along = elbow * s4[0] - upper * c4[0] - fore, elbow * s4[1] - upper * c4[1]
    k = upper + fore * c4[0] - bend * s4[0], fore * c4[1] - bend * s4[1]
    cp, sp = np.cos(psi)[:, None], np.sin(psi)[:, None]
    a = c4[0] * vz * sp, c4[1] * vz * sp
    b = k[0] * x6z * sp + x_cross * cp, k[1] * x6z * sp
    e = k[0] * y6z * sp + y_cross * cp, k[1] * y6z * sp
    p = a[0] * vy + e[0] * along[0] + rest * (e[1] * along[1]), a[1] * vy + e[0] * along[1] + e[1] * along[0]
    r = b[0] * along[0] + a[0] * vx + rest * (b[1] * along[1]), b[0] * along[1] + b[1] * along[0] + a[1] * vx
    d = b[0] * vy - e[0] * vx, b[1] * vy - e[1] * vx
    H0 = p[0] ** 2 + r[0] ** 2 - d[0] ** 2 + rest * (p[1] ** 2 + r[1] ** 2 - d[1] ** 2)
    H1 = 2.0 * (p[0] * p[1] + r[0] * r[1] - d[0] * d[1])
    return H0 * H0 - rest * H1 * H1


def _joint_angles(
    arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array, rows: NDArray[np.intp], q7: Array
) -> tuple[NDArray[np.intp], Array]:
    """Returns the solutions near roots; each root gives one, or none if it is caused by rounding."""
    table = trace(arm, rotations, positions, q7)[0].reshape(4, len(q7), 7)
    size = np.nan_to_num(np.abs(wrapped(2.0 * (table[..., ELBOW] - psi))), nan=pi)  # The twin is half a turn away.
    branch, root = np.nonzero(size < _FAR)
    R, p, wanted, q = rotations[root], positions[root], psi[root], table[branch, root]
    after = trace(arm, R, p, q7[root] + _STEP)[0].reshape(4, len(root), 7)[branch, np.arange(len(root))]
    along = wrapped(after - q)
    turned = np.abs(wrapped(q[:, ELBOW] - wanted)) > pi / 2.0
    q[turned, 0] += pi
    q[turned, 1] *= -1.0
    q[turned, ELBOW] += pi
    along[turned, 1] *= -1.0
    rest = wrapped(wanted - q[:, ELBOW])
    with np.errstate(invalid="ignore", divide="ignore"):
        share = rest / along[:, ELBOW]
        small = np.abs(share) * np.abs(along).max(axis=1) < _SMALL
    q[small] += share[small, None] * along[small]
    q[:, ELBOW] = wanted
    loose = np.flatnonzero(~small)
    good = np.ones(len(q), dtype=np.bool_)
    if len(loose):
        q[loose], good[loose] = refine(arm.chain, ELBOW, R[loose], p[loose], q[loose])
    return rows[root][good], q[good]


def _are_new(rows: NDArray[np.intp], q: Array) -> NDArray[np.bool_]:
    """Returns which solutions differ from all before them of their pose; `rows` is not decreasing."""
    is_new = np.ones(len(rows), dtype=np.bool_)
    for shift in range(1, int(np.bincount(rows).max(initial=0))):
        is_near = (rows[shift:] == rows[:-shift]) & (np.abs(wrapped(q[shift:, 0] - q[:-shift, 0])) < _SAME)
        near = np.flatnonzero(is_near)  # Few: only these are compared in all joints.
        is_same = np.abs(wrapped(q[near + shift] - q[near])).max(axis=1) < _SAME
        is_new[near[is_same] + shift] = False
    return is_new
