"""Solver for 6 axes with parallel axes 2 and 3 and an offset wrist, such as the xArm6: up to 16 branches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.newton import refine_near
from rcilab.model.kinematics.solvers.numeric.search import NumericArm
from rcilab.model.kinematics.solvers.numeric.solver import NumericSolver, require_reach
from rcilab.model.kinematics.solvers.offset6.arm import OffsetSixGeometry
from rcilab.model.kinematics.solvers.offset6.inverse import solve_poses
from rcilab.model.kinematics.solvers.solver import Angles, Envelope, PoseSolver
from rcilab.robots.description import RobotDescription


class OffsetSix(NumericSolver):
    """The numeric solver with every solution in closed form instead of a search."""

    def __init__(self, description: RobotDescription, geometry: OffsetSixGeometry) -> None:
        super().__init__(description)
        self.geometry = geometry
        self.envelope = Envelope(
            shoulder=geometry.shoulder,
            upper=geometry.upper,
            fore=geometry.fore + abs(geometry.wrist),
            hand=geometry.hand,
        )

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose, computed on demand."""
        return _OffsetSixPose(self._arm, self.geometry, self.envelope, T_base_flange, near)

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, M, 6), M from the pose with the most."""
        rows, q = solve_poses(self.geometry, T_base_flange[:, :3, :3], T_base_flange[:, :3, 3])
        found = [self._arm.distinct(q[rows == row]) for row in range(len(T_base_flange))]
        table = np.full((len(found), max(1, *map(len, found)), 6), np.nan)
        for row, branches in enumerate(found):
            if branches:
                table[row, : len(branches)] = branches
        return table


class _OffsetSixPose:
    def __init__(
        self,
        arm: NumericArm,
        geometry: OffsetSixGeometry,
        envelope: Envelope,
        pose: Pose,
        near: Sequence[float] | None,
    ) -> None:
        self._arm, self._geometry, self._envelope, self._pose, self._near = arm, geometry, envelope, pose, near

    def branches(self, psi: float) -> list[Angles]:
        require_reach(self._envelope, self._pose)
        rotation, position = self._pose.rotation, self._pose.position
        _, q = solve_poses(self._geometry, rotation[None], position[None], self._near)
        if self._near is not None:  # Where two solutions are about to meet, rounding may hide both.
            adjacent = refine_near(self._arm.chain, None, rotation, position, psi, self._near)
            q = q if adjacent is None else np.concatenate((np.array(adjacent)[None], q))
        return self._arm.distinct(q)
