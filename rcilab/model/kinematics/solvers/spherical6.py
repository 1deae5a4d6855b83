"""Solver for 6 axes with a spherical wrist, such as the xMate: 8 branches and no redundancy."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.core.arrays import Array, JointPath
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.model.kinematics.solvers.solver import NO_REDUNDANCY, Angles, PoseSolver
from rcilab.model.kinematics.solvers.spherical.inverse import ArmGeometry, inverse_six
from rcilab.model.kinematics.solvers.spherical7 import SphericalSeven, closest_branch


class SphericalSix(SphericalSeven):
    """6 axes with a spherical wrist: 8 branches and no arm angle; `psi` has no effect."""

    redundancy = NO_REDUNDANCY

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose, computed on demand."""
        return _SixAxisPose(self.geometry, T_base_flange, near)

    def solve_near(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those of the previous cycle, [rad]."""
        try:
            return closest_branch(inverse_six(self.geometry, T_base_flange, near), near, (2, 4))
        except KinematicsError:
            return None

    def redundancy_angle(self, q: Sequence[float]) -> float:
        """Raises KinematicsError: the arm has no arm angle."""
        raise KinematicsError("an arm with 6 axes has no arm angle").coded("no_psi")

    def redundancy_angle_path(self, q: JointPath) -> Array:
        """Raises KinematicsError: the arm has no arm angle."""
        raise KinematicsError("an arm with 6 axes has no arm angle").coded("no_psi")

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Raises KinematicsError: the arm has no arm angle."""
        raise KinematicsError("an arm with 6 axes has no arm angle").coded("no_psi")


class _SixAxisPose:
    def __init__(self, arm: ArmGeometry, pose: Pose, near: Sequence[float] | None) -> None:
        self._arm, self._pose, self._near = arm, pose, near

    def branches(self, psi: float) -> list[Angles]:
        del psi  # The arm has none.
        return inverse_six(self._arm, self._pose, self._near)
