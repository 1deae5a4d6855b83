"""Solver for a calibrated arm, whose Denavit-Hartenberg table differs a little from one with a closed form.

The closed form solves for a pose of the arm of the table, which is shifted until the calibrated arm reaches the
requested pose: with q = nominal(T'), T' is replaced by forward_nominal(q) * forward(q)^-1 * T. The error falls by the
relative size of the calibration in every round. The redundancy angle keeps its meaning: it is that of the arm of the
table at the same joint angles, as a controller that computes it from the table reports it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import remainder, tau
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.model.kinematics.forward import build_chain, forward, forward_path
from rcilab.model.kinematics.solvers.solver import Angles, BranchEnd, KinematicsSolver, PoseSolver
from rcilab.robots.description import DhRow

_EXACT = 1e-11  # [m], or an element of a rotation: above rounding, below every other tolerance of a pose.
_SAME = 1e-6  # [rad] Solutions that are closer are one.
_ROUNDS = 25  # A calibration of 1 % takes 6; more are needed next to a singularity.


class CalibratedSolver:
    """The inverse of a calibrated arm.

    Args:
        nominal: The solver for the table.
        nominal_dh: The table.
        dh: The calibrated table.
    """

    def __init__(self, nominal: KinematicsSolver, nominal_dh: Sequence[DhRow], dh: Sequence[DhRow]) -> None:
        self._nominal = nominal
        self._nominal_chain, self._chain = build_chain(nominal_dh), build_chain(dh)
        self.redundancy = nominal.redundancy
        self.envelope = nominal.envelope

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose."""
        return _CalibratedPose(self, T_base_flange, self._nominal.at(T_base_flange, near), near)

    def redundancy_angle(self, q: Sequence[float]) -> float:
        """Returns the redundancy angle of the table's arm, [rad]."""
        return self._nominal.redundancy_angle(q)

    def redundancy_angle_path(self, q: JointPath) -> Array:
        """Returns the redundancy angles of the table's arm, [rad]."""
        return self._nominal.redundancy_angle_path(q)

    def singularity(self, q: Sequence[float]) -> str | None:
        """Returns the description of the singularity of the table's arm at a configuration, or None."""
        return self._nominal.singularity(q)

    def singularity_path(self, q: JointPath) -> Array:
        """Returns the closeness of N configurations to a singularity of the table's arm, shape (N,)."""
        return self._nominal.singularity_path(q)

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether a configuration of the table's arm counts as singular."""
        return self._nominal.is_singular(q)

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, branches, n), [rad]; NaN without a solution."""
        found = self._nominal.batch(T_base_flange, psi)
        for branch in range(found.shape[1]):
            q = found[:, branch]
            for _ in range(_ROUNDS):
                shifted, is_off = self._shifted(q, T_base_flange)
                if not is_off.any():
                    break
                # Rows without a solution stay NaN; the closed form is given their requested pose.
                known = np.isfinite(shifted).reshape(len(shifted), -1).all(axis=1)
                q = self._nominal.batch(np.where(known.reshape(-1, 1, 1), shifted, T_base_flange), psi)[:, branch]
                q[~known] = np.nan
            _, is_off = self._shifted(q, T_base_flange)
            q[is_off] = np.nan
            found[:, branch] = q
        return found

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path of the flange on one branch; see `KinematicsSolver.follow`."""
        T = np.tile(np.eye(4), (len(positions), 1, 1))
        T[:, :3, :3], T[:, :3, 3] = rotations, positions
        q, end = self._nominal.follow(rotations, positions, psi, start)
        for _ in range(_ROUNDS):
            valid = len(q) if end is None else end.row
            shifted, is_off = self._shifted(q[:valid], T[:valid])
            if not is_off.any():
                break
            rotations, positions = rotations.copy(), positions.copy()
            rotations[:valid], positions[:valid] = shifted[:, :3, :3], shifted[:, :3, 3]
            q, end = self._nominal.follow(rotations, positions, psi, start)
        return q, end

    def solve_near(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those of the previous cycle, [rad], or None."""
        q = list(near)
        error = forward(self._chain, q).inverse() @ T_base_flange
        for _ in range(_ROUNDS):
            found = self._nominal.solve_near(forward(self._nominal_chain, q) @ error, psi, q)
            if found is None:
                return None
            q = found
            error = forward(self._chain, q).inverse() @ T_base_flange
            if error.is_close(_IDENTITY, _EXACT):
                return q
        return None

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible redundancy angles of the table's arm; their ends are off by the calibration."""
        return self._nominal.arcs(T_base_flange, lower, upper, outside_box)

    def _shifted(self, q: JointPath, T: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Returns the poses for the next round, shape (N, 4, 4), and whether each row is off its pose, shape (N,)."""
        error = np.linalg.inv(forward_path(self._chain, q)) @ T
        is_off: Any = np.abs(error - np.eye(4)).max(axis=(1, 2)) > _EXACT
        return forward_path(self._nominal_chain, q) @ error, is_off


class _CalibratedPose:
    """The inverse of a calibrated arm at one pose."""

    def __init__(
        self, solver: CalibratedSolver, T_base_flange: Pose, nominal: PoseSolver, near: Sequence[float] | None
    ) -> None:
        self._solver, self._T, self._nominal, self._near = solver, T_base_flange, nominal, near

    def branches(self, psi: float) -> list[Angles]:
        """Returns every solution at a redundancy angle, [rad]."""
        starts = self._nominal.branches(psi)
        if self._near is not None:  # Next to a singularity its branch may begin at another one of the table's arm.
            starts.append(tuple(self._near))
        found: list[Angles] = []
        for start in starts:
            q = self._solver.solve_near(self._T, psi, start)
            if q is not None and all(_distance(q, other) > _SAME for other in found):
                found.append(tuple(q))
        return found


def _distance(q: Sequence[float], other: Sequence[float]) -> float:
    """Returns the largest difference of two configurations, without full turns, [rad]."""
    return max(abs(remainder(a - b, tau)) for a, b in zip(q, other, strict=True))


_IDENTITY = Pose()
