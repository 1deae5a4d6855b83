"""Feasible angles of the held joint for an arm without closed form: a grid search, with edges found by bisection."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, tau

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointPath
from rcilab.core.errors import UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import Arc, FeasibleArcs, Reason
from rcilab.model.kinematics.solvers.newton import refine
from rcilab.model.kinematics.solvers.numeric.search import NumericArm, search

_GRID = 120  # Angles of the held joint, every 3 degrees; smaller ranges may be missed.
_SEEDS = 6  # Starts at each angle, in addition to the solutions at its neighbours.
_PASSES = 60  # Largest number of passes of solutions to both neighbours: once around the circle.
_HALVINGS = 10  # Of a grid step at an edge: 5e-5 rad.
_NO_SOLUTION = 1 << 9
"""Code of an angle without solution; otherwise a bit for each joint beyond its limit, and one for a singularity."""
_SINGULAR = 1 << 8


def numeric_arcs(
    arm: NumericArm, closeness: Callable[[JointPath], Array], T: Pose, lower: Array, upper: Array, outside_box: bool
) -> FeasibleArcs:
    """Returns the feasible angles of the held joint at a pose; edges of feasible ranges are on the safe side.

    Args:
        arm: The arm, with a held joint.
        closeness: `KinematicsSolver.singularity_path`.
        T: Pose of the flange in base.
        lower: Smallest joint angles, shape (n,), [rad].
        upper: Largest joint angles, shape (n,), [rad].
        outside_box: Whether the tool is outside the safety box, which does not depend on the angle.

    Raises:
        UnreachableError: No solution was found at any angle.
    """
    grid = _Grid(arm, closeness, T, lower, upper)
    psi = np.linspace(-pi, pi, _GRID, endpoint=False)
    q, codes = grid.solve_grid(psi)
    if (codes == _NO_SOLUTION).all():
        raise UnreachableError(
            "no joint angles put the tool there at whatever angle of joint 3; turn the tool or move the target"
        ).coded("no_angles")
    following = np.roll(np.arange(_GRID), -1)
    edges = np.flatnonzero(codes != codes[following])
    if not len(edges):
        return FeasibleArcs(arcs=(_arc(-pi, pi, int(codes[0]), outside_box),))
    ends = grid.edges(psi[edges], q[edges], codes[edges], q[following[edges]], codes[following[edges]])
    arcs = [
        _arc(start, end, code, outside_box)
        for start, end, code in zip(
            ends.tolist(), [*ends[1:].tolist(), ends[0] + tau], codes[following[edges]].tolist(), strict=True
        )
    ]
    if arcs[-1].start >= pi:  # The last edge may be in the grid step that ends at pi.
        last = arcs.pop()
        arcs.insert(0, _arc(last.start - tau, last.end - tau, int(codes[following[edges[-1]]]), outside_box))
    return FeasibleArcs(arcs=tuple(arcs))


class _Grid:
    def __init__(
        self, arm: NumericArm, closeness: Callable[[JointPath], Array], T: Pose, lower: Array, upper: Array
    ) -> None:
        self._arm, self._closeness, self._lower, self._upper = arm, closeness, lower, upper
        self._rotation, self._position = T.rotation, T.position
        self._bits = 1 << np.arange(arm.n)
        assert arm.held is not None
        self._held = arm.held

    def solve_grid(self, psi: Array) -> tuple[Array, NDArray[np.int64]]:
        """Returns the joint angles of the best branch at each angle, and its code."""
        seeds = np.tile(self._arm.seeds(_SEEDS), (len(psi), 1))
        seeds[:, self._held] = np.repeat(psi, _SEEDS)
        q, codes = self._coded(*search(self._arm, *self._poses(len(seeds)), seeds))
        q, codes = q.reshape(len(psi), _SEEDS, -1), codes.reshape(len(psi), _SEEDS)
        rows = np.arange(len(psi))
        best = _weight(codes).argmin(axis=1)
        q, codes = q[rows, best], codes[rows, best]
        for _ in range(_PASSES):
            guesses = np.concatenate([np.roll(q, step, axis=0) for step in (1, -1)])
            found, found_codes = self._refined(np.tile(psi, 2), guesses)
            is_better = False
            for side in (slice(None, len(psi)), slice(len(psi), None)):
                better = _weight(found_codes[side]) < _weight(codes)
                q[better], codes[better] = found[side][better], found_codes[side][better]
                is_better = is_better or bool(better.any())
            if not is_better:
                break
        return q, codes

    def edges(
        self, psi: Array, q: Array, codes: NDArray[np.int64], next_q: Array, next_codes: NDArray[np.int64]
    ) -> Array:
        """Returns the angles at which the code changes in the grid steps from psi, shape (m,), [rad]."""
        low, high = psi.copy(), psi + tau / _GRID
        q, next_q = q.copy(), next_q.copy()
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            found, found_codes = self._refined(np.tile(middle, 2), np.concatenate((q, next_q)))
            first, second = found_codes[: len(psi)], found_codes[len(psi) :]
            is_second = _weight(second) < _weight(first)
            best = np.where(is_second, second, first)
            angles = np.where(is_second[:, None], found[len(psi) :], found[: len(psi)])
            # On the side of the lower code only equal codes, so that an edge of a feasible range is feasible.
            is_low = np.where(_weight(codes) < _weight(next_codes), best == codes, best != next_codes)
            low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
            keeps_low, keeps_high = is_low & (best == codes), ~is_low & (best == next_codes)
            q[keeps_low], next_q[keeps_high] = angles[keeps_low], angles[keeps_high]
        return np.where(_weight(codes) < _weight(next_codes), low, high)

    def _refined(self, psi: Array, guesses: Array) -> tuple[Array, NDArray[np.int64]]:
        guesses = guesses.copy()
        guesses[:, self._held] = psi
        return self._coded(*refine(self._arm.chain, self._held, *self._poses(len(psi)), guesses))

    def _poses(self, count: int) -> tuple[Array, Array]:
        return np.broadcast_to(self._rotation, (count, 3, 3)), np.broadcast_to(self._position, (count, 3))

    def _coded(self, q: Array, good: NDArray[np.bool_]) -> tuple[Array, NDArray[np.int64]]:
        q = self._arm.placed(q)
        beyond = np.asarray(((q <= self._lower) | (q >= self._upper)) @ self._bits, dtype=np.int64)
        return q, np.where(good, beyond + _SINGULAR * (self._closeness(q) >= 1.0), _NO_SOLUTION)


def _weight(codes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Returns the penalty of branches: joints beyond their limits, then singularities; largest without a solution."""
    count = sum((codes >> bit) & 1 for bit in range(8))
    return np.asarray(16 * count + ((codes & _SINGULAR) > 0) + 1000 * ((codes & _NO_SOLUTION) > 0), dtype=np.int64)


def _arc(start: float, end: float, code: int, outside_box: bool) -> Arc:
    joints = tuple(joint + 1 for joint in range(8) if code >> joint & 1)
    reasons: list[Reason] = []
    if code == _NO_SOLUTION:
        reasons.append("reach")
    if joints:
        reasons.append("joint limits")
    if code & _SINGULAR:
        reasons.append("singularity")
    if outside_box:
        reasons.append("safety box")
    return Arc(start=start, end=end, reasons=tuple(reasons), joints=joints, branches=())
