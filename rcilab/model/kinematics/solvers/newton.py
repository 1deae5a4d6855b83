"""Newton's method for any chain, with one joint held or none: it refines guesses to joint angles for flange poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.forward import Chain, forward
from rcilab.model.kinematics.jacobian import tool_jacobian

_ROUNDS = 12  # Of Newton's method; near the stretched arm two solutions meet, and the first steps only halve.
_SLOW_ROUNDS = 40
_LONGEST = 0.5  # [rad] Of its steps.
_ALMOST = 3e-7  # [m] and [rad] What is missing before a step that leaves rounding, as each squares it.
_GOOD = 1e-10  # [m] and [rad] What counts as the pose at the end.
_CLOSE = 1e-7  # [rad] The last step of one alone, by the same reason.
_FARTHEST = 1.2  # [rad] A step of one alone that leaves its guess.
_SETTLED = 1e-12  # [m] and [rad] What counts as the pose for one alone.


def refine(
    chain: Chain, held: int | None, rotations: Array, positions: Array, q: Array, *, slowly: bool = False
) -> tuple[Array, NDArray[np.bool_]]:
    """Returns joint angles near guesses that put the flange at poses, by Newton's method.

    Args:
        chain: From `build_chain`.
        held: Which joint, from 0, keeps the guesses' angle; None for none.
        rotations: Flange in base, shape (M, 3, 3).
        positions: Flange in base, shape (M, 3), [m].
        q: Guesses, shape (M, n), [rad].
        slowly: Whether to iterate until rounding stops it, which is needed where two solutions almost coincide.

    Returns:
        Joint angles, shape (M, n), [rad], and which of them are solutions, shape (M,).
    """
    q = np.array(q)
    free = free_joints(chain, held)
    error = np.full(len(q), np.inf)
    active = np.arange(len(q))
    for _ in range(_SLOW_ROUNDS if slowly else _ROUNDS):
        J, miss = differential(chain, q[active], rotations[active], positions[active])
        error[active] = np.abs(miss).max(axis=1)
        step = solved(J[:, :, free], miss)
        step *= np.minimum(1.0, _LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        before = error[active]
        q[active[:, None], free] += step
        active = active[before > (_GOOD / 10.0 if slowly else _ALMOST)]
        if not len(active):
            break
    _, miss = differential(chain, q, rotations, positions)
    return q, np.abs(miss).max(axis=1) < _GOOD


def refine_near(
    chain: Chain, held: int | None, rotation: Array, position: Array, psi: float, guess: Sequence[float]
) -> list[float] | None:
    """Returns the joint angles of one pose near a guess, n plain floats, [rad], or None without a solution.

    Args:
        chain: From `build_chain`.
        held: Which joint, from 0, is held at `psi`; None for none.
        rotation: Flange in base, shape (3, 3).
        position: Flange in base, shape (3,), [m].
        psi: Angle of the held joint, [rad].
        guess: Joint angles close by, n plain floats, [rad].
    """
    q = [*guess]
    free = free_joints(chain, held)
    if held is not None:
        q[held] = psi
    for _ in range(_ROUNDS):
        J, _ = tool_jacobian(chain, q)
        miss = _miss(forward(chain, q), rotation, position)
        try:
            step = np.linalg.solve(J[:, free], miss) if len(free) == 6 else np.linalg.pinv(J[:, free]) @ miss
        except np.linalg.LinAlgError:
            return None
        if np.abs(step).max() > _FARTHEST:
            return None
        for joint, turn in zip(free, step.tolist(), strict=True):
            q[joint] += turn
        if np.abs(step).max() < _CLOSE:
            break
    missing = np.abs(_miss(forward(chain, q), rotation, position)).max()
    return q if missing < _SETTLED else None


def free_joints(chain: Chain, held: int | None) -> list[int]:
    """Returns the joints, from 0, that are not held."""
    return [joint for joint in range(len(chain)) if joint != held]


def _miss(now: Pose, rotation: Array, position: Array) -> Array:
    """Returns what is missing to a pose as a small twist, base axes, shape (6,)."""
    turn = rotation @ now.rotation.T
    w = 0.5 * np.array((turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]))
    return np.concatenate((position - now.position, w))


def differential(chain: Chain, q: Array, rotations: Array, positions: Array) -> tuple[Array, Array]:
    """Returns Jacobians of the flange, shape (M, 6, n), and what is missing to poses, shape (M, 6), base axes.

    The missing turn is its axis times its sine, which is the turn itself once it is small.
    """
    J, p, axes = jacobians(chain, q)
    miss = np.empty((6, len(q)))
    miss[:3] = positions.T - p
    miss[3:] = 0.5 * sum(cross(now, rotations[:, :, i].T) for i, now in enumerate(axes))
    return J, miss.T


def jacobians(chain: Chain, q: Array) -> tuple[Array, Array, tuple[Array, Array, Array]]:
    """Returns Jacobians of the flange, shape (M, 6, n), its position and its axes, each of shape (3, M), in base."""
    count = len(q)
    one, zero = np.ones(count), np.zeros(count)
    x, y, z = np.stack((one, zero, zero)), np.stack((zero, one, zero)), np.stack((zero, zero, one))
    p = np.zeros((3, count))
    axes: list[tuple[Array, Array]] = []
    for (offset, d, a, ca, sa), angle in zip(chain, q.T, strict=True):
        axes.append((z, p))
        c, s = np.cos(angle + offset), np.sin(angle + offset)
        u, v = c * x + s * y, c * y - s * x
        p = p + d * z + a * u
        x, y, z = u, ca * v + sa * z, ca * z - sa * v
    J = np.empty((6, len(chain), count))
    for column, (axis, origin) in enumerate(axes):
        J[:3, column] = cross(axis, p - origin)
        J[3:, column] = axis
    return np.moveaxis(J, 2, 0), p, (x, y, z)


def solved(J: Array, miss: Array) -> Array:
    """Returns the steps that J maps to what is missing, shape (M, n); of least squares where that is not unique."""
    if J.shape[1] != J.shape[2]:
        return np.asarray((np.linalg.pinv(J) @ miss[..., None])[..., 0], dtype=np.float64)
    try:
        return np.asarray(np.linalg.solve(J, miss[..., None])[..., 0], dtype=np.float64)
    except np.linalg.LinAlgError:  # One of them is exactly singular.
        inverse = np.asarray(np.linalg.pinv(J, rcond=1e-9), dtype=np.float64)
        return (inverse @ miss[..., None])[..., 0]


def cross(a: Array, b: Array) -> Array:
    """Returns the cross products of the columns of two arrays, shape (3, M)."""
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))
