"""Newton's method for any chain, with one joint held or none: refines guesses to joint angles for flange poses."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.forward import Chain, forward
from rcilab.model.kinematics.jacobian import tool_jacobian

_ROUNDS = 12  # Newton iterations; near the stretched arm two solutions meet, and the error only halves at first.
_SLOW_ROUNDS = 40
_MAX_STEP = 0.5  # [rad] Bound of a step.
_CONVERGING = 3e-7  # [m] and [rad] The next step reduces a smaller error to rounding, as each squares it.
_TOLERANCE = 1e-10  # [m] and [rad] Largest error of a solution.
_SMALL_STEP = 1e-7  # [rad] Last step of `refine_near`, for the same reason.
_LARGEST_STEP = 1.2  # [rad] A larger step of `refine_near` leaves its guess.
_TOLERANCE_NEAR = 1e-12  # [m] and [rad] Largest error of a solution of `refine_near`.
MOST_TURNED = radians(1.0)
"""By how much the orientation on a path may differ on an arm with fewer than six joints, [rad]. A tuning value: it
covers the tilt of a tool that was stopped on a line at 1 m/s."""
OFF_POSITION = 1e-5
"""By how much the position may differ there, [m]: rounding of a pose of single precision."""
WEIGHTS = np.array((100.0, 100.0, 100.0, 1.0, 1.0, 1.0))
"""Of position and orientation where such an arm reaches a pose only almost: the tool keeps its position."""


def refine(
    chain: Chain,
    held: int | None,
    rotations: Array,
    positions: Array,
    q: Array,
    *,
    slowly: bool = False,
    is_path: bool = False,
) -> tuple[Array, NDArray[np.bool_]]:
    """Returns joint angles near guesses for poses of the flange, by Newton's method.

    Args:
        chain: From `build_chain`.
        held: Index of the joint that keeps the guesses' angle; None for none.
        rotations: Flange in base, shape (M, 3, 3).
        positions: Flange in base, shape (M, 3), [m].
        q: Guesses, shape (M, n), [rad].
        slowly: Whether to iterate down to rounding, as required where two solutions almost coincide.
        is_path: Whether an arm with fewer than six joints may miss the orientation by `MOST_TURNED`.

    Returns:
        Joint angles, shape (M, n), [rad], and whether each is a solution, shape (M,).
    """
    q = np.array(q)
    free = free_joints(chain, held)
    error = np.full(len(q), np.inf)
    active = np.arange(len(q))
    for _ in range(_SLOW_ROUNDS if slowly else _ROUNDS):
        J, pose_error = differential(chain, q[active], rotations[active], positions[active])
        error[active] = np.abs(pose_error).max(axis=1)
        step = solve_steps(J[:, :, free], pose_error)
        step *= np.minimum(1.0, _MAX_STEP / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        before = error[active]
        q[active[:, None], free] += step
        active = active[before > (_TOLERANCE / 10.0 if slowly else _CONVERGING)]
        if not len(active):
            break
    _, pose_error = differential(chain, q, rotations, positions)
    if is_path and len(free) < 6:
        return q, _is_aimed(pose_error)
    return q, np.abs(pose_error).max(axis=1) < _TOLERANCE


def refine_near(
    chain: Chain,
    held: int | None,
    rotation: Array,
    position: Array,
    psi: float,
    guess: Sequence[float],
    *,
    is_path: bool = False,
) -> list[float] | None:
    """Returns the joint angles of one pose near a guess, n plain floats, [rad], or None without a solution.

    Args:
        chain: From `build_chain`.
        held: Index of the joint that is held at `psi`; None for none.
        rotation: Flange in base, shape (3, 3).
        position: Flange in base, shape (3,), [m].
        psi: Angle of the held joint, [rad].
        guess: Joint angles close to the solution, n plain floats, [rad].
        is_path: As for `refine`.
    """
    q = [*guess]
    free = free_joints(chain, held)
    if held is not None:
        q[held] = psi
    for _ in range(_ROUNDS):
        J, _ = tool_jacobian(chain, q)
        pose_error = _pose_error(forward(chain, q), rotation, position)
        try:
            step = np.linalg.solve(J[:, free], pose_error) if len(free) == 6 else solve_steps(J[:, free], pose_error)
        except np.linalg.LinAlgError:
            return None
        if np.abs(step).max() > _LARGEST_STEP:
            return None
        for joint, step_angle in zip(free, step.tolist(), strict=True):
            q[joint] += step_angle
        if np.abs(step).max() < _SMALL_STEP:
            break
    pose_error = _pose_error(forward(chain, q), rotation, position)
    is_solved = np.abs(pose_error).max() < _TOLERANCE_NEAR or (is_path and len(free) < 6 and _is_aimed(pose_error))
    return q if is_solved else None


def free_joints(chain: Chain, held: int | None) -> list[int]:
    """Returns the indices of the joints that are not held."""
    return [joint for joint in range(len(chain)) if joint != held]


def _is_aimed(pose_error: Array) -> NDArray[np.bool_]:
    """Returns whether differences to poses, shape (..., 6), are those that fewer than six joints may leave."""
    off, turned = np.abs(pose_error[..., :3]).max(axis=-1), np.linalg.norm(pose_error[..., 3:], axis=-1)
    return np.asarray((off < OFF_POSITION) & (turned < MOST_TURNED))


def _pose_error(current: Pose, rotation: Array, position: Array) -> Array:
    """Returns the difference to a pose as a small twist, base axes, shape (6,)."""
    R = rotation @ current.rotation.T
    w = 0.5 * np.array((R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]))
    return np.concatenate((position - current.position, w))


def differential(chain: Chain, q: Array, rotations: Array, positions: Array) -> tuple[Array, Array]:
    """Returns Jacobians of the flange, shape (M, 6, n), and differences to poses, shape (M, 6), base axes.

    The rotational difference is the axis times the sine of the angle, equal to the rotation vector if it is small.
    """
    J, p, axes = jacobians(chain, q)
    pose_error = np.empty((6, len(q)))
    pose_error[:3] = positions.T - p
    pose_error[3:] = 0.5 * sum(cross(current, rotations[:, :, i].T) for i, current in enumerate(axes))
    return J, pose_error.T


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


def solve_steps(J: Array, pose_error: Array) -> Array:
    """Returns the steps that J maps to the differences, shape (..., n); of least squares if they are not unique."""
    if J.shape[-2] != J.shape[-1]:
        inverse = np.asarray(np.linalg.pinv(WEIGHTS[:, None] * J), dtype=np.float64)
        return (inverse @ (WEIGHTS * pose_error)[..., None])[..., 0]
    try:
        return np.asarray(np.linalg.solve(J, pose_error[..., None])[..., 0], dtype=np.float64)
    except np.linalg.LinAlgError:  # A Jacobian is exactly singular.
        inverse = np.asarray(np.linalg.pinv(J, rcond=1e-9), dtype=np.float64)
        return (inverse @ pose_error[..., None])[..., 0]


def cross(a: Array, b: Array) -> Array:
    """Returns the cross products of the columns of two arrays, shape (3, M)."""
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))
