"""The goal of the operator: joint angles, the target pose that they were chosen for, and whether it is reachable."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rcilab.app.goal.elbow import MIN_REPORTED_CHANGE, say_why
from rcilab.core.arrays import JointVector
from rcilab.core.errors import KinematicsError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message, message
from rcilab.model.kinematics.solutions import Solutions
from rcilab.model.robot_model import RobotModel

Tone = Literal["good", "warn", "bad"]
_NO_GOAL = ("reach.at_limit", "reach.beyond_limit", "reach.at_soft")
"""Reasons why the arm may be there, but no motion can end there."""
NO_SOLUTIONS = {"reach.tone.bad": "target.out_of_reach", "reach.tone.no_goal": "target.no_goal"}
"""Key of the text in place of the list of solutions, by that of the verdict's first words."""

POSE_FIELDS = ("x", "y", "z", "roll", "pitch", "yaw")
"""Names of the fields of a pose."""
NEAR_LIMIT = math.radians(5.0)  # [rad] A smaller distance to a limit is reported.
_LEVER = 2.0  # Largest turn of a joint per turn of the elbow in one branch; tuning value.
NEAR_SINGULAR = 0.03  # [m, rad] per rad. With a smaller singular value of the Jacobian the arm counts as singular.


@dataclass(frozen=True, eq=False, kw_only=True)
class TargetStatus:
    """Result of the inverse kinematics for a target."""

    tone: Tone
    """good: reachable; warn: at, beyond or near a limit, or near a singularity; bad: not reachable."""
    reason: Message
    """The reason."""
    q: JointVector
    """The joint angles at the nearest reachable pose, shape (n,), [rad]."""
    solutions: Solutions | None
    """All branches at that pose; None if it cannot be reached."""
    missed_by: Message | None = None
    """Distance of that pose from the target, as a message; None if the target is reached."""


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
    kept_psi: float | None = None
    """Arm angle that a new target keeps where it can, [rad]: the last one requested, by itself or by joint angles."""
    snapped: Message | None = None
    """Why the arm angle differs from the requested one; None if it does not."""


def with_pose_field(pose: Pose, name: str, value: float) -> Pose:
    """Returns a pose with one number replaced: x, y, z [mm], or roll, pitch, yaw [deg]."""
    position, rpy = pose.position, pose.rpy
    index = POSE_FIELDS.index(name)
    if index < 3:
        position[index] = value / 1000.0
    else:
        rpy[index - 3] = math.radians(value)
    return Pose.from_rpy(position, rpy)


def goal_at(model: RobotModel, q: JointVector) -> Goal:
    """Returns the goal at joint angles, shape (n,), [rad]."""
    psi = _arm_angle(model, q)
    return Goal(q=q, target=model.forward(q), reach=evaluate_joints(model, q), psi=psi, kept_psi=psi)


def goal_toward(
    model: RobotModel,
    target: Pose,
    near: JointVector,
    psi: float | None = None,
    snapped: Message | None = None,
    kept_psi: float | None = None,
) -> Goal:
    """Returns the goal at a target pose, or at the reachable pose nearest to it.

    Args:
        model: The arm.
        target: Pose of the tool in base.
        near: Joint angles that choose the branch, shape (n,), [rad].
        psi: Requested arm angle, [rad]; None keeps `kept_psi` where the target can be reached with it.
        snapped: Why `psi` differs from the requested arm angle.
        kept_psi: Arm angle to keep, [rad]; None is that of `near`.
    """
    reach = evaluate_pose(model, target, near, psi)
    taken = _arm_angle(model, reach.q)
    if psi is not None:
        kept_psi = taken
    elif kept_psi is None:
        kept_psi = _arm_angle(model, near)
    if psi is None and kept_psi is not None and taken is not None and reach.missed_by is None:
        reach, snapped = _at_kept_psi(model, target, reach, taken, kept_psi)
        taken = _arm_angle(model, reach.q)
    return Goal(q=reach.q, target=target, reach=reach, psi=taken, kept_psi=kept_psi, snapped=snapped)


def _at_kept_psi(
    model: RobotModel, target: Pose, reach: TargetStatus, taken: float, kept: float
) -> tuple[TargetStatus, Message | None]:
    """Returns the status at the arm angle to keep, or the given one and why it has another."""
    turn = abs(math.remainder(taken - kept, math.tau))
    if turn < MIN_REPORTED_CHANGE:
        return reach, None
    why = message("elbow.why.other")
    try:
        solutions = model.inverse(target, kept, reach.q)
        q = solutions.nearest(reach.q)
        if np.abs(q - reach.q).max() <= _LEVER * turn:
            return _evaluate_configuration(model, q, solutions), None
    except UnreachableError as error:
        why = message("elbow.kind.reach") if error.joint is None else say_why((error.joint,))
    return reach, message("elbow.snapped_only", wanted=kept, why=why, taken=taken)


def reevaluated(model: RobotModel, goal: Goal) -> Goal:
    """Returns a goal with its status within other limits; an unreachable target is solved again."""
    if goal.reach.missed_by is not None:
        return replace(goal_toward(model, goal.target, goal.q, goal.psi), kept_psi=goal.kept_psi)
    return replace(goal, reach=evaluate_joints(model, goal.q))


