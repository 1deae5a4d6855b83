"""Whether the arm can bring its tool to a pose, in words, and what it can do instead."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rcilab.arrays import JointVector
from rcilab.errors import UnreachableError
from rcilab.kinematics.solutions import Solutions
from rcilab.model import RobotModel
from rcilab.spatial import Pose
from rcilab.workbench.text import Message, message

Tone = Literal["good", "warn", "bad"]

NEAR_LIMIT = math.radians(5.0)  # [rad] A choice: closer than this to a limit is worth saying.
NEAR_SINGULAR = 0.03  # A choice: smallest singular value of the Jacobian below which the arm is as good as singular.
_BISECTIONS = 14  # Halvings between a reachable pose and one that is not: 1 m becomes 0.06 mm.
_SHORTEST_PULL = 0.2  # How far towards the shoulder a target is pulled at most, as a part of its distance.


@dataclass(frozen=True, eq=False, kw_only=True)
class Reach:
    """What the inverse says about a target."""

    tone: Tone
    """good: reachable; warn: reachable, with a limit or a singularity near; bad: not reachable."""
    reason: Message
    """Why, in words."""
    q: JointVector
    """The configuration at the nearest reachable pose, shape (n,), [rad]."""
    solutions: Solutions | None
    """All branches at that pose."""


@dataclass(frozen=True, slots=True)
class Margin:
    """How far a configuration is from the nearest joint limit."""

    angle: float
    """[rad]."""
    joint: int
    """From 1."""


def margin(model: RobotModel, q: JointVector) -> Margin:
    """Returns the smallest distance to a joint limit and the joint it belongs to."""
    distances = np.minimum(q - model.limits.joint.lower, model.limits.joint.upper - q)
    worst = int(np.argmin(distances))
    return Margin(float(distances[worst]), worst + 1)


def judge_pose(model: RobotModel, target: Pose, near: JointVector, psi: float | None = None) -> Reach:
    """Returns the branch nearest to `near` at a target, or at the reachable pose nearest to it.

    Args:
        model: The arm.
        target: Pose of the tool in base.
        near: Where the arm (or the last answer) is, shape (n,), [rad]; decides the branch.
        psi: Arm angle to hold, [rad]; None keeps that of `near`.
    """
    try:
        solutions = model.inverse(target, psi=psi, near=near)
    except UnreachableError as refusal:
        solutions = _nearest_reachable(model, target, near, psi)
        q = near if solutions is None else solutions.nearest(near)
        return Reach(tone="bad", reason=_why_not(refusal), q=q, solutions=solutions)
    q = solutions.nearest(near)
    return _judge_configuration(model, q, solutions)


def judge_joints(model: RobotModel, q: JointVector) -> Reach:
    """Returns what is to be said about a configuration that was posed joint by joint."""
    return _judge_configuration(model, q, None)


def _judge_configuration(model: RobotModel, q: JointVector, solutions: Solutions | None) -> Reach:
    if model.dexterity(q).smallest < NEAR_SINGULAR:
        return Reach(tone="warn", reason=message("reach.singular"), q=q, solutions=solutions)
    least = margin(model, q)
    if least.angle < NEAR_LIMIT:
        reason = message("reach.limit", joint=least.joint, margin=f"{math.degrees(least.angle):.1f}")
        return Reach(tone="warn", reason=reason, q=q, solutions=solutions)
    return Reach(tone="good", reason=message("reach.good"), q=q, solutions=solutions)


def _why_not(refusal: UnreachableError) -> Message:
    if refusal.distance > 0.0:
        return message("reach.far", distance=f"{refusal.distance * 1000.0:.0f}")
    if refusal.joint is not None:
        return message("reach.joint", joint=refusal.joint, excess=f"{math.degrees(refusal.excess):.1f}")
    return message("reach.no")


def _nearest_reachable(model: RobotModel, target: Pose, near: JointVector, psi: float | None) -> Solutions | None:
    """Returns the branches at the better of two poses.

    One is the target pulled towards the shoulder, the other the last reachable one on the way from `near`.
    """
    shoulder = np.array([0.0, 0.0, model.description.dh[0].d])
    wanted, start = target.position, model.forward(near)
    tries = []
    towards = shoulder + _SHORTEST_PULL * (wanted - shoulder)
    for origin in (Pose(towards, target.wxyz), start):
        found = _last_reachable(model, origin, target, near, psi)
        if found is not None:
            turned = 1.0 - abs(float(found[0].wxyz @ target.wxyz))
            tries.append((float(np.linalg.norm(found[0].position - wanted)) + turned, len(tries), found))
    return min(tries)[2][1] if tries else None


def _last_reachable(
    model: RobotModel, origin: Pose, target: Pose, near: JointVector, psi: float | None
) -> tuple[Pose, Solutions] | None:
    """Returns the pose furthest on the straight way from a reachable origin to a target that is not."""

    def attempt(share: float, held: float | None) -> tuple[Pose, Solutions] | None:
        pose = _between(origin, target, share)
        try:
            return pose, model.inverse(pose, psi=held, near=near)
        except UnreachableError:
            return None

    best = attempt(0.0, psi)
    if best is None:
        return None
    held = best[1].psi  # Searching for another arm angle at every step would cost more than a display's frame.
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        found = attempt(middle, held)
        if found is None:
            high = middle
        else:
            low, best = middle, found
    return best


def _between(start: Pose, end: Pose, share: float) -> Pose:
    """Returns the pose at a share of the way, positions and quaternions blended linearly (short ways only)."""
    a, b = start.wxyz, end.wxyz
    b = -b if float(a @ b) < 0.0 else b
    wxyz = (1.0 - share) * a + share * b
    if float(wxyz @ wxyz) < 1e-9:
        wxyz = a
    return Pose((1.0 - share) * start.position + share * end.position, wxyz)
