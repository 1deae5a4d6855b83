"""The reachable pose closest to a target, and why the target itself cannot be reached."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import acos, sin

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.errors import UnreachableError
from rcilab.core.spatial import Pose, wxyz_from_rotation
from rcilab.model.kinematics.solutions import Solutions
from rcilab.model.kinematics.solvers.solver import Envelope

_MAX_STRETCH = 0.999  # Share of the full reach for a projected target: a stretched arm is singular.
_FLIP = 2.5  # [rad] A larger turn of a joint leads to another branch, such as the one over the back.
_HALVINGS = 12  # Bisection steps along the line to the target: 1/4096 of it, well below a pixel.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ClosestPose:
    """The result of a search for the closest reachable pose."""

    q: JointVector
    """Joint angles, shape (n,), [rad]."""
    pose: Pose
    """Pose of the tool at q in base: the target itself, or the closest pose found."""
    solutions: Solutions | None
    """All branches at that pose; None if the current pose is the closest."""
    refusal: UnreachableError | None
    """Why the target itself cannot be reached; None if it can."""


def closest_reachable(
    solve: Callable[[Pose, bool], Solutions],
    arm: Envelope,
    T_flange_tool: Pose,
    current: Pose,
    q: JointVector,
    target: Pose,
) -> ClosestPose:
    """Returns joint angles for a target, or for the closest reachable pose.

    A target beyond the reach is moved straight towards the shoulder, with its orientation. A target outside the joint
    limits is approached along the straight line from the current pose, as far as a solution exists.

    Args:
        solve: Inverse kinematics from a tool pose; raises UnreachableError. Its second argument allows a search for
            another arm angle, which is too slow for every step of the bisection.
        arm: Lengths of the arm.
        T_flange_tool: Pose of the tool in the flange frame.
        current: Current pose of the tool in base, at q.
        q: Current joint angles, shape (n,), [rad].
        target: Desired pose of the tool in base.
    """
    try:
        found = solve(target, True)
        return ClosestPose(q=found.nearest(q), pose=target, solutions=found, refusal=None)
    except UnreachableError as error:
        refusal = error
    goal = _project_to_reach(arm, T_flange_tool, target)
    if goal is not target:
        try:
            found = solve(goal, True)
        except UnreachableError:
            pass
        else:
            nearest = found.nearest(q)
            if np.abs(nearest - q).max() <= _FLIP:
                return ClosestPose(q=nearest, pose=goal, solutions=found, refusal=refusal)
    return _approach(solve, current, q, goal, refusal)


def _approach(
    solve: Callable[[Pose, bool], Solutions], current: Pose, q: JointVector, goal: Pose, refusal: UnreachableError
) -> ClosestPose:
    """Returns the last reachable pose on the line from the current pose to an unreachable goal, by bisection."""
    best = ClosestPose(q=q, pose=current, solutions=None, refusal=refusal)
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        pose = interpolate(current, goal, middle)
        try:
            found = solve(pose, False)
        except UnreachableError:
            high = middle
            continue
        nearest = found.nearest(best.q)
        if np.abs(nearest - best.q).max() > _FLIP:
            high = middle
        else:
            low = middle
            best = ClosestPose(q=nearest, pose=pose, solutions=found, refusal=refusal)
    return best


def interpolate(a: Pose, b: Pose, share: float) -> Pose:
    """Returns the pose at a share (0 to 1) from a to b: position on the line, orientation by slerp."""
    (ra, pa), (rb, pb) = a.parts, b.parts
    qa, qb = wxyz_from_rotation(ra), wxyz_from_rotation(rb)
    dot = sum(x * y for x, y in zip(qa, qb, strict=True))
    if dot < 0.0:
        qb, dot = tuple(-x for x in qb), -dot
    angle = acos(min(1.0, dot))
    if angle < 1e-9:
        wa, wb = 1.0 - share, share
    else:
        wa, wb = sin((1.0 - share) * angle) / sin(angle), sin(share * angle) / sin(angle)
    return Pose(
        [(1.0 - share) * x + share * y for x, y in zip(pa, pb, strict=True)],
        [wa * x + wb * y for x, y in zip(qa, qb, strict=True)],
    )


def _project_to_reach(arm: Envelope, T_flange_tool: Pose, target: Pose) -> Pose:
    """Returns the target moved so that its wrist centre is inside the reachable shell."""
    r, (x, y, z) = (target @ T_flange_tool.inverse()).parts
    wx, wy, wz = x - arm.hand * r[2], y - arm.hand * r[5], z - arm.hand * r[8] - arm.shoulder
    length = (wx * wx + wy * wy + wz * wz) ** 0.5
    longest = _MAX_STRETCH * (arm.upper + arm.fore)
    shortest = abs(arm.upper - arm.fore) / _MAX_STRETCH
    clamped = min(max(length, shortest), longest)
    if length == 0.0 or clamped == length:
        return target
    scale = clamped / length - 1.0
    rotation, (px, py, pz) = target.parts
    return Pose.from_parts(rotation, (px + scale * wx, py + scale * wy, pz + scale * wz))
