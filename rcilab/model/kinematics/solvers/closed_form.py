"""What solvers in closed form without redundancy share: every solution from one function, for one pose or many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.newton import refine_near
from rcilab.model.kinematics.solvers.numeric.search import NumericArm
from rcilab.model.kinematics.solvers.numeric.solver import NumericSolver, require_reach
from rcilab.model.kinematics.solvers.solver import Angles, Envelope, PoseSolver
from rcilab.robots.description import RobotDescription


class SolvePoses(Protocol):
    """Returns solutions at many poses, also outside the joint limits; some may be double."""

    def __call__(
        self, rotations: Array, positions: Array, near: Sequence[float] | None = None
    ) -> tuple[NDArray[np.intp], Array]:
        """Returns which pose each solution belongs to, shape (R,), and the solutions, shape (R, n), [rad].

        Args:
            rotations: Flange in base, shape (N, 3, 3).
            positions: Flange in base, shape (N, 3), [m].
            near: Joint angles, [rad], of which joints are taken where any angle is a solution; None: zeros.
        """
        ...


class ClosedForm(NumericSolver):
    """The numeric solver with every solution in closed form instead of a search.

    Args:
        description: The arm.
        envelope: Its lengths.
        solve_poses: Its inverse.
    """

    def __init__(self, description: RobotDescription, envelope: Envelope, solve_poses: SolvePoses) -> None:
        super().__init__(description)
        self.envelope = envelope
        self._solve_poses = solve_poses

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose, computed on demand."""
        return _ClosedPose(self._arm, self._solve_poses, self.envelope, T_base_flange, near)

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, M, n), M from the pose with the most."""
        rows, q = self._solve_poses(T_base_flange[:, :3, :3], T_base_flange[:, :3, 3])
        found = [self._arm.distinct(q[rows == row]) for row in range(len(T_base_flange))]
        table = np.full((len(found), max(1, *map(len, found)), self._arm.n), np.nan)
        for row, branches in enumerate(found):
            if branches:
                table[row, : len(branches)] = branches
        return table


class _ClosedPose:
    def __init__(
        self, arm: NumericArm, solve_poses: SolvePoses, envelope: Envelope, pose: Pose, near: Sequence[float] | None
    ) -> None:
        self._arm, self._solve_poses, self._envelope, self._pose, self._near = arm, solve_poses, envelope, pose, near

    def branches(self, psi: float) -> list[Angles]:
        require_reach(self._envelope, self._pose)
        rotation, position = self._pose.rotation, self._pose.position
        _, q = self._solve_poses(rotation[None], position[None], self._near)
        if self._near is not None:  # Where two solutions are about to meet, rounding may hide both.
            adjacent = refine_near(self._arm.chain, None, rotation, position, psi, self._near)
            q = q if adjacent is None else np.concatenate((np.array(adjacent)[None], q))
        return self._arm.distinct(q)
