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

DEGREE = 8
"""Of the polynomial: 16 roots on the circle at most."""
_NODES = 20
"""Angles of joint 7 at which it is evaluated. Tuning value: 17 determine it, some more even out the rounding."""
_GRID = 256
"""Angles at which its sign is evaluated: fine enough that no two extrema lie within a step, unless it is flat."""
_FLAT, _FINER = 1e-6, 16
"""Below what part of its size it is flat, and into how many parts a step is cut there; tuning value."""
_CELL = tau / _GRID
_NEWTON = 6  # Steps, each of which halves the range of a root if Newton's method leaves it.
_ROUNDING = 1e-13  # How far a polynomial may miss zero, by the sum of its coefficients, where two roots meet.
_STEP = 1e-5  # [rad] Of joint 7, by which derivatives are formed.
_NEAR, _FAR = 1e-4, 0.05  # [rad] How far from psi joint 3 may be at a root: every branch, and the nearest one.
_SMALL = 1e-8  # [rad] What a joint may still have to turn so that a straight line is exact to rounding.
_SAME = 1e-6  # [rad] Solutions that differ by less are equal.
_SPREAD = 64  # Number of solutions to return if there are infinitely many; tuning value.
_COLUMNS = 8  # At least, as many as the other arms have branches.
_BLOCK = 512  # Poses computed together, so that intermediate arrays fit into the cache; tuning value.

_HARMONICS = np.arange(DEGREE + 1)
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
    rows, q7 = _roots(harmonics(arm, rotations, positions, psi))
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
    values = polynomial(arm, rotations, positions, psi, _ANGLES)
    found = np.fft.rfft(values, axis=1)[:, : DEGREE + 1] * (2.0 / _NODES)
    found[:, 0] *= 0.5
    return found


def polynomial(arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array, q7: Array) -> tuple[Array, Array]:
    """Returns H0^2 - (1 - C^2) H1^2 and what divides it, each of shape (N, K), at K angles of joint 7, [rad]."""
    c7, s7 = np.cos(q7), np.sin(q7)
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
    upper, elbow, fore = arm.upper, arm.elbow, arm.fore
    F, G = 2.0 * (upper * fore - elbow * elbow), -2.0 * elbow * (upper + fore)
    size = (F * F + G * G) ** 0.5
    cf, sf = F / size, G / size
    C = (square - (2.0 * elbow * elbow + upper * upper + fore * fore)) / size
    rest = 1.0 - C * C
    # Everything that depends on joint 4 is a pair: without the sine of it, and in proportion to it.
    c4, s4 = (cf * C, -sf), (sf * C, cf)
    along = elbow * s4[0] - upper * c4[0] - fore, elbow * s4[1] - upper * c4[1]
    k = upper + fore * c4[0] - elbow * s4[0], fore * c4[1] - elbow * s4[1]
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


