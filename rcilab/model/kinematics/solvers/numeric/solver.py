"""Iterative solver for serial arms of up to 7 joints without closed form."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, remainder, tau

import numpy as np

from rcilab.core.arrays import Array, JointPath, JointVector
from rcilab.core.errors import KinematicsError, ModelError, UnreachableError
from rcilab.core.spatial import IDENTITY, Pose
from rcilab.model.kinematics.differential import jacobian_path, moving_frame
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.model.kinematics.forward import build_chain
from rcilab.model.kinematics.jacobian import tool_jacobian
from rcilab.model.kinematics.solvers.newton import free_joints, refine_near
from rcilab.model.kinematics.solvers.newton_path import follow_by_newton
from rcilab.model.kinematics.solvers.numeric.arcs import numeric_arcs
from rcilab.model.kinematics.solvers.numeric.search import NumericArm, search
from rcilab.model.kinematics.solvers.solver import (
    NO_REDUNDANCY,
    REACH_TOLERANCE,
    Angles,
    BranchEnd,
    Envelope,
    PoseSolver,
    Redundancy,
    describe_excess,
    unit_hint,
)
from rcilab.robots.description import RobotDescription

SINGULAR = 0.01
"""Smallest singular value of the Jacobian, lengths as shares of the reach, below which an arm counts as singular.
Tuning value: typical poses have 0.1 to 0.3."""

_HELD = 2  # Index of the held joint of a 7-axis arm: the roll of the upper arm, as at Franka.
_SEEDS, _ATTEMPTS = 48, 3  # Starts per attempt, and attempts until a solution is inside the limits.
_BATCH_SEEDS, _BLOCK = 16, 128  # Starts per pose, and poses computed together, so that arrays fit into the cache.


class NumericSolver:
    """Damped least squares from many starts, then Newton's method: solutions are exact, but some may be missing.

    A 7-axis arm is solved with joint 3 held at the redundancy angle.

    Args:
        description: The arm.

    Raises:
        ModelError: The arm has more than 7 joints.
    """

    def __init__(self, description: RobotDescription) -> None:
        dh, joint = description.dh, description.limits.joint
        n = len(dh)
        if n > 7:
            raise ModelError(f"{description.name}: no inverse for {n} joints; the numeric solver supports up to 7")
        self._held = _HELD if n == 7 else None
        self.redundancy = NO_REDUNDANCY if self._held is None else Redundancy("joint", _HELD + 1)
        half = 0.5 * (abs(dh[0].a) + sum(hypot(row.a, row.d) for row in dh[1:-1]) + abs(dh[-1].a))
        self.envelope = Envelope(shoulder=dh[0].d, upper=half, fore=half, hand=dh[-1].d)
        self._arm = NumericArm(build_chain(dh), self._held, joint.lower, joint.upper, 2.0 * half)
        self._free = free_joints(self._arm.chain, self._held)
        self._scale = np.array((1.0 / self._arm.reach,) * 3 + (1.0,) * 3)

    def at(self, T_base_flange: Pose, near: Sequence[float] | None) -> PoseSolver:
        """Returns the inverse at a pose, computed on demand."""
        return _NumericPose(self._arm, self.envelope, T_base_flange, near)

    def redundancy_angle(self, q: Sequence[float]) -> float:
        """Returns the angle of the held joint, [rad]."""
        return remainder(q[self._require_held_joint()], tau)

    def redundancy_angle_path(self, q: JointPath) -> Array:
        """Returns the angles of the held joint, [rad]."""
        return q[:, self._require_held_joint()]

    def singularity(self, q: Sequence[float]) -> str | None:
        """Returns the description of the singularity at a configuration, or None."""
        return "the arm loses a direction of motion" if self.is_singular(q) else None

    def singularity_path(self, q: JointPath) -> Array:
        """Returns the closeness to a singularity along a path, with the redundant joint held."""
        J = jacobian_path(moving_frame(self._arm.chain, q, len(self._arm.chain), IDENTITY))
        values = np.linalg.svd(J[:, :, self._free] * self._scale[:, None], compute_uv=False)
        with np.errstate(divide="ignore"):
            return np.asarray(SINGULAR / values[:, -1], dtype=np.float64)

    def is_singular(self, q: Sequence[float]) -> bool:
        """Returns whether the arm counts as singular."""
        J = tool_jacobian(self._arm.chain, q)[0][:, self._free] * self._scale[:, None]
        return float(np.linalg.svd(J, compute_uv=False)[-1]) <= SINGULAR

    def batch(self, T_base_flange: Array, psi: Array) -> Array:
        """Returns the solutions at N poses, shape (N, M, n), M from the pose with the most."""
        arm, count = self._arm, len(T_base_flange)
        angles = np.broadcast_to(psi, (count,))
        found: list[list[Angles]] = []
        seeds = arm.seeds(_BATCH_SEEDS)
        for start in range(0, count, _BLOCK):
            T = np.repeat(T_base_flange[start : start + _BLOCK], len(seeds), axis=0)
            guesses = np.tile(seeds, (len(T) // len(seeds), 1))
            if self._held is not None:
                guesses[:, self._held] = np.repeat(angles[start : start + _BLOCK], len(seeds))
            q, good = search(arm, T[:, :3, :3], T[:, :3, 3], guesses)
            rows = zip(q.reshape(-1, len(seeds), arm.n), good.reshape(-1, len(seeds)), strict=True)
            found += [arm.distinct(row[is_good]) for row, is_good in rows]
        table = np.full((count, max(1, *map(len, found)), arm.n), np.nan)
        for row, branches in enumerate(found):
            if branches:
                table[row, : len(branches)] = branches
        return table

    def follow(
        self, rotations: Array, positions: Array, psi: Array | None, start: JointVector
    ) -> tuple[JointPath, BranchEnd | None]:
        """Returns the joint angles along a path."""
        held = self._held
        angles = psi if psi is not None else np.full(len(positions), 0.0 if held is None else start[held])

        def solve(pose: Pose, angle: float) -> list[Angles]:
            return self.at(pose, None).branches(angle)

        return follow_by_newton(self._arm.chain, held, solve, rotations, positions, angles, start)

    def solve_near(self, T_base_flange: Pose, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose closest to those of the previous cycle, [rad]."""
        rotation, position = T_base_flange.rotation, T_base_flange.position
        return refine_near(self._arm.chain, self._held, rotation, position, psi, near)

    def arcs(self, T_base_flange: Pose, lower: Array, upper: Array, outside_box: bool) -> FeasibleArcs:
        """Returns the feasible redundancy angles, found on a grid."""
        self._require_held_joint()
        require_reach(self.envelope, T_base_flange)
        return numeric_arcs(self._arm, self.singularity_path, T_base_flange, lower, upper, outside_box)

    def _require_held_joint(self) -> int:
        if self._held is None:
            raise KinematicsError(f"an arm with {self._arm.n} axes has no arm angle").coded("no_psi")
        return self._held


