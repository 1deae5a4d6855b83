"""Impedance control: the torques of springs between the commanded and the measured arm.

Both laws are computed from measurement and model alone and act through `Drive.TORQUE`, where gravity and friction are
compensated already, so M ddq + C dq = tau + J^T w. They give

    tau = springs + dampers + M ddq_c + C dq + (damping of the drives) dq_c

so that a free arm follows its reference, except for effects of the 1 ms step and the soft spring of the elbow, and an
external force deflects it by force over stiffness. Every mode is damped with `DAMPING_RATIO` of critical, see
`compliance`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.arrays import Array, JointVector, Matrix, scalar
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.spatial import Pose, rotation_between
from rcilab.model.dynamics.rigid_body import ToolTerms
from rcilab.model.robot_model import RobotModel
from rcilab.sim.compliance import DAMPING_RATIO, ModalDamping, design_damping
from rcilab.sim.plant import Measurement

NULL_FREQUENCY = 5.0  # [rad/s] of the spring that holds the elbow of a 7-axis arm; soft, a tuning value
NULL_DAMPING = 2.0 * DAMPING_RATIO * NULL_FREQUENCY  # [1/s]
_NULL_STIFFNESS, _NULL_DAMPING = scalar(NULL_FREQUENCY**2), scalar(NULL_DAMPING)  # [1/s^2], [1/s]
_CYCLE = scalar(CYCLE_TIME)  # [s]
_DAMPED_INVERSE = 1e-4 * np.eye(6)  # [1/kg] Keeps feed-forward finite at a singularity; error elsewhere below 0.1 %.


def joint_impedance(
    model: RobotModel,
    q_c: JointVector,
    dq_c: JointVector,
    ddq_c: JointVector,
    measured: Measurement,
    stiffness: Sequence[float],
    damper: ModalDamping | None = None,
) -> JointVector:
    """Returns the torque of a spring at every joint, without gravity, shape (n,), [N m].

    Args:
        model: The controller's model of the arm.
        q_c: Commanded joint angles, shape (n,), [rad].
        dq_c: Their velocities, shape (n,), [rad/s].
        ddq_c: Their accelerations, shape (n,), [rad/s^2].
        measured: The measurement.
        stiffness: n numbers, [N m/rad].
        damper: The damper of the previous cycles; None designs another.
    """
    body, q, dq = model.driven_body, measured.q, measured.dq
    K = np.array(stiffness)
    # The reference is that of the end of this millisecond; q and dq are those of its beginning.
    off, slip = q_c - _CYCLE * dq_c - q, dq_c - _CYCLE * ddq_c - dq
    tau = (damper or ModalDamping()).torque(lambda: design_damping(body.mass_inverse(q), np.diag(K)), K * off, slip)
    tau += body.motion_torque(q, dq, ddq_c)
    return tau if model.description.damping is None else tau + model.description.damping * dq_c


def cartesian_impedance(
    model: RobotModel,
    T_c: Pose,
    twist_c: Sequence[float],
    acc_c: Sequence[float],
    null: tuple[JointVector, JointVector, JointVector],
    measured: Measurement,
    stiffness6: Sequence[float],
    desired_wrench6: Sequence[float] = (0.0,) * 6,
    axes: Matrix | None = None,
    damper: ModalDamping | None = None,
) -> JointVector:
    """Returns the torque of springs between the commanded and the measured tool, without gravity, shape (n,), [N m].

    The orientation spring acts on the rotation vector from the measured to the commanded orientation. A 7-axis arm
    keeps its elbow near `null`, softly and without a force on the tool. Stiffness, damping and desired force act
    at the tool's origin, along the axes of setFcCoor.

    Args:
        model: The controller's model of the arm, with its tool.
        T_c: Commanded pose of the tool in base.
        twist_c: Its velocity, base axes, linear first, shape (6,), [m/s, rad/s].
        acc_c: Its acceleration, shape (6,), [m/s^2, rad/s^2].
        null: Joint angles whose arm angle a 7-axis arm keeps, their velocities and accelerations, each of shape (n,),
            [rad], [rad/s], [rad/s^2]. Without effect for other arms.
        measured: The measurement.
        stiffness6: Three translations [N/m], three rotations [N m/rad].
        desired_wrench6: Additional force and moment of the arm on its environment, [N, N m].
        axes: Rotation whose columns, in base, are the directions that both refer to, shape (3, 3); None: the base's.
        damper: The damper of the previous cycles; None designs another.
    """
    body, q, dq = model.driven_body, measured.q, measured.dq
    terms = body.tool_terms(q, dq)
    J = terms.jacobian
    # Rows of J, error and desired wrench in the axes of the springs, where the stiffness is diagonal.
    along = J if axes is None else _turned(J, axes)
    error = _pose_error(T_c, terms.pose)
    if axes is not None:
        error = _turned(np.array(error), axes).tolist()
    wrench = np.array([k * e + w for k, e, w in zip(stiffness6, error, desired_wrench6, strict=True)])
    dq_c, ddq_c = _reference(model, terms, twist_c, acc_c, null, measured)
    tau = (damper or ModalDamping()).torque(
        lambda: design_damping(terms.mass_inverse, along.T * stiffness6 @ along), along.T.dot(wrench), dq_c - dq
    )
    tau += body.motion_torque(q, dq, ddq_c)
    return tau if model.description.damping is None else tau + model.description.damping * dq_c


def _pose_error(T_c: Pose, T: Pose) -> tuple[float, ...]:
    """Returns position and rotation vector from the measured to the commanded tool, base axes, [m, rad]."""
    (r_c, (x, y, z)), (r, (px, py, pz)) = T_c.parts, T.parts
    return x - px, y - py, z - pz, *rotation_between(r, r_c)


def _turned(rows: Array, axes: Matrix) -> Array:
    """Returns rows, three linear and three angular ones in base axes, in other axes."""
    return np.concatenate((axes.T @ rows[:3], axes.T @ rows[3:]))


def _reference(
    model: RobotModel,
    terms: ToolTerms,
    twist: Sequence[float],
    acc: Sequence[float],
    null: tuple[JointVector, JointVector, JointVector],
    measured: Measurement,
) -> tuple[JointVector, JointVector]:
    """Returns the joint velocities and accelerations that move the tool as commanded, shape (n,), [rad/s], [rad/s^2].

    They are those of least kinetic energy. With Khatib's inertia at the tool, L = (J M^-1 J^T)^-1,

        dq_c = M^-1 J^T L twist        ddq_c = M^-1 J^T L (acc - dJ/dt dq - J free) + free

    With more than 6 joints, `free` is the acceleration of a damped spring at the moving `null`, and dq_c includes the
    part of its velocity in the null space. Neither affects the tool.
    """
    J = terms.jacobian
    desired = np.array([*twist, *acc])
    along = free = np.zeros(model.n)
    if model.n > 6:
        q_null, along, ddq_null = null
        free = _NULL_STIFFNESS * (q_null - measured.q) + _NULL_DAMPING * (along - measured.dq) + ddq_null
        desired[:6] -= J.dot(along)
    desired[6:] -= terms.acceleration(free) if any(twist) or any(acc) else J.dot(free)
    back = terms.mass_inverse.dot(J.T)
    joints = back.dot(model.rigid_body.tool_solver.solve(J.dot(back) + _DAMPED_INVERSE, desired.reshape(2, 6).T))
    return joints[:, 0] + along, joints[:, 1] + free
