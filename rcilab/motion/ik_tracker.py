"""The inverse kinematics of poses that follow each other."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, hypot
from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import SingularError, UnreachableError
from rcilab.core.spatial import IDENTITY, Pose, rotation_between
from rcilab.model.kinematics.solvers.newton import MOST_TURNED, OFF_POSITION, WEIGHTS
from rcilab.model.robot_model import RobotModel

if TYPE_CHECKING:
    from rcilab.model.dynamics.rigid_body import Twist  # Which imports pinocchio.

_CONVERGING = 1e-8  # [m], [rad] The next step reduces a smaller error to rounding, as each squares it.
_NEAR = 1e-3  # [m], [rad] The Jacobian of a smaller error serves for the following steps, too.
_MOST_STEPS = 10
_LARGEST_STEP = 0.1  # [rad] A larger one leaves the last angles.
_MOST_DAMPED_STEPS = 40
_FARTHEST = 0.6  # [rad] That a joint may be from the last angles after damped steps.
_DAMPING = 0.1  # Of damped steps, times the square of the error in metres and radians; a tuning value.
_LEAST_DAMPING = 1e-12  # Where J J^T has no inverse.
_CONVERGED = 1e-20  # [m^2], [rad^2]
_EYE = np.eye(6)
_SMALLEST = 1e-8  # Determinant of J J^T, in metres and radians: about 1e-3 in a usual pose.


class IkTracker:
    """The inverse of one arm with its tool, for poses that follow each other. Owned by a motion generator.

    It stays on the branch nearest to the last angles. Joint limits are checked later.

    Args:
        model: The arm with its tool.
    """

    def __init__(self, model: RobotModel) -> None:
        self._body = model.rigid_body
        self._solver = model.solver
        self._T_tool_flange = model.T_flange_tool.inverse()
        self._has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)
        joint = model.redundancy.joint
        self._held = None if joint is None else joint - 1
        self._moving = [i for i in range(model.n) if i != self._held]
        self._still, self._eye = np.zeros(model.n), np.eye(model.n)

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
        q = None if self._held is None else self._step_to(T_base_tool, self._held, psi, near)
        if q is None:
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
        body, q, here = self._body, np.array(near), self._body.last_terms
        if here is None or not here.is_of(near):
            here = body.tool_motion(q, self._still)
        jacobian, error = here.jacobian, _error(here.pose, T_base_tool)
        square = jacobian.dot(jacobian.T)
        for number in range(_MOST_STEPS):
            step = jacobian.T.dot(body.tool_solver.solve(square, np.array(error)))
            if number == 0 and not (body.tool_solver.has_solved and body.tool_solver.determinant >= _SMALLEST):
                raise SingularError("the tool cannot move in every direction there")
            q = q + step
            size = max(map(abs, error))
            if size < _CONVERGING:
                return q.tolist()
            if size < _NEAR:
                error = _error(body.tool_pose(q), T_base_tool)
            else:
                jacobian, error = self._differential(q, T_base_tool)
                square = jacobian.dot(jacobian.T)
        raise UnreachableError("no joint angles near the last ones put the tool there")

    def approach(self, T_base_tool: Pose, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles of a pose, [rad], reached by damped steps from others, or None if they are not near.

        The steps are defined at a singularity, too, where an arm may pass or begin: for poses that its branches do not
        give there.

        Args:
            T_base_tool: Pose of the tool in base.
            near: Joint angles close to it, n plain floats, [rad].
        """
        q = np.array(near)
        for _ in range(_MOST_DAMPED_STEPS):
            J, error = self._differential(q, T_base_tool)
            residual = np.array(error)
            square = float(residual @ residual)
            if square < _CONVERGED:
                return q.tolist()
            step = J.T @ np.linalg.solve(J @ J.T + (_DAMPING * square + _LEAST_DAMPING) * _EYE, residual)
            q = q + step
            if np.abs(q - near).max() > _FARTHEST:
                return None
        return None

    def aim(self, T_base_tool: Pose, near: Sequence[float], *, most_turned: float = MOST_TURNED) -> list[float]:
        """Returns the joint angles of an arm with fewer than six joints next to a pose, [rad], near others.

        The tool has the position of the pose, and of the orientations that the arm reaches there the nearest one.

        Args:
            T_base_tool: Pose of the tool in base.
            near: Joint angles close to it, n plain floats, [rad].
            most_turned: By how much the orientation may differ, [rad].

        Raises:
            UnreachableError: The position is out of reach or far away, or the orientation differs more.
        """
        q = np.array(near)
        for _ in range(_MOST_DAMPED_STEPS):
            J, error = self._differential(q, T_base_tool)
            residual = np.array(error)
            weighted = WEIGHTS[:, np.newaxis] * J
            damping = _DAMPING * float(residual @ residual) + _LEAST_DAMPING
            square = weighted.T @ weighted + damping * self._eye
            step: Array = np.linalg.inv(square) @ (weighted.T @ (WEIGHTS * residual))
            q = q + step
            if np.abs(q - near).max() > _FARTHEST:
                break
            if np.abs(step).max() >= _CONVERGING:
                continue
            turn = hypot(*error[3:])
            if hypot(*error[:3]) > OFF_POSITION:
                break
            if turn > most_turned:
                raise UnreachableError(
                    f"an arm with {len(q)} joints turns its tool only about its own axis and in the plane of the arm: "
                    f"there the orientation would differ by {degrees(turn):.3g} deg, more than "
                    f"{degrees(most_turned):.3g} deg; give a level orientation, or move there by joint angles"
                )
            return q.tolist()
        raise UnreachableError("no joint angles near the last ones put the tool there")

    def _step_to(self, T_base_tool: Pose, held: int, psi: float, near: Sequence[float]) -> list[float] | None:
        """Returns the joint angles near the last ones with one joint held at `psi`, or None if they are not near."""
        q, moving = np.array(near), self._moving
        q[held] = psi
        for _ in range(_MOST_STEPS):
            J, error = self._differential(q, T_base_tool)
            try:
                step = np.linalg.solve(J[:, moving], np.array(error))
            except np.linalg.LinAlgError:
                return None
            if not np.abs(step).max() < _LARGEST_STEP:
                return None
            q = q.copy()
            q[moving] += step
            if max(map(abs, error)) < _CONVERGING:
                return q.tolist()
        return None

    def _differential(self, q: Array, T_base_tool: Pose) -> tuple[Array, Twist]:
        """Returns the Jacobian at joint angles, and the twist from their pose to another, [m, rad]."""
        here = self._body.tool_motion(q, self._still)
        return here.jacobian, _error(here.pose, T_base_tool)


def _error(here: Pose, there: Pose) -> Twist:
    """Returns the twist from a pose to another, [m, rad]."""
    (rotation, (x, y, z)), (R, (px, py, pz)) = here.parts, there.parts
    return px - x, py - y, pz - z, *rotation_between(rotation, R)