class _NumericPose:
    def __init__(self, arm: NumericArm, envelope: Envelope, pose: Pose, near: Sequence[float] | None) -> None:
        self._arm, self._envelope, self._pose, self._near = arm, envelope, pose, near

    def branches(self, psi: float) -> list[Angles]:
        arm, pose = self._arm, self._pose
        require_reach(self._envelope, pose)
        found: list[Angles] = []
        for attempt in range(_ATTEMPTS):
            seeds = arm.seeds(_SEEDS, attempt)
            if self._near is not None and not attempt:
                seeds = np.concatenate((np.array(self._near)[None], seeds))
            if arm.held is not None:
                seeds[:, arm.held] = psi
            count = len(seeds)
            rotations = np.broadcast_to(pose.rotation, (count, 3, 3))
            q, good = search(arm, rotations, np.broadcast_to(pose.position, (count, 3)), seeds)
            found = arm.distinct(np.concatenate((np.array(found).reshape(-1, arm.n), q[good])))
            if any(arm.is_inside(branch) for branch in found):
                break
        return found


def require_reach(envelope: Envelope, pose: Pose) -> None:
    """Requires a wrist centre within the length of the stretched links from the shoulder.

    Raises:
        UnreachableError: It is farther.
    """
    r, (x, y, z) = pose.parts
    hand, max_length = envelope.hand, envelope.upper + envelope.fore
    length = hypot(x - hand * r[2], y - hand * r[5], z - hand * r[8] - envelope.shoulder)
    if length > max_length + REACH_TOLERANCE:
        raise UnreachableError(
            f"out of reach by {describe_excess(length - max_length)}: the wrist centre would be {length:.3f} m from "
            f"the shoulder, the arm reaches {max_length:.3f} m at most; move the target closer{unit_hint(length)}",
            distance=length - max_length,
        ).coded("too_far", distance=length - max_length)
