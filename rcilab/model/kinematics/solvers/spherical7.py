"""Solver for 7 axes without offsets, such as the xMatePro: spherical shoulder and wrist, 8 branches per arm angle."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import inf, pi, remainder, tau

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.arm_angle import arm_angle, arm_angle_path
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.model.kinematics.solvers.solver import ARM_ANGLE, Angles, BranchEnd, Envelope, PoseSolver
from rcilab.model.kinematics.solvers.spherical.arcs import feasible_arcs
from rcilab.model.kinematics.solvers.spherical.branch import follow_branch
from rcilab.model.kinematics.solvers.spherical.inverse import ArmGeometry, inverse_seven
from rcilab.model.kinematics.solvers.spherical.inverse_batch import inverse_batch
from rcilab.model.kinematics.solvers.spherical.singularity import find_singularity, singularity_path

_SIDES = ((0.0,), (pi,), (0.0, pi))  # Flips of a joint on its positive side, on its negative side, or near zero.
_FLIPS = [[[list(product(a, b, c)) for c in _SIDES] for b in _SIDES] for a in _SIDES]
_NEAR_ZERO = 0.1  # [rad] Far more than a step in one cycle: a joint bent more than this stays on its side.


class SphericalSeven:
    """7 axes without offsets: 8 branches at every arm angle."""

    redundancy = ARM_ANGLE

    def __init__(self, geometry: ArmGeometry) -> None:
        self.geometry = geometry
        self.envelope = Envelope(
            shoulder=geometry.shoulder, upper=geometry.upper, fore=geometry.fore, hand=geometry.hand
        )

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose, computed on demand."""
        return _SphericalPose(self.geometry, T_base_flange, near)

    def redundancy_angle(self, q: Sequence[float]) -> float:
        """Returns the arm angle, [rad]."""
        return arm_angle(self.geometry.upper, self.geometry.fore, q)

    def redundancy_angle_path(self, q: JointPath) -> Array:
        """Returns the arm angles along a path, [rad]."""
        return arm_angle_path(self.geometry.upper, self.geometry.fore, q)

    def singularity(self, q: Sequence[float]) -> str | None:
        """Returns the description of the singularity at a configuration, or None."""
        return find_singularity(self.geometry, q)

    def singularity_path(self, q: JointPath) -> Array:
        """Returns the closeness to a singularity along a path."""
        return singularity_path(self.geometry, q)

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether the arm counts as singular."""
        return find_singularity(self.geometry, q) is not None

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, 8, 7)."""
        return inverse_batch(self.geometry, T_base_flange, psi)

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path."""
        return follow_branch(self.geometry, rotations, positions, psi, start)

    def solve_near(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those of the previous cycle, [rad]."""
        try:
            branches = inverse_seven(self.geometry, T_base_flange, psi, near, self._near_flips(near))
        except KinematicsError:
            return None
        return closest_branch(branches, near, (1, 3, 5))

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible arm angles, in closed form."""
        return feasible_arcs(self.geometry, T_base_flange, lower, upper, outside_box)

    def _near_flips(self, near: Sequence[float]) -> list[Angles]:
        """Returns the branches that one cycle from `near` can reach: its own, and both sides of a joint near zero."""
        _, offset_2, _, offset_4, _, offset_6, _ = self.geometry.offsets
        _, q2, _, q4, _, q6, _ = near
        return _FLIPS[_side(q2 - offset_2)][_side(q4 - offset_4)][_side(q6 - offset_6)]


class _SphericalPose:
    def __init__(self, arm: ArmGeometry, pose: Pose, near: Sequence[float] | None) -> None:
        self._arm, self._pose, self._near = arm, pose, near

    def branches(self, psi: float) -> list[Angles]:
        return inverse_seven(self._arm, self._pose, psi, self._near)


def closest_branch(branches: list[Angles], near: Sequence[float], bends: tuple[int, ...]) -> list[float]:
    """Returns the branch closest to joint angles, with full turns, [rad].

    Args:
        branches: At least one.
        near: Joint angles, n plain floats, [rad].
        bends: Indices of the joints without full turns, whose difference excludes most branches.
    """
    best = branches[0]
    if len(branches) > 1:
        smallest, near_bends = inf, [near[i] for i in bends]
        for branch in branches:
            if sum([(branch[i] - target) ** 2 for i, target in zip(bends, near_bends, strict=True)]) >= smallest:
                continue
            distance = sum([remainder(angle - target, tau) ** 2 for angle, target in zip(branch, near, strict=True)])
            if distance < smallest:
                smallest, best = distance, branch
    return [target + remainder(angle - target, tau) for angle, target in zip(best, near, strict=True)]


def _side(bend: float) -> int:
    """Returns the index in `_SIDES` of the side of an upright joint."""
    if abs(bend) < _NEAR_ZERO:
        return 2
    return 1 if remainder(bend, tau) < 0.0 else 0
