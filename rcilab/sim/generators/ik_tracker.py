"""The inverse kinematics of poses that follow each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.errors import SingularError, UnreachableError
from rcilab.core.spatial import IDENTITY, Pose, rotation_between
from rcilab.model.robot_model import RobotModel

_CLOSE = 1e-11  # [m], [rad]
_MOST_STEPS = 10
_SMALLEST = 1e-8  # Determinant of J J^T, in metres and radians: about 1e-3 in a usual pose.


class IkTracker:
    """The inverse of one arm with its tool, for poses that follow each other. Owned by a motion generator.

    It stays on the branch nearest to the last angles. Joint limits are checked later.

    Args:
        model: The arm with its tool.
    """

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._solver = model.solver
        self._T_tool_flange = model.T_flange_tool.inverse()
        self._has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)

    def solve(self, T_base_tool: Pose, psi: float, near: Sequence[float]) -> list[float]:
        """Returns the joint angles of a pose, [rad]: those closest to `near`, full turns counted.

        Args:
            T_base_tool: Pose of the tool in base.
            psi: Redundancy angle, [rad]; without effect for an arm without redundancy.
            near: Last joint angles, n plain floats, [rad].

        Raises:
            UnreachableError: The pose is out of reach, even without joint limits.
            SingularError: The arm would be at a singularity; the message names it.
        """
        flange = T_base_tool @ self._T_tool_flange if self._has_tool else T_base_tool
        q = self._solver.solve_near(flange, psi, near)
        if q is None:
            self._solver.at(flange, near).branches(psi)  # Raises an error with the distance.
            raise UnreachableError("no joint angles near the last ones put the tool there")
        singularity = self._solver.singularity(q)
        if singularity is not None:
            raise SingularError(singularity)
        return q

    def follow(self, T_base_tool: Pose, near: Sequence[float]) -> list[float]:
        """Returns the joint angles of a pose, [rad], that are reached from `near` with the least motion of the joints.

        Args:
            T_base_tool: Pose of the tool in base.
            near: Last joint angles, n plain floats, [rad].

        Raises:
            UnreachableError: The pose is out of reach, or too far from the last one.
            SingularError: The tool would lose a direction of motion.
        """
        model, q = self._model, np.array(near)
        rotation, position = T_base_tool.parts
        for _ in range(_MOST_STEPS):
            here = model.forward(q)
            p = here.parts[1]
            error = np.array(
                [*(a - b for a, b in zip(position, p, strict=True)), *rotation_between(here.parts[0], rotation)]
            )
            if np.abs(error).max() < _CLOSE:
                return q.tolist()
            J = model.jacobian(q)
            square = J @ J.T
            if np.linalg.det(square) < _SMALLEST:
                raise SingularError("the tool cannot move in every direction there")
            q = q + J.T @ np.linalg.solve(square, error)
        raise UnreachableError("no joint angles near the last ones put the tool there")
