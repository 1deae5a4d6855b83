"""The protocol of inverse kinematics that every solver implements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs

Angles: TypeAlias = tuple[float, ...]

REACH_TOLERANCE = 1e-9  # [m] A pose out of reach by less, because of rounding, counts as at the limit of reach.


_FAR = 10.0  # [m] A target farther away is probably one in mm.


def describe_excess(distance: float) -> str:
    """Returns by how much a pose is out of reach, for its error; `distance` in [m]."""
    return f"{1e3 * distance:.1f} mm" if distance >= 5e-5 else "less than 0.1 mm"


def unit_hint(distance: float) -> str:
    """Returns what to add to the error of a pose that is out of reach by a distance, [m]."""
    return "; positions are in m" if distance > _FAR else ""


@dataclass(frozen=True, slots=True)
class Redundancy:
    """The redundancy of an arm at a pose of the flange; it defines the redundancy angle `psi`."""

    kind: Literal["none", "arm_angle", "joint"]
    """"arm_angle": the elbow's angle on its circle around the shoulder-wrist line; "joint": the angle of one joint."""
    joint: int | None = None
    """Number of the joint, from 1; None unless the kind is "joint"."""

    def __bool__(self) -> bool:
        return self.kind != "none"


NO_REDUNDANCY = Redundancy("none")
ARM_ANGLE = Redundancy("arm_angle")


@dataclass(frozen=True, slots=True, kw_only=True)
class Envelope:
    """Lengths of an arm without offsets and with the same reach, [m]."""

    shoulder: float
    """Height of the shoulder above the base."""
    upper: float
    """Shoulder to elbow."""
    fore: float
    """Elbow to wrist centre."""
    hand: float
    """Wrist centre to flange."""


@dataclass(frozen=True, slots=True)
class BranchEnd:
    """The first row of a path at which its branch ends."""

    row: int
    reason: KinematicsError
    """The reason: out of reach, or singular."""


class PoseSolver(Protocol):
    """The joint angles for one pose."""

    def branches(self, psi: float) -> list[Angles]:
        """Returns every solution at a redundancy angle, [rad], also outside the joint limits.

        Raises:
            UnreachableError: The pose is out of reach at every redundancy angle.
        """
        ...


class KinematicsSolver(Protocol):
    """The inverse of one arm, from poses of its flange. Without redundancy, `psi` has no effect."""

    @property
    def redundancy(self) -> Redundancy:
        """The redundancy of the arm."""
        ...

    @property
    def envelope(self) -> Envelope:
        """Lengths of an arm without offsets with the same reach."""
        ...

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose; `near` resolves the ambiguity of a singular pose.

        Raises:
            UnreachableError: The pose is out of reach at every redundancy angle.
        """
        ...

    def redundancy_angle(self, q: Sequence[float]) -> float:
        """Returns the redundancy angle, [rad] in (-pi, pi].

        Raises:
            SingularError: It has no meaning at these joint angles.
            KinematicsError: The arm has no redundancy.
        """
        ...

    def redundancy_angle_path(self, q: JointPath) -> Array:
        """Returns the redundancy angles of N configurations, shape (N,), [rad]; arbitrary where they have no meaning.

        Raises:
            KinematicsError: The arm has no redundancy.
        """
        ...

    def singularity(self, q: Sequence[float]) -> str | None:
        """Returns the description of the singularity at a configuration, or None."""
        ...

    def singularity_path(self, q: JointPath) -> Array:
        """Returns the closeness of N configurations to a singularity, shape (N,); 1 and above counts as singular."""
        ...

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether a configuration counts as singular; `singularity_path` for one, in plain floats."""
        ...

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, branches, n), [rad]; NaN without a solution."""
        ...

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path of the flange on one branch; joint limits are not checked.

        Args:
            rotations: Flange in base, shape (N, 3, 3).
            positions: Flange in base, shape (N, 3), [m].
            psi: Redundancy angles, shape (N,), [rad]; None without redundancy.
            start: Joint angles at row 0, shape (n,), [rad]; they select the branch.

        Returns:
            Joint angles, shape (N, n), [rad], and the first row without a solution, or None. From that row on the
            angles have no meaning.
        """
        ...

    def solve_near(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those of the previous cycle, [rad], or None.

        Joint limits are not checked; full turns of `near` are kept.

        Args:
            T_base_flange: Pose of the flange.
            psi: Redundancy angle, [rad].
            near: Joint angles of the previous cycle, n plain floats, [rad].
        """
        ...

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible redundancy angles of a pose.

        Raises:
            UnreachableError: The pose is out of reach at every redundancy angle.
            KinematicsError: The arm has no redundancy.
        """
        ...
