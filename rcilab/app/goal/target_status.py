"""Whether the arm can bring its tool to a pose, in words, and what it can do instead."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.errors import KinematicsError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message, message
from rcilab.model.kinematics.solutions import Solutions
from rcilab.model.robot_model import RobotModel

Tone = Literal["good", "warn", "bad"]

NEAR_LIMIT = math.radians(5.0)  # [rad] Closer than this to a limit is worth saying.
NEAR_SINGULAR = 0.03  # Smallest singular value of the Jacobian below which the arm is as good as singular.


@dataclass(frozen=True, eq=False, kw_only=True)
class TargetStatus:
    """What the inverse says about a target."""

    tone: Tone
    """good: reachable; warn: reachable, with a limit or a singularity near; bad: not reachable."""
    reason: Message
    """Why, in words."""
    q: JointVector
    """The configuration at the nearest reachable pose, shape (n,), [rad]."""
    solutions: Solutions | None
    """All branches at that pose; None where it cannot be reached."""
    short: Message | None = None
    """How far that pose is from the target, in words; None when the target is reached."""


@dataclass(frozen=True, slots=True)
class JointLimitMargin:
    """How far a configuration is from the nearest joint limit."""

    angle: float
    """[rad]."""
    joint: int
    """From 1."""


def margin(model: RobotModel, q: JointVector) -> JointLimitMargin:
    """Returns the smallest distance to a joint limit and the joint it belongs to."""
    distances = np.minimum(q - model.limits.joint.lower, model.limits.joint.upper - q)
    worst = int(np.argmin(distances))
    return JointLimitMargin(float(distances[worst]), worst + 1)


def telling_joints(solutions: np.ndarray) -> tuple[int, ...]:
    """Returns the joints, from 0, whose angles in whole degrees tell the solutions apart; none where there is one.

    Args:
        solutions: Joint angles, shape (N, n), [rad].
    """
    angles = np.degrees(solutions).round()
    named: list[int] = []
    for joint in np.argsort(-np.ptp(angles, axis=0), kind="stable").tolist():
        if len(np.unique(angles[:, named], axis=0)) == len(np.unique(angles, axis=0)):
            break
        named.append(joint)
    return tuple(sorted(named))


def evaluate_pose(model: RobotModel, target: Pose, near: JointVector, psi: float | None = None) -> TargetStatus:
    """Returns the branch nearest to `near` at a target, or at the reachable pose nearest to it.

    Args:
        model: The arm.
        target: Pose of the tool in base.
        near: Where the arm (or the last answer) is, shape (n,), [rad]; decides the branch.
        psi: Arm angle to hold, [rad]; None keeps that of `near`.
    """
    found = model.closest(target, near, psi)
    if found.refusal is not None:
        missed, turned = _miss(target, found.pose)
        return TargetStatus(
            tone="bad",
            reason=why_not(found.refusal, missed),
            q=found.q,
            solutions=None,
            short=_how_short(missed, turned),
        )
    return _judge_configuration(model, found.q, found.solutions)


def evaluate_joints(model: RobotModel, q: JointVector) -> TargetStatus:
    """Returns what is to be said about a configuration that was posed joint by joint."""
    try:
        solutions = model.inverse(model.forward(q), near=q)
    except KinematicsError:
        solutions = None
    return _judge_configuration(model, q, solutions)


def why_not(refusal: UnreachableError, missed: float) -> Message:
    """Returns why a pose is not reachable.

    Args:
        refusal: What the inverse says.
        missed: How far the pose that the arm takes instead is from it, [m]: no other distance is shown beside it.
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


def _judge_configuration(model: RobotModel, q: JointVector, solutions: Solutions | None) -> TargetStatus:
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
    """Returns how far a pose is from its target, [m], and how far it is turned from it, [rad]."""
    turned = 2.0 * math.acos(min(1.0, abs(float(np.asarray(target.wxyz) @ np.asarray(reached.wxyz)))))
    return float(np.linalg.norm(target.position - reached.position)), turned


def _how_short(missed: float, turned: float) -> Message:
    if round(math.degrees(turned), 1) == 0.0:
        return message("reach.short_mm", distance=missed)
    if round(1000.0 * missed) == 0:
        return message("reach.short_deg", turn=turned)
    return message("reach.short", distance=missed, turn=turned)
