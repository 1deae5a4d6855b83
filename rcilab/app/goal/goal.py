"""The goal of the operator: a configuration of the arm, and the target pose that it was chosen for."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.app.goal.target_status import TargetStatus, evaluate_joints, evaluate_pose
from rcilab.core.arrays import JointVector
from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message
from rcilab.model.robot_model import RobotModel


@dataclass(frozen=True, eq=False, kw_only=True)
class Goal:
    """The goal of the operator."""

    q: JointVector
    """Joint angles of the goal, shape (n,), [rad]."""
    target: Pose
    """The requested pose, reachable or not."""
    reach: TargetStatus
    psi: float | None = None
    """Arm angle of `q`, [rad]; None for an arm without one."""
    snapped: Message | None = None
    """Why the arm angle differs from the requested one; None if it does not."""


def goal_at(model: RobotModel, q: JointVector) -> Goal:
    """Returns the goal at joint angles, shape (n,), [rad]."""
    return Goal(q=q, target=model.forward(q), reach=evaluate_joints(model, q), psi=_arm_angle(model, q))


def goal_toward(
    model: RobotModel,
    target: Pose,
    near: JointVector,
    psi: float | None = None,
    snapped: Message | None = None,
) -> Goal:
    """Returns the goal at a target pose, or at the reachable pose nearest to it.

    Args:
        model: The arm.
        target: Pose of the tool in base.
        near: Joint angles that choose the branch, shape (n,), [rad].
        psi: Requested arm angle, [rad]; None keeps that of `near`.
        snapped: Why `psi` differs from the requested arm angle.
    """
    reach = evaluate_pose(model, target, near, psi)
    return Goal(q=reach.q, target=target, reach=reach, psi=_arm_angle(model, reach.q), snapped=snapped)


def _arm_angle(model: RobotModel, q: JointVector) -> float | None:
    try:
        return model.arm_angle(q)
    except KinematicsError:
        return None
