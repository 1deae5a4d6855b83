"""Inverse kinematics of the flange inside the joint limits: at a given arm angle, or the closest with a solution.

The error of an unreachable pose has the missing distance, or the exceeded joint limit and the excess.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from rcilab.core.errors import SingularError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import FeasibleArcs
from rcilab.model.kinematics.solutions import Solutions
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.robots.description import RobotDescription

_OFFSETS = tuple(math.radians(sign * step) for step in range(10, 181, 10) for sign in (1, -1))
"""Offsets of the arm angle to try, smallest first, for the error of a pose that is unreachable at every one, [rad]."""


class InverseSearch:
    """The inverse of one arm from its flange, inside its joint limits. Immutable.

    Args:
        description: The arm.

    Raises:
        ModelError: No solver supports the arm.
    """

    def __init__(self, description: RobotDescription) -> None:
        self.solver = build_solver(description)
        self._joint = description.limits.joint
        self._lower: list[float] = self._joint.lower.tolist()
        self._upper: list[float] = self._joint.upper.tolist()

    def solve(self, T_base_flange: Pose, psi: float | None, near: Sequence[float] | None) -> Solutions:
        """Returns the solutions at an arm angle; if None, at that of `near`, or at the closest that has solutions.

        Args:
            T_base_flange: Pose of the flange in base.
            psi: Arm angle, [rad]; None leaves it open, and is required for 6 axes.
            near: Joint angles, [rad], that resolve the ambiguity of a singular pose.

        Raises:
            UnreachableError: No solution exists; the message has the reason.
        """
        start = psi
        if start is None and self.solver.redundancy:
            start = self.natural_psi(near)
        pose = self.solver.at(T_base_flange, near)
        solutions = Solutions(pose.branches(start or 0.0), self._lower, self._upper, start, self._joint)
        if len(solutions):
            return solutions
        if psi is not None or start is None:
            raise solutions.refusal()
        best = solutions
        for angle in self._other_arm_angles(T_base_flange, start):
            solutions = Solutions(pose.branches(angle), self._lower, self._upper, angle, self._joint)
            if len(solutions):
                return solutions
            best = min(best, solutions, key=_least_excess)
        raise best.refusal(everywhere=True)

    def arcs(self, T_base_flange: Pose, outside_box: bool = False) -> FeasibleArcs:
        """Returns the feasible arm angles of a pose of the flange, and the reasons against the others.

        Raises:
            UnreachableError: The pose is out of reach at every arm angle.
            KinematicsError: The arm has no redundancy.
        """
        return self.solver.arcs(T_base_flange, self._joint.lower, self._joint.upper, outside_box)

    def natural_psi(self, near: Sequence[float] | None) -> float:
        """Returns the arm angle of joint angles, [rad]; 0 where it is not defined, or without joint angles."""
        if near is None:
            return 0.0
        try:
            return self.solver.redundancy_angle(near)
        except SingularError:
            return 0.0

    def _other_arm_angles(self, T_base_flange: Pose, start: float) -> Iterator[float]:
        """Yields the closest arm angle with a solution, if any; then others, to find the smallest excess."""
        closest = self.arcs(T_base_flange).nearest(start)
        if closest is not None:
            yield closest
        yield from (math.remainder(start + offset, math.tau) for offset in _OFFSETS)


def _least_excess(solutions: Solutions) -> float:
    return min((branch.excess for branch in solutions.all), default=math.inf)
