"""Search for joint angles of poses: damped least squares from given starts, refined by Newton's method."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointVector
from rcilab.model.kinematics.forward import Chain
from rcilab.model.kinematics.solvers.newton import cross, free_joints, jacobians, refine
from rcilab.model.kinematics.solvers.solver import Angles

_STEPS = 18  # Iterations of damped least squares; a start that has not converged by then rarely does.
_GAIN = 0.02  # Damping relative to the squared error: more is slower, less makes larger jumps.
_DAMPING = 1e-3  # Smallest damping, lengths as shares of the reach; bounds steps close to singularities.
_MAX_STEP = 0.7  # [rad] Bound of a step: longer ones leave the region in which the Jacobian is valid.
_CLOSE = 1e-3  # Error, lengths as shares of the reach, from which Newton's method continues.
_TOLERANCE = 1e-5  # [rad] Solutions that differ by less are equal.


class NumericArm:
    """The data of an arm for the search. Immutable.

    Args:
        chain: From `build_chain`.
        held: Index of the joint that is held at the redundancy angle; None for none.
        lower: Smallest joint angles, shape (n,), [rad].
        upper: Largest joint angles, shape (n,), [rad].
        reach: Length of the stretched arm, [m].
    """

    def __init__(self, chain: Chain, held: int | None, lower: JointVector, upper: JointVector, reach: float) -> None:
        self.chain, self.held, self.reach = chain, held, reach
        self.n = len(chain)
        self._lower, self._upper = lower, upper
        self.middle = 0.5 * (lower + upper)
        """Middles of the joints' ranges, shape (n,), [rad]: solutions are within half a turn of them."""
        self._half = np.minimum(0.5 * (upper - lower), pi)

    def seeds(self, count: int, attempt: int = 0) -> Array:
        """Returns starts, evenly distributed over the joints' ranges, shape (count, n), [rad].

        Args:
            count: Number of starts.
            attempt: Index of the attempt; each has different starts.
        """
        # Additive recurrence with the roots of x^(n+1) = x + 1 (Roberts 2018): no clusters, deterministic.
        root = 2.0
        for _ in range(40):
            root = (1.0 + root) ** (1.0 / (self.n + 1))
        numbers = np.arange(1 + attempt * count, 1 + (attempt + 1) * count)
        shares = np.mod(0.5 + numbers[:, None] * root ** -np.arange(1.0, self.n + 1.0), 1.0)
        return self.middle + self._half * (2.0 * shares - 1.0)

    def placed(self, q: Array) -> Array:
        """Returns joint angles within half a turn of the middles of their ranges, of q's shape, [rad]."""
        return q - tau * np.round((q - self.middle) / tau)

    def is_inside(self, q: Sequence[float]) -> bool:
        """Returns whether joint angles are inside the limits."""
        return bool(((self._lower < q) & (q < self._upper)).all())

    def distinct(self, q: Array) -> list[Angles]:
        """Returns the distinct solutions of those given, shape (m, n), [rad], within half a turn of the middles."""
        found: list[Array] = []
        for row in self.placed(q):
            turns = [row - other for other in found]
            if all(np.abs(turn - tau * np.round(turn / tau)).max() > _TOLERANCE for turn in turns):
                found.append(row)
        return [tuple(row.tolist()) for row in found]


def search(arm: NumericArm, rotations: Array, positions: Array, q: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Returns joint angles for poses of the flange, and whether each row is a solution, shape (M,).

    Damped least squares with damping by the error (Sugihara, IEEE Transactions on Robotics 27(5), 2011, eq. 22): far
    from the pose the steps are small and safe, close to it they are Newton steps.

    Args:
        arm: The arm.
        rotations: Flange in base, shape (M, 3, 3).
        positions: Flange in base, shape (M, 3), [m].
        q: Starts, shape (M, n), [rad]; a held joint keeps its angle.
    """
    q = np.array(q)
    free = free_joints(arm.chain, arm.held)
    scale = np.array((1.0 / arm.reach,) * 3 + (1.0,) * 3)
    active = np.arange(len(q))
    close = np.zeros(len(q), dtype=np.bool_)
    eye = np.eye(6)
    for _ in range(_STEPS):
        J, p, axes = jacobians(arm.chain, q[active])
        error = scale * np.concatenate((positions[active] - p.T, _turns(axes, rotations[active])), axis=1)
        size = np.einsum("ij,ij->i", error, error)
        is_close = size < _CLOSE * _CLOSE
        close[active[is_close]] = True
        J, error, size, active = J[~is_close], error[~is_close], size[~is_close], active[~is_close]
        if not len(active):
            break
        J = scale[:, None] * J[:, :, free]
        damped = J @ J.transpose(0, 2, 1) + (_GAIN * size + _DAMPING * _DAMPING)[:, None, None] * eye
        step = (J.transpose(0, 2, 1) @ np.linalg.solve(damped, error[..., None]))[..., 0]
        step *= np.minimum(1.0, _MAX_STEP / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
        q[active[:, None], free] += step
    is_solution = np.zeros(len(q), dtype=np.bool_)
    if close.any():
        q[close], is_solution[close] = refine(arm.chain, arm.held, rotations[close], positions[close], q[close])
        missed = close & ~is_solution
        if (
            missed.any() and not is_solution.any()
        ):  # Near the meeting point of two solutions Newton's method only halves the error.
            q[missed], is_solution[missed] = refine(
                arm.chain, arm.held, rotations[missed], positions[missed], q[missed], slowly=True
            )
    return q, is_solution


def _turns(axes: tuple[Array, Array, Array], rotations: Array) -> Array:
    """Returns the rotation vectors from the flange to its desired rotations, base axes, shape (M, 3), [rad]."""
    desired = [rotations[:, :, i].T for i in range(3)]
    sines = 0.5 * np.sum([cross(current, target) for current, target in zip(axes, desired, strict=True)], axis=0)
    cosine = 0.5 * (sum((current * target).sum(axis=0) for current, target in zip(axes, desired, strict=True)) - 1.0)
    sine = np.sqrt((sines * sines).sum(axis=0))
    factor = np.arctan2(sine, cosine) / np.maximum(sine, 1e-12)  # Half a turn has no axis here; that start is lost.
    return np.where(sine > 1e-9, factor * sines, sines).T
