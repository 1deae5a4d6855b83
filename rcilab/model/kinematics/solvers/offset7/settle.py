"""Newton's method for an arm with offsets, joint 3 held: joint angles next to guesses that put the flange at poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.forward import Chain, forward
from rcilab.model.kinematics.jacobian import tool_jacobian
from rcilab.model.kinematics.solvers.offset7.arm import ELBOW, OffsetGeometry

_ROUNDS = 12  # Of Newton's method; beside the stretched arm two solutions meet, and the first steps only halve.
_LONGEST = 0.5  # [rad] Of its steps.
_ALMOST = 3e-7  # [m] and [rad] What is missing before a step that leaves rounding, as each squares it.
_GOOD = 1e-10  # [m] and [rad] What counts as the pose at the end.
_CLOSE = 1e-7  # [rad] The last step of one alone, by the same reason.
_FARTHEST = 1.2  # [rad] A step of one alone that leaves its guess.
_SETTLED = 1e-12  # [m] and [rad] What counts as the pose for one alone.
_FREE = [joint for joint in range(7) if joint != ELBOW]


def settle(arm: OffsetGeometry, rotations: Array, positions: Array, q: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Returns joint angles next to guesses that put the flange at poses, joint 3 held, by Newton's method.

    Args:
        arm: From `build_offset_geometry`.
        rotations: Flange in base, shape (M, 3, 3).
        positions: Flange in base, shape (M, 3), [m].
        q: Guesses, shape (M, 7), [rad].

    Returns:
        Joint angles, shape (M, 7), [rad], and which of them are solutions, shape (M,).
    """
    q = np.array(q)
    error = np.full(len(q), np.inf)
    active = np.arange(len(q))
    for _ in range(_ROUNDS):
        J, miss = _differential(arm.chain, q[active], rotations[active], positions[active])
        error[active] = np.abs(miss).max(axis=1)
        step = _solved(J[:, :, _FREE], miss)
        step *= np.minimum(1.0, _LONGEST / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        before = error[active]
        q[active[:, None], _FREE] += step
        active = active[before > _ALMOST]
        if not len(active):
            break
    _, miss = _differential(arm.chain, q, rotations, positions)
    return q, np.abs(miss).max(axis=1) < _GOOD


def settle_beside(
    arm: OffsetGeometry, rotation: Array, position: Array, psi: float, guess: Sequence[float]
) -> list[float] | None:
    """Returns the joint angles of one pose next to a guess, 7 plain floats, [rad], or None where there are none.

    Args:
        arm: From `build_offset_geometry`.
        rotation: Flange in base, shape (3, 3).
        position: Flange in base, shape (3,), [m].
        psi: Arm angle, [rad].
        guess: Joint angles close by, 7 plain floats, [rad].
    """
    q = [*guess]
    q[ELBOW] = psi
    for _ in range(_ROUNDS):
        J, _ = tool_jacobian(arm.chain, q)
        miss = _miss(forward(arm.chain, q), rotation, position)
        try:
            step = np.linalg.solve(J[:, _FREE], miss)
        except np.linalg.LinAlgError:
            return None
        if np.abs(step).max() > _FARTHEST:
            return None
        for joint, turn in zip(_FREE, step.tolist(), strict=True):
            q[joint] += turn
        if np.abs(step).max() < _CLOSE:
            break
    missing = np.abs(_miss(forward(arm.chain, q), rotation, position)).max()
    return q if missing < _SETTLED else None


def _miss(now: Pose, rotation: Array, position: Array) -> Array:
    """Returns what is missing to a pose as a small twist, base axes, shape (6,)."""
    turn = rotation @ now.rotation.T
    w = 0.5 * np.array((turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]))
    return np.concatenate((position - now.position, w))


def _differential(chain: Chain, q: Array, rotations: Array, positions: Array) -> tuple[Array, Array]:
    """Returns Jacobians of the flange, shape (M, 6, 7), and what is missing to poses, shape (M, 6), base axes."""
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
        J[:3, column] = _cross(axis, p - origin)
        J[3:, column] = axis
    miss = np.empty((6, count))
    miss[:3] = positions.T - p
    miss[3:] = 0.5 * sum(_cross(now, rotations[:, :, i].T) for i, now in enumerate((x, y, z)))
    return np.moveaxis(J, 2, 0), miss.T


def _solved(J: Array, miss: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(J, miss[..., None])[..., 0], dtype=np.float64)
    except np.linalg.LinAlgError:  # One of them is exactly singular.
        inverse = np.asarray(np.linalg.pinv(J, rcond=1e-9), dtype=np.float64)
        return (inverse @ miss[..., None])[..., 0]


def _cross(a: Array, b: Array) -> Array:
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))