def _roots(c: NDArray[np.complex128]) -> tuple[NDArray[np.intp], Array]:
    """Returns the real roots of polynomials: which each belongs to, shape (R,), and the angle, [rad]."""
    spectrum = np.zeros((2, len(c), _GRID // 2 + 1), dtype=np.complex128)
    spectrum[0, :, : DEGREE + 1] = c * (_GRID / 2.0)
    spectrum[0, :, 0] *= 2.0
    spectrum[1, :, : DEGREE + 1] = 1j * _HARMONICS * spectrum[0, :, : DEGREE + 1]
    table = np.empty((2, len(c), _GRID + 1))
    table[:, :, :-1] = np.fft.irfft(spectrum, _GRID, axis=2)
    table[:, :, -1] = table[:, :, 0]
    rows, low, high = _steps(c, np.arange(len(c)), np.zeros(len(c)), _CELL, table)
    # Where a polynomial is flat, several roots may be close together; refine there.
    sizes = np.abs(table[0])
    flat, places = np.nonzero(np.maximum(sizes[:, 1:], sizes[:, :-1]) < _FLAT * np.abs(c).sum(axis=1, keepdims=True))
    if len(flat):
        starts: Array = places.astype(np.float64) * _CELL
        fine = _CELL / _FINER
        t = starts[:, None] + fine * np.arange(_FINER + 1)
        again = np.stack(_evaluated(np.repeat(c[flat], _FINER + 1, axis=0), t.ravel())).reshape(2, *t.shape)
        more_rows, more_low, more_high = _steps(c, flat, starts, fine, again)
        is_flat = np.zeros(sizes[:, 1:].shape, dtype=np.bool_)
        is_flat[flat, places] = True
        left = ~is_flat[rows, np.minimum((low / _CELL + 1e-6).astype(np.intp), _GRID - 1)]
        rows = np.concatenate((rows[left], more_rows))
        low, high = np.concatenate((low[left], more_low)), np.concatenate((high[left], more_high))
    return rows, _settled(c[rows], low, high)


def _steps(
    c: NDArray[np.complex128], owners: NDArray[np.intp], starts: Array, step: float, table: Array
) -> tuple[NDArray[np.intp], Array, Array]:
    """Returns ranges in which a polynomial changes its sign once: whose they are, and their ends, [rad].

    Args:
        c: Polynomials, shape (N, DEGREE + 1).
        owners: Which of them each row of the table is of, shape (m,).
        starts: Where each row begins, shape (m,), [rad].
        step: From place to place, [rad].
        table: Values and slopes, shape (2, m, places).
    """
    before, after = table[:, :, :-1], table[:, :, 1:]
    is_negative = before[0] < 0.0
    crosses = is_negative != (after[0] < 0.0)
    rows, places = np.nonzero(crosses)
    low = starts[rows] + step * places
    # Two roots within a step: both ends are on one side, and the way there leads to the other.
    sign = np.where(is_negative, -1.0, 1.0)
    twins, tops = np.nonzero(~crosses & (sign * before[1] < 0.0) & (sign * after[1] > 0.0))
    picked, left = c[owners[twins]], starts[twins] + step * tops
    bottom = _settled(picked * (1j * _HARMONICS), left, left + step)
    deep = sign[twins, tops] * _evaluated(picked, bottom)[0] < _ROUNDING * np.abs(picked).sum(axis=1)
    twins, left, bottom = owners[twins[deep]], left[deep], bottom[deep]
    ends = np.concatenate((low + step, bottom, left + step))
    return np.concatenate((owners[rows], twins, twins)), np.concatenate((low, left, bottom)), ends


def _settled(c: NDArray[np.complex128], low: Array, high: Array) -> Array:
    """Returns the root of each polynomial between two angles at which its signs differ, shape (R,), [rad]."""
    above = _evaluated(c, high)[0] > 0.0
    t = 0.5 * (low + high)
    for _ in range(_NEWTON):
        value, slope = _evaluated(c, t)
        beyond = (value > 0.0) == above
        high, low = np.where(beyond, t, high), np.where(beyond, low, t)
        newton = t - value / np.where(slope == 0.0, 1.0, slope)
        t = np.where((low <= newton) & (newton <= high), newton, 0.5 * (low + high))
    return t


def _evaluated(c: NDArray[np.complex128], t: Array) -> tuple[Array, Array]:
    """Returns values and slopes of polynomials at an angle each, [rad], shape (R,)."""
    powers = np.empty_like(c)
    powers[:, 0] = 1.0
    powers[:, 1:] = np.exp(1j * t)[:, None]
    terms = c * np.multiply.accumulate(powers, axis=1)
    return terms.real.sum(axis=1), -(terms.imag @ _HARMONICS)


def _joint_angles(
    arm: OffsetGeometry, rotations: Array, positions: Array, psi: Array, rows: NDArray[np.intp], q7: Array
) -> tuple[NDArray[np.intp], Array]:
    """Returns the solutions near roots; each root gives one, or none if it is caused by rounding."""
    table = trace(arm, rotations, positions, q7)[0].reshape(4, len(q7), 7)
    size = np.nan_to_num(np.abs(wrapped(2.0 * (table[..., ELBOW] - psi))), nan=pi)  # The twin is half a turn away.
    branch, root = np.nonzero((size < _NEAR) | ((size == size.min(axis=0)) & (size < _FAR)))
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
    """Returns which solutions differ from the two before; sorted by pose and joint angles."""
    is_new = np.ones(len(rows), dtype=np.bool_)
    for shift in (1, 2):
        same = rows[shift:] == rows[:-shift]
        is_new[shift:] &= ~(same & (np.abs(wrapped(q[shift:] - q[:-shift])).max(axis=1) < _SAME))
    return is_new
