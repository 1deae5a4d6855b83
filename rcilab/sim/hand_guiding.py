"""Hand guiding and the walls of the safety box: the torques on a guided arm.

A guided arm is weightless (`Drive.TORQUE` compensates gravity and friction) and lightly damped. Directions that are not
free are held with the stiffest springs of the Cartesian impedance, an elbow that is not free with a spring at joint 3.
Close to a joint limit a spring pushes back, up to the joint's torque limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import Array, JointVector, Matrix
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.limits import JointLimits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose, rotation_between
from rcilab.model.dynamics.rigid_body import ToolTerms
from rcilab.model.dynamics.symmetric_solver import SymmetricSolver
from rcilab.model.robot_model import RobotModel
from rcilab.sim.compliance import design_damping
from rcilab.sim.plant import Measurement

GUIDE_DAMPING = 1.5  # [rad/s] slowest mode that damping is computed with: a guided arm slows down in about 0.5 s
JOINT_DAMPING = 0.02  # [N m s/rad per N m of torque limit] in addition, for light links; a tuning value
STOP_ZONE = (
    0.05  # [rad] before a joint limit in which its spring grows from nothing to the torque limit; a tuning value
)
_ELBOW = 2  # From 0.
_DAMPED_OUTWARD = 1e-6  # [rad/s] no damping parallel to walls


@dataclass(frozen=True, slots=True)
class GuidedFreedom:
    """Free directions of a guided arm."""

    axes: tuple[bool, ...] = (True,) * 6
    """Translation along and rotation about the axes of the base."""
    has_free_elbow: bool = True
    """Whether joint 3, the elbow as Franka defines it, is free."""


FREE = GuidedFreedom()
"""Every joint."""
FREE_TRANSLATION = GuidedFreedom((True,) * 3 + (False,) * 3)
"""The tool's position; its orientation is held."""
FREE_ROTATION = GuidedFreedom((False,) * 3 + (True,) * 3)
"""The tool's orientation; its position is held."""


def guide_torque(
    model: RobotModel,
    measured: Measurement,
    freedom: GuidedFreedom,
    T_held: Pose,
    limits: JointLimits | None = None,
    q3_held: float = 0.0,
    damping: float = 1.0,
) -> JointVector:
    """Returns the torque on a guided arm, without gravity, shape (n,), [N m].

    Args:
        model: The controller's model of the arm.
        measured: The measurement.
        freedom: Free directions.
        T_held: Pose of the tool in base at the start of guiding.
        limits: Joint limits; None: those of the arm.
        q3_held: Angle of joint 3 at the start, [rad]; used if the elbow is not free.
        damping: Factor on the damping.
    """
    terms = model.rigid_body.tool_terms(measured.q, measured.dq)
    limits = model.limits.joint if limits is None else limits
    stiffness, spring = _limit_springs(measured.q, limits)
    for held, hold, error in _held(model, terms, freedom, T_held):
        J = terms.jacobian[held]
        stiffness = stiffness + hold * (J.T @ J)
        spring = spring + J.T @ (hold * error)
    if not freedom.has_free_elbow:
        hold = limits.torque[_ELBOW] / STOP_ZONE
        stiffness[_ELBOW, _ELBOW] += hold
        spring[_ELBOW] += hold * (q3_held - measured.q[_ELBOW])
    spring = spring + _joint_damping(
        terms.mass_inverse, damping * JOINT_DAMPING * model.limits.joint.torque, measured.dq
    )
    coriolis = model.rigid_body.motion_torque(measured.q, measured.dq, np.zeros(model.n))
    return (
        design_damping(terms.mass_inverse, stiffness, damping * GUIDE_DAMPING).torque(spring, -measured.dq) + coriolis
    )


def wall_torque(model: RobotModel, measured: Measurement, box: SafetyBox, stiffness6: tuple[float, ...]) -> JointVector:
    """Returns the torque that pushes the tool back into an active box, shape (n,), [N m]; zeros inside it.

    Args:
        model: The controller's model of the arm, with its tool.
        measured: The measurement.
        box: The safety box of the tool.
        stiffness6: Cartesian stiffness; the first three act along the axes of the box, [N/m].
    """
    terms = model.rigid_body.tool_terms(measured.q, measured.dq)
    r, centre = box.T_base_box.parts
    x, y, z = (a - b for a, b in zip(terms.pose.parts[1], centre, strict=True))
    outside = [0.0, 0.0, 0.0]
    for axis, half in enumerate(edge / 2.0 for edge in box.size):
        along = r[axis] * x + r[3 + axis] * y + r[6 + axis] * z
        outside[axis] = along - min(max(along, -half), half)
    if not box.active or not any(outside):
        return np.zeros(model.n)
    faces = [axis for axis in range(3) if outside[axis]]
    directions = np.array(r).reshape(3, 3)[:, faces]
    J = directions.T @ terms.jacobian[:3]
    stiffness = np.array([stiffness6[axis] for axis in faces])
    spring = J.T @ (stiffness * [-outside[axis] for axis in faces])
    return design_damping(terms.mass_inverse, J.T * stiffness @ J, _DAMPED_OUTWARD).torque(spring, -measured.dq)


def _held(
    model: RobotModel, terms: ToolTerms, freedom: GuidedFreedom, T_held: Pose
) -> Iterator[tuple[list[int], float, Array]]:
    """Yields the held axes, 0 to 5, of translation and of rotation, with their stiffness and errors, in base axes."""
    cartesian = model.limits.cartesian
    along = [axis for axis in range(3) if not freedom.axes[axis]]
    about = [axis for axis in range(3, 6) if not freedom.axes[axis]]
    if along:
        yield along, cartesian.translation_stiffness, (T_held.position - terms.pose.position)[along]
    if about:
        error = np.array((0.0, 0.0, 0.0, *rotation_between(terms.pose.parts[0], T_held.parts[0])))
        yield about, cartesian.rotation_stiffness, error[about]


def _joint_damping(mass_inverse: Matrix, dampers: JointVector, dq: JointVector) -> JointVector:
    """Returns the torque of viscous dampers at the joints, shape (n,), [N m].

    It is that of the velocities at the end of the cycle, tau = -D (dq + h M^-1 tau), which damps any inertia. With the
    measured velocities, dampers of more than 2 M / h would accelerate a light last link.
    """
    return SymmetricSolver(len(dq)).solve(np.diag(1.0 / dampers) + CYCLE_TIME * mass_inverse, -dq)


def _limit_springs(q: JointVector, limits: JointLimits) -> tuple[Array, JointVector]:
    """Returns stiffness, shape (n, n), and torque of the springs at the joint limits."""
    excess = q - np.clip(q, limits.lower + STOP_ZONE, limits.upper - STOP_ZONE)
    if not excess.any():
        return np.zeros((len(q), len(q))), np.zeros(len(q))
    stiffness = np.where(excess, limits.torque / STOP_ZONE, 0.0)
    return np.diag(stiffness), -stiffness * excess