@dataclass(frozen=True, slots=True)
class JointLimitMargin:
    """Distance of joint angles to the nearest joint limit."""

    angle: float
    """Smallest distance to a limit, [rad]; negative outside."""
    joint: int
    """Joint, from 1."""


def margin(model: RobotModel, q: JointVector) -> JointLimitMargin:
    """Returns the smallest distance of joint angles, shape (n,), [rad], to a limit, and its joint."""
    distances = np.minimum(q - model.limits.joint.lower, model.limits.joint.upper - q)
    worst = int(np.argmin(distances))
    return JointLimitMargin(float(distances[worst]), worst + 1)


def distinguishing_joints(solutions: np.ndarray) -> tuple[int, ...]:
    """Returns the joints, from 0, whose angles in whole degrees distinguish the solutions; none if there is only one.

    Args:
        solutions: Joint angles, shape (N, n), [rad].
    """
    angles = np.degrees(solutions).round()
    rows, named = angles.tolist(), list[int]()
    different = len(set(map(tuple, rows)))
    for joint in np.argsort(-np.ptp(angles, axis=0), kind="stable").tolist():
        if len({tuple(row[i] for i in named) for row in rows}) == different:
            break
        named.append(joint)
    return tuple(sorted(named))


def evaluate_pose(model: RobotModel, target: Pose, near: JointVector, psi: float | None = None) -> TargetStatus:
    """Returns the status of a target pose in base: the branch nearest to `near` at the reachable pose nearest to it.

    Args:
        model: The arm.
        target: Pose of the tool in base.
        near: Current joint angles, or the last solution, shape (n,), [rad]; they decide the branch.
        psi: Arm angle to keep, [rad]; None keeps that of `near`.
    """
    found = model.closest(target, near, psi)
    if found.refusal is not None:
        missed, turned = _miss(target, found.pose)
        return TargetStatus(
            tone="bad",
            reason=why_not(found.refusal, missed),
            q=found.q,
            solutions=None,
            missed_by=_how_short(missed, turned),
        )
    return _evaluate_configuration(model, found.q, found.solutions)


def evaluate_joints(model: RobotModel, q: JointVector) -> TargetStatus:
    """Returns the status of joint angles, shape (n,), [rad], set directly."""
    try:
        solutions = model.inverse(model.forward(q), near=q)
    except KinematicsError:
        solutions = None
    return _evaluate_configuration(model, q, solutions)


def verdict_lead(tone: Tone, why: Message) -> str:
    """Returns the key of the words before the reason of a verdict."""
    first = why.values.get("first", why)
    is_no_goal = isinstance(first, Message) and first.code in _NO_GOAL
    return "reach.tone.no_goal" if is_no_goal else f"reach.tone.{tone}"


def why_not(refusal: UnreachableError, missed: float) -> Message:
    """Returns why a pose is not reachable.

    Args:
        refusal: Error of the inverse kinematics.
        missed: Distance of the pose that the arm takes instead, [m]: the only distance that is shown.
    """
    if refusal.distance > 0.0:
        return message("reach.far", distance=missed)
    if refusal.joint is not None:
        return message("reach.joint", joint=refusal.joint, excess=refusal.excess)
    return message("reach.no")


def _at_limit(model: RobotModel, q: JointVector, least: JointLimitMargin) -> Message:
    limits, joint, angle = model.limits.joint, least.joint, float(q[least.joint - 1])
    soft = limits.exceeded_soft_limit(joint, angle)
    if soft is not None:
        return message("reach.at_soft", joint=joint, angle=angle, limit=soft)
    if least.angle == 0.0:
        return message("reach.at_limit", joint=joint)
    low, high = (float(bound[joint - 1]) for bound in (limits.lower, limits.upper))
    return message("reach.beyond_limit", joint=joint, angle=angle, low=low, high=high)


def _evaluate_configuration(model: RobotModel, q: JointVector, solutions: Solutions | None) -> TargetStatus:
    least = margin(model, q)
    if least.angle <= 0.0:
        return TargetStatus(tone="warn", reason=_at_limit(model, q, least), q=q, solutions=solutions)
    if model.dexterity(q).smallest < NEAR_SINGULAR:
        return TargetStatus(tone="warn", reason=message("reach.singular"), q=q, solutions=solutions)
    if least.angle < NEAR_LIMIT:
        reason = message("reach.limit", joint=least.joint, margin=least.angle)
        return TargetStatus(tone="warn", reason=reason, q=q, solutions=solutions)
    return TargetStatus(tone="good", reason=message("reach.good"), q=q, solutions=solutions)


def _miss(target: Pose, reached: Pose) -> tuple[float, float]:
    """Returns the distance of a pose from its target, [m], and the angle between them, [rad]."""
    turned = 2.0 * math.acos(min(1.0, abs(float(np.asarray(target.wxyz) @ np.asarray(reached.wxyz)))))
    return float(np.linalg.norm(target.position - reached.position)), turned


def _how_short(missed: float, turned: float) -> Message:
    if round(math.degrees(turned), 1) == 0.0:
        return message("reach.short_mm", distance=missed)
    if round(1000.0 * missed) == 0:
        return message("reach.short_deg", turn=turned)
    return message("reach.short", distance=missed, turn=turned)


def _arm_angle(model: RobotModel, q: JointVector) -> float | None:
    try:
        return model.arm_angle(q)
    except KinematicsError:
        return None
