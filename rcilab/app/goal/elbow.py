"""The arm angles that a goal leaves open: which are free, which are not and why, and the manipulability at each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from rcilab.core.arrays import Array, JointVector, readonly_copy
from rcilab.core.errors import KinematicsError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message, message
from rcilab.model.kinematics.elbow_circle import ElbowCircle
from rcilab.model.kinematics.elbow_ranges import Arc, FeasibleArcs
from rcilab.model.robot_model import RobotModel

ArcKind: TypeAlias = Literal["free", "other", "limits", "singular", "box", "reach"]
"""free: in this branch; other: in another branch only; or the reason why it is not."""

DEXTERITY_SAMPLES = 36
"""Arm angles at which the manipulability is computed: every ten degrees."""
MIN_REPORTED_CHANGE = math.radians(0.5)  # [rad] A smaller change of the arm angle is not reported.

_KINDS: dict[str, ArcKind] = {
    "joint limits": "limits",
    "singularity": "singular",
    "safety box": "box",
    "reach": "reach",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ElbowArc:
    """A range of arm angles of one kind."""

    start: float
    """[rad]."""
    end: float
    """[rad], above start."""
    kind: ArcKind
    joints: tuple[int, ...] = ()
    """The joints beyond their limits, from 1."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Elbow:
    """The elbow circle of a goal."""

    circle: ElbowCircle
    psi: float
    """Arm angle of the goal, [rad]."""
    branch: int
    """Branch of the goal, as in `Solutions.all`."""
    arcs: tuple[ElbowArc, ...]
    """Consecutive arcs; together a full turn."""
    dexterity: Array
    """Smallest singular value of the Jacobian in this branch, at `DEXTERITY_SAMPLES` arm angles from -pi, one each;
    NaN where the branch has no solution."""


def compute_elbow(model: RobotModel, q: Array, box: SafetyBox | None) -> Elbow | None:
    """Returns the elbow circle at these joint angles; None for an arm without one.

    Args:
        model: The arm, with its tool.
        q: Joint angles, shape (n,), [rad].
        box: Safety box for the tool.
    """
    if not model.redundancy:
        return None
    try:
        circle, psi = model.elbow_circle(q), model.arm_angle(q)
        target = model.forward(q)
        arcs = model.feasible_arcs(target, box)
    except KinematicsError:
        return None
    looks = np.append(np.linspace(-math.pi, math.pi, DEXTERITY_SAMPLES, endpoint=False), psi)
    batch = model.inverse_batch(np.repeat(target.matrix[None], len(looks), axis=0), looks)
    branch = int(np.abs(np.angle(np.exp(1j * (batch.q[-1] - q)))).max(axis=1).argmin())
    along = batch.q[:-1, branch]
    dexterity = model.dexterity_path(along).smallest
    return Elbow(circle=circle, psi=psi, branch=branch, arcs=_look(arcs, branch), dexterity=dexterity)


def nearest_free(
    model: RobotModel, target: Pose, psi: float, branch: int | None = None, box: SafetyBox | None = None
) -> tuple[float, Message | None]:
    """Returns the possible arm angle nearest to a wanted one, and why it differs.

    Args:
        model: A 7-axis arm.
        target: Pose of the tool in base.
        psi: Wanted arm angle, [rad].
        branch: The branch to keep, as in `Elbow.branch`; None takes any.
        box: Safety box for the tool, as for `compute_elbow`.
    """
    try:
        arcs = model.feasible_arcs(target, box)
    except KinematicsError:
        return psi, None
    found = None if branch is None else arcs.nearest(psi, branch)
    is_kept = found is not None
    found = arcs.nearest(psi) if found is None else found
    if found is None or abs(math.remainder(found - psi, math.tau)) < MIN_REPORTED_CHANGE:
        return psi, None
    left = arcs.at(psi)
    why = message("elbow.why.other") if is_kept and left.branches else _say_why_not(left)
    code = "elbow.snapped" if arcs.at(found).ok else "elbow.snapped_only"
    return found, message(code, wanted=psi, why=why, taken=found)


def in_branch(model: RobotModel, target: Pose, psi: float, q: Array, branch: int) -> JointVector | None:
    """Returns the joint angles of one branch, nearest to others; None without a solution.

    Args:
        model: A 7-axis arm.
        target: Pose of the tool in base.
        psi: Arm angle, [rad].
        q: Joint angles that decide on full turns, shape (n,), [rad].
        branch: The branch, as in `Elbow.branch`.
    """
    try:
        stands = model.inverse(target, psi).all[branch]
    except KinematicsError:
        return None
    turns = np.round((q - stands.q) / math.tau) * math.tau
    turned = np.array(stands.q) + turns
    inside = (turned > model.limits.joint.lower) & (turned < model.limits.joint.upper)
    return readonly_copy(np.where(inside, turned, stands.q)) if stands.ok else None


def say_why(joints: tuple[int, ...]) -> Message:
    """Returns why an arm angle is forbidden: joints beyond their limits, or a singularity."""
    if not joints:
        return message("elbow.why.singular")
    return message("elbow.why.limits", joints=", ".join(str(joint) for joint in joints))


def _say_why_not(arc: Arc) -> Message:
    return message("elbow.kind.reach") if "reach" in arc.reasons else say_why(arc.joints)


def _look(found: FeasibleArcs, branch: int) -> tuple[ElbowArc, ...]:
    """Returns the arcs for one branch; neighbours of one kind are joined."""
    looks: list[ElbowArc] = []
    for arc in found.arcs:
        kind = _kind(arc, branch)
        joints = arc.joints if kind == "limits" else ()
        last = looks[-1] if looks else None
        if last is not None and (last.kind, last.joints) == (kind, joints):
            looks[-1] = ElbowArc(start=last.start, end=arc.end, kind=kind, joints=joints)
        else:
            looks.append(ElbowArc(start=arc.start, end=arc.end, kind=kind, joints=joints))
    if len(looks) > 1 and (looks[0].kind, looks[0].joints) == (looks[-1].kind, looks[-1].joints):
        first, last = looks[0], looks.pop()
        looks[0] = ElbowArc(start=last.start - math.tau, end=first.end, kind=first.kind, joints=first.joints)
    return tuple(looks)


def _kind(arc: Arc, branch: int) -> ArcKind:
    if arc.reasons:
        return _KINDS[arc.reasons[0]]
    return "free" if branch in arc.branches else "other"
