"""Inverse kinematics of an arm with its tool."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import MAX_ANGLE, as_number, as_vector, described
from rcilab.core.errors import InvalidValueError, KinematicsError
from rcilab.core.safety_box import SafetyBox, active_box
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.closest_pose import ClosestPose, closest_reachable
from rcilab.model.kinematics.elbow_circle import ElbowCircle, elbow_circle
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.model.kinematics.inverse_search import InverseSearch
from rcilab.model.kinematics.moving_arm import MovingArm
from rcilab.model.kinematics.solution_batch import SolutionBatch, as_pose_batch
from rcilab.model.kinematics.solutions import Solutions
from rcilab.model.kinematics.solvers.solver import KinematicsSolver, Redundancy
from rcilab.robots.description import RobotDescription


class ReachingArm(MovingArm):
    """The geometry and the joint limits of an arm with its tool. Immutable.

    Args:
        description: The arm.
        T_flange_tool: Pose of the tool in the flange frame.
        T_tool_stiffness: Pose of the stiffness frame in the tool frame.

    Raises:
        InvalidValueError: A pose is not valid.
    """

    def __init__(self, description: RobotDescription, T_flange_tool: Pose, T_tool_stiffness: Pose) -> None:
        super().__init__(description.dh, T_flange_tool, T_tool_stiffness)
        self.description = description
        self._T_tool_flange = self.T_flange_tool.inverse()

    @property
    def redundancy(self) -> Redundancy:
        """The redundancy at a pose of the tool: none (false), the arm angle, or the angle of a joint."""
        return self.solver.redundancy

    @property
    def solver(self) -> KinematicsSolver:
        """The inverse of the arm without its tool and joint limits."""
        return self._search.solver

    def inverse(self, T: Pose | ArrayLike, psi: float | None = None, near: ArrayLike | None = None) -> Solutions:
        """Returns every solution inside the joint limits (GetJointPos); `.nearest(q)` is the vendor's answer.

        The xMates have 8 solutions at an arm angle. The Panda has offsets and 0 to 16 solutions, the roots of a
        polynomial, which takes one or two milliseconds. Of two almost equal solutions one may be missing; the one next
        to `near` is always found. An arm without closed form is solved by iteration: every returned solution is exact,
        but some may be missing.

        Args:
            T: Pose of the tool in base: a `Pose` or a homogeneous matrix, shape (4, 4).
            psi: Arm angle of a 7-axis arm, [rad]; for the Panda the angle of joint 3. When absent: that of `near`, or
                0; if no solution is inside the limits there, the closest arm angle with a solution, slightly inside
                its range.
            near: Joint angles, [rad], that resolve the ambiguity of a singular pose.

        Raises:
            UnreachableError: The pose is out of reach, or every branch exceeds a joint limit; the message has the
                amount, also in `.distance`, `.joint` and `.excess`.
            InvalidValueError: T, psi or near is not usable, or psi was given for a 6-axis arm.
        """
        pose = T if isinstance(T, Pose) else Pose.from_matrix(T)
        r, p = pose.parts
        if not math.isfinite(sum(r) + sum(p)):
            raise InvalidValueError("pose", repr(pose), "must be finite in every element")
        guess = None if near is None else self._floats(near)
        if psi is not None and not math.isfinite(psi := as_number(psi, "psi", "rad")):
            raise InvalidValueError("psi", psi, "must be finite [rad]")
        if psi is not None and abs(psi) > MAX_ANGLE:
            raise InvalidValueError("psi", psi, "is more than two turns; the unit is rad")
        if psi is not None and not self.redundancy:
            name = self.description.name
            problem = f"has no meaning for {name}: a 6-axis arm has no arm angle"
            raise InvalidValueError("psi", psi, problem).coded("six_axes", model=name)
        return self._search.solve(self._flange(pose), psi, guess)

    def closest(self, T: Pose | ArrayLike, near: ArrayLike, psi: float | None = None) -> ClosestPose:
        """Returns joint angles for a target, or for the closest reachable pose.

        Args:
            T: Desired pose of the tool in base: a `Pose` or a homogeneous matrix, shape (4, 4).
            near: Current joint angles, shape (n,), [rad]: the start of the search and its branch.
            psi: Arm angle of a 7-axis arm, [rad]; that of `near` when absent.

        Raises:
            InvalidValueError: T, near or psi is not usable, or psi was given for a 6-axis arm.
        """
        q = as_vector(near, self.n, "near", "rad")
        target = T if isinstance(T, Pose) else Pose.from_matrix(T)
        arm_angle = self._search.natural_psi(q.tolist()) if psi is None and self.redundancy else psi

        def solve(pose: Pose, may_search: bool) -> Solutions:
            return self.inverse(pose, psi if may_search else arm_angle, q)

        return closest_reachable(solve, self.solver.envelope, self.T_flange_tool, self.forward(q), q, target)

    def inverse_batch(self, T: ArrayLike, psi: ArrayLike = 0.0) -> SolutionBatch:
        """Returns every analytic solution of many poses at once (GetJointPos), at one arm angle each.

        Args:
            T: Poses of the tool in base, shape (N, 4, 4), such as `forward_path` gives.
            psi: Arm angle of a 7-axis arm, [rad], one number or shape (N,); not used for 6 axes.

        Returns:
            `.q`, shape (N, 8, n), NaN for a pose out of reach; `.inside`; `.nearest(q)`.

        Raises:
            InvalidValueError: T or psi has another shape, is not finite, or contains an invalid pose.
        """
        poses = as_pose_batch(T)
        angles = np.asarray(psi, dtype=np.float64)
        if angles.shape not in ((), (len(poses),)) or not np.isfinite(angles).all():
            raise InvalidValueError(
                "psi", described(angles), f"needs one number or shape ({len(poses)},), finite [rad]"
            )
        flange = poses @ self._T_tool_flange.matrix if self._has_tool else poses
        joint = self.description.limits.joint
        return SolutionBatch(self.solver.batch(flange, angles), joint.lower, joint.upper)

    def feasible_arcs(self, T: Pose | ArrayLike, box: SafetyBox | None = None) -> FeasibleArcs:
        """Returns the feasible arm angles of a 7-axis arm at a pose, and the reasons against the others.

        Args:
            T: Pose of the tool in base: a `Pose` or a homogeneous matrix, shape (4, 4).
            box: Safety box of the tool; none when absent.

        Returns:
            `.feasible`: ranges of arm angles, [rad]; `.arcs`: the whole circle, each part with its reasons.

        Raises:
            UnreachableError: The pose is out of reach at every arm angle.
            InvalidValueError: T or the box is not usable.
            KinematicsError: The arm has 6 axes.
        """
        self._require_arm_angle()
        pose = T if isinstance(T, Pose) else Pose.from_matrix(T)
        bound = active_box(box)
        is_outside = bound is not None and bound.excess(pose.parts[1]) > 0.0
        return self._search.arcs(self._flange(pose), is_outside)

    def arm_angle(self, q: ArrayLike) -> float:
        """Returns the arm angle psi of a 7-axis arm, [rad] in (-pi, pi]; of the Panda the angle of joint 3.

        Raises:
            SingularError: The shoulder-wrist line is vertical or the arm is stretched; psi has no meaning there.
            KinematicsError: The arm has 6 axes.
        """
        self._require_arm_angle()
        return self.solver.redundancy_angle(self._floats(q))

    def elbow_circle(self, q: ArrayLike) -> ElbowCircle:
        """Returns the circle on which the elbow of a 7-axis xMate can move at a fixed pose of the tool.

        Args:
            q: Joint angles, shape (7,), [rad].

        Raises:
            SingularError: The arm is stretched, or shoulder and wrist are above each other.
            KinematicsError: The arm has 6 axes, or has offsets, so that its elbow does not move on a circle.
        """
        self._require_arm_angle()
        if self.redundancy.kind != "arm_angle":
            raise KinematicsError(f"{self.description.name} has offsets: its elbow does not move on a circle")
        frames = self.joint_frames(q)
        return elbow_circle(*(frames[joint].position for joint in (0, 2, 4)))

    @cached_property
    def _search(self) -> InverseSearch:
        return InverseSearch(self.description)

    def _flange(self, T_base_tool: Pose) -> Pose:
        return T_base_tool @ self._T_tool_flange if self._has_tool else T_base_tool

    def _require_arm_angle(self) -> None:
        if not self.redundancy:
            raise KinematicsError(
                f"{self.description.name} has {self.description.n} axes: only a 7-axis arm has an arm angle"
            ).coded("no_psi")
