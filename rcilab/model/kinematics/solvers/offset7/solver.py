"""Solver for 7 axes with offsets at elbow and wrist, such as Panda and xArm7; the redundancy is joint 3."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, remainder, tau

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.model.kinematics.solvers.newton import refine_near
from rcilab.model.kinematics.solvers.newton_path import follow_by_newton
from rcilab.model.kinematics.solvers.offset7.arcs import feasible_offset_arcs
from rcilab.model.kinematics.solvers.offset7.arm import ELBOW, OffsetGeometry
from rcilab.model.kinematics.solvers.offset7.inverse import inverse_held, inverse_held_batch
from rcilab.model.kinematics.solvers.offset7.singularity import held_singularity, held_singularity_path
from rcilab.model.kinematics.solvers.solver import Angles, BranchEnd, Envelope, PoseSolver, Redundancy


class OffsetSeven:
    """7 axes with offsets at elbow and wrist, such as the Panda; the arm angle is the angle of joint 3."""

    redundancy = Redundancy("joint", ELBOW + 1)

    def __init__(self, geometry: OffsetGeometry) -> None:
        self.geometry = geometry
        self.envelope = Envelope(
            shoulder=geometry.shoulder,
            upper=hypot(geometry.upper, geometry.elbow),
            fore=hypot(geometry.fore, geometry.bend) + abs(geometry.wrist),
            hand=geometry.hand,
        )

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose, computed on demand."""
        return _OffsetPose(self.geometry, T_base_flange, near)

    def redundancy_angle(self, q: Sequence[float]) -> float:
        """Returns the angle of joint 3, [rad]."""
        return remainder(q[ELBOW], tau)

    def redundancy_angle_path(self, q: JointPath) -> Array:
        """Returns the angles of joint 3, [rad], not wrapped."""
        return q[:, ELBOW]

    def singularity(self, q: Sequence[float]) -> str | None:
        """Returns the description of the singularity at a configuration, or None."""
        return "with joint 3 held, the other joints are singular" if self.is_singular(q) else None

    def singularity_path(self, q: JointPath) -> Array:
        """Returns the closeness to a singularity with joint 3 held, along a path."""
        return held_singularity_path(self.geometry, q)

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether the arm counts as singular."""
        return held_singularity(self.geometry, q) >= 1.0

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, M, 7)."""
        return inverse_held_batch(self.geometry, T_base_flange, np.broadcast_to(psi, (len(T_base_flange),)))

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path."""
        angles = np.full(len(positions), start[ELBOW]) if psi is None else psi + _turns(start[ELBOW], psi[0])

        def solve(pose: Pose, angle: float) -> list[Angles]:
            return inverse_held(self.geometry, pose, angle, None)

        return follow_by_newton(self.geometry.chain, ELBOW, solve, rotations, positions, angles, start)

    def solve_near(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those of the previous cycle, [rad]."""
        psi += _turns(near[ELBOW], psi)
        return refine_near(self.geometry.chain, ELBOW, T_base_flange.rotation, T_base_flange.position, psi, near)

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible arm angles, found along the self-motion."""
        return feasible_offset_arcs(self.geometry, T_base_flange, lower, upper, outside_box)


class _OffsetPose:
    def __init__(self, arm: OffsetGeometry, pose: Pose, near: Sequence[float] | None) -> None:
        self._arm, self._pose, self._near = arm, pose, near

    def branches(self, psi: float) -> list[Angles]:
        return inverse_held(self._arm, self._pose, psi, self._near)


def _turns(angle: float, psi: float) -> float:
    """Returns the full turns, [rad], that bring psi within half a turn of an angle of joint 3."""
    return tau * round((angle - psi) / tau)
