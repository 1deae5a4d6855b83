"""The inverse of an arm, whatever its build: what the rest of the package asks for, and the three builds there are."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import hypot, remainder, tau
from typing import Protocol

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.arm_angle import arm_angle, arm_angle_path
from rcilab.model.kinematics.branch import BranchEnd, follow_branch
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs, feasible_arcs
from rcilab.model.kinematics.ik_fixed_elbow import inverse_held, inverse_held_batch
from rcilab.model.kinematics.inverse import Angles, ArmGeometry, build_geometry, inverse_seven, inverse_six
from rcilab.model.kinematics.inverse_batch import inverse_batch
from rcilab.model.kinematics.singularity import find_singularity, singularity_path
from rcilab.model.kinematics.solvers.offset7.arcs import feasible_offset_arcs
from rcilab.model.kinematics.solvers.offset7.arm import ELBOW, OffsetGeometry, build_offset_geometry
from rcilab.model.kinematics.solvers.offset7.branch import follow_offset_branch
from rcilab.model.kinematics.solvers.offset7.settle import settle_beside
from rcilab.model.kinematics.solvers.offset7.singularity import held_singularity, held_singularity_path
from rcilab.robots.description import RobotDescription


class PoseInverse(Protocol):
    """The joint angles for one pose."""

    def branches(self, psi: float) -> list[Angles]:
        """Returns every solution at an arm angle, [rad], without regard to joint limits."""
        ...


class ClosedForm(Protocol):
    """The inverse of one arm, from poses of its flange."""

    @property
    def envelope(self) -> ArmGeometry:
        """Lengths of an arm without offsets that reaches as far."""
        ...

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseInverse:
        """Returns the inverse at a pose; `near` decides what a singular pose leaves open.

        Raises:
            UnreachableError: The pose is out of reach at every arm angle.
        """
        ...

    def arm_angle(self, q: Sequence[float]) -> float:
        """Returns the arm angle, [rad] in (-pi, pi].

        Raises:
            SingularError: It has no meaning there.
            KinematicsError: The arm has none.
        """
        ...

    def arm_angle_path(self, q: JointPath) -> Array:
        """Returns the arm angles of N configurations, shape (N,), [rad]; any number where they have no meaning.

        Raises:
            KinematicsError: The arm has none.
        """
        ...

    def singularity_path(self, q: JointPath) -> Array:
        """Returns how near N configurations are to a singularity, shape (N,): from 1 on they count as at one."""
        ...

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether a configuration counts as at a singularity; `singularity_path` for one, in plain floats."""
        ...

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, branches, n), [rad]; not a number where there are none."""
        ...

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path, as `follow_branch` does."""
        ...

    def beside(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those before, [rad], or None where there are none.

        Joint limits are not looked at; full turns are counted.

        Args:
            T_base_flange: Pose of the flange.
            psi: Arm angle, [rad]; of no meaning for 6 axes.
            near: Joint angles of the cycle before, n plain floats, [rad].
        """
        ...

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible arm angles of a pose, as `feasible_arcs` does."""
        ...


@lru_cache(maxsize=16)
def build_closed_form(description: RobotDescription) -> ClosedForm:
    """Returns the inverse for the build of an arm.

    Raises:
        ModelError: There is none for its Denavit-Hartenberg table.
    """
    if any(row.a for row in description.dh) and len(description.dh) == 7:
        return OffsetSeven(build_offset_geometry(description))
    geometry = build_geometry(description)
    return SphericalSeven(geometry) if geometry.n == 7 else SphericalSix(geometry)


class SphericalSeven:
    """7 axes without offsets: 8 branches at every arm angle."""

    def __init__(self, geometry: ArmGeometry) -> None:
        self.envelope = geometry

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseInverse:
        """Returns the inverse at a pose, which is not looked at yet."""
        return _SphericalPose(self.envelope, T_base_flange, near)

    def arm_angle(self, q: Sequence[float]) -> float:
        """Returns where the elbow is on its circle, [rad]."""
        return arm_angle(self.envelope.upper, self.envelope.fore, q)

    def arm_angle_path(self, q: JointPath) -> Array:
        """Returns where the elbow is on its circle along a path, [rad]."""
        return arm_angle_path(self.envelope.upper, self.envelope.fore, q)

    def singularity_path(self, q: JointPath) -> Array:
        """Returns how near the arm is to a singularity along a path."""
        return singularity_path(self.envelope, q)

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether the arm counts as at a singularity."""
        return find_singularity(self.envelope, q) is not None

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, 8, 7)."""
        return inverse_batch(self.envelope, T_base_flange, psi)

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path."""
        return follow_branch(self.envelope, rotations, positions, psi, start)

    def beside(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those before, [rad]."""
        try:
            branches = self.at(T_base_flange, near).branches(psi)
        except KinematicsError:
            return None
        if not branches:
            return None
        turns = [[remainder(a - b, tau) for a, b in zip(branch, near, strict=True)] for branch in branches]
        least = min(turns, key=lambda turn: sum([angle * angle for angle in turn]))
        return [angle + turn for angle, turn in zip(near, least, strict=True)]

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible arm angles, in closed form."""
        return feasible_arcs(self.envelope, T_base_flange, lower, upper, outside_box)


class SphericalSix(SphericalSeven):
    """6 axes with a spherical wrist: 8 branches, and no arm angle, whatever `psi` says."""

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseInverse:
        """Returns the inverse at a pose, which is not looked at yet."""
        return _SixAxisPose(self.envelope, T_base_flange, near)

    def arm_angle(self, q: Sequence[float]) -> float:
        """Raises KinematicsError: there is none."""
        raise KinematicsError("an arm with 6 axes has no arm angle").coded("no_psi")

    def arm_angle_path(self, q: JointPath) -> Array:
        """Raises KinematicsError: there are none."""
        raise KinematicsError("an arm with 6 axes has no arm angle").coded("no_psi")

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Raises KinematicsError: there are none."""
        raise KinematicsError("an arm with 6 axes has no arm angle").coded("no_psi")


class OffsetSeven:
    """7 axes with offsets at elbow and wrist, as the Panda; the arm angle is joint 3's, as its maker counts it."""

    def __init__(self, geometry: OffsetGeometry) -> None:
        self.geometry = geometry
        self.envelope = ArmGeometry(
            n=7,
            shoulder=geometry.shoulder,
            upper=hypot(geometry.upper, geometry.elbow),
            fore=hypot(geometry.fore, geometry.elbow) + geometry.wrist,
            hand=geometry.hand,
            offsets=(0.0,) * 7,
        )

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseInverse:
        """Returns the inverse at a pose, which is not looked at yet."""
        return _OffsetPose(self.geometry, T_base_flange, near)

    def arm_angle(self, q: Sequence[float]) -> float:
        """Returns the angle of joint 3, [rad]."""
        return remainder(q[ELBOW], tau)

    def arm_angle_path(self, q: JointPath) -> Array:
        """Returns the angles of joint 3, [rad], as they are: this joint makes no whole turn."""
        return q[:, ELBOW]

    def singularity_path(self, q: JointPath) -> Array:
        """Returns how near the arm is along a path to where joint 3, held, no longer decides the other joints."""
        return held_singularity_path(self.geometry, q)

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether the arm counts as there."""
        return held_singularity(self.geometry, q) >= 1.0

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, M, 7)."""
        return inverse_held_batch(self.geometry, T_base_flange, np.broadcast_to(psi, (len(T_base_flange),)))

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path."""
        angles = np.full(len(positions), start[ELBOW]) if psi is None else psi
        return follow_offset_branch(self.geometry, rotations, positions, angles, start)

    def beside(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those before, [rad]."""
        return settle_beside(self.geometry, T_base_flange.rotation, T_base_flange.position, psi, near)

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible arm angles, found along the self-motion."""
        return feasible_offset_arcs(self.geometry, T_base_flange, lower, upper, outside_box)


class _SphericalPose:
    def __init__(self, arm: ArmGeometry, pose: Pose, near: Sequence[float] | None) -> None:
        self._arm, self._pose, self._near = arm, pose, near

    def branches(self, psi: float) -> list[Angles]:
        return inverse_seven(self._arm, self._pose, psi, self._near)


class _SixAxisPose(_SphericalPose):
    def branches(self, psi: float) -> list[Angles]:
        del psi  # The arm has none.
        return inverse_six(self._arm, self._pose, self._near)


class _OffsetPose:
    def __init__(self, arm: OffsetGeometry, pose: Pose, near: Sequence[float] | None) -> None:
        self._arm, self._pose, self._near = arm, pose, near

    def branches(self, psi: float) -> list[Angles]:
        return inverse_held(self._arm, self._pose, psi, self._near)
