"""Iterative solvers that start at the arm's position: pinocchio's example and pink, on the URDF of rcilab."""

# pyright: reportAttributeAccessIssue=false
# Compiled code adds pinocchio's names to its module at run time, so that pyright does not find them.

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np

from rcilab.core.arrays import Array, JointVector
from rcilab.diagnostics.bench.compare.peer import Solver
from rcilab.model.robot_model import RobotModel
from rcilab.robots.urdf import build_urdf

_CONVERGED = 1e-4
"""Norm of the error, metres and radians together, at which the example stops; the same for pink."""
_CLIK_ITERATIONS, _CLIK_STEP, _CLIK_DAMPING = 1000, 1e-1, 1e-12
"""Values of pinocchio's example."""
_PINK_ITERATIONS = 200
"""Measured: the iterations that converge do so within 50 steps."""
_PINK_STEP = 1.0
"""[s] Duration of each step. Of 0.01, 0.1 and 1, this value solves most poses, and fastest."""


def clik(model: RobotModel) -> Solver:
    """Returns pinocchio's example of inverse kinematics (`inverse-kinematics.py`: CLIK), without joint limits."""
    import pinocchio as pin  # pyright: ignore[reportMissingImports]

    arm, data, frame = _pinocchio(model)
    joint = arm.frames[frame].parentJoint
    T_flange_joint = arm.frames[frame].placement.inverse()

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        target, q = pin.SE3(T) * T_flange_joint, near.copy()
        for _ in range(_CLIK_ITERATIONS):
            pin.forwardKinematics(arm, data, q)
            remaining = data.oMi[joint].actInv(target)
            error = pin.log(remaining).vector
            if np.linalg.norm(error) < _CONVERGED:
                return [q]
            J = -np.dot(pin.Jlog6(remaining.inverse()), pin.computeJointJacobian(arm, data, q, joint))
            v = -J.T.dot(np.linalg.solve(J.dot(J.T) + _CLIK_DAMPING * np.eye(6), error))
            q = pin.integrate(arm, q, v * _CLIK_STEP)
        return []

    return Solver(solve=solve, about=f"pinocchio {version('pin')}, its CLIK example from q, without joint limits")


def pink(model: RobotModel) -> Solver:
    """Returns pink's differential inverse kinematics, iterated to convergence, with joint limits.

    Raises:
        ModuleNotFoundError: pink or its solver daqp is not installed.
    """
    import daqp  # noqa: F401  # pyright: ignore[reportMissingImports]  # pink loads this solver by name.
    import pinocchio as pin  # pyright: ignore[reportMissingImports]
    from pink import Configuration, solve_ik  # pyright: ignore[reportMissingImports]
    from pink.tasks import FrameTask  # pyright: ignore[reportMissingImports]

    arm, data, _ = _pinocchio(model)

    def solve(T: Array, near: JointVector) -> list[JointVector]:
        configuration = Configuration(arm, data, near)
        task = FrameTask("flange", position_cost=1.0, orientation_cost=1.0, lm_damping=1e-3)
        task.set_target(pin.SE3(T))
        for _ in range(_PINK_ITERATIONS):
            if np.linalg.norm(task.compute_error(configuration)) < _CONVERGED:
                return [configuration.q]
            velocity = solve_ik(configuration, [task], _PINK_STEP, solver="daqp", safety_break=False)
            configuration.integrate_inplace(velocity, _PINK_STEP)
        return []

    return Solver(
        solve=solve, about=f"pink {version('pin-pink')}, FrameTask and daqp, {_PINK_ITERATIONS} steps at most"
    )


def _pinocchio(model: RobotModel) -> tuple[Any, Any, int]:
    """Returns pinocchio's model of the URDF, its data, and the id of the flange frame."""
    import pinocchio as pin  # pyright: ignore[reportMissingImports]

    arm = pin.buildModelFromXML(build_urdf(model.description))
    return arm, arm.createData(), arm.getFrameId("flange")
