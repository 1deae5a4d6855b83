"""The geometry of one target: joint angles as a function of the share of its path, 0 to 1."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, hypot, pi, sin
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import KinematicsError, UnreachableError
from rcilab.core.spatial import Pose, rotation_from_wxyz
from rcilab.model.kinematics.solvers.newton import MOST_TURNED
from rcilab.model.robot_model import RobotModel
from rcilab.motion.blend import Blend
from rcilab.motion.hermite import DIFFERENCE_STEP, State, central_state
from rcilab.motion.ik_tracker import IkTracker
from rcilab.motion.path import Path, build_line
from rcilab.sim.planner.guide import Guide

_LENGTH_STEP = 0.01  # [m] Between the samples of a path of the tool; a tuning value.
_ANGLE_STEP = 0.05  # [rad] The same for its rotation.
_FEWEST, _MOST = 12, 400  # Intervals.
_BLEND_INTERVALS = 16
_LINE_STEPS = 10  # To a pose that is reached with another redundant joint.

PosePath: TypeAlias = Callable[[float], Pose]
"""Pose of the tool in base at a share, 0 to 1."""


class SectionPoint(NamedTuple):
    """A point of a section."""

    q: list[float]
    """Joint angles, n plain floats, [rad]."""
    pose: Pose | None = None
    """Pose of the tool; None for a path of the joints."""


class Section(Protocol):
    """A path from share 0 to 1."""

    @property
    def intervals(self) -> int:
        """Number of intervals after which its samples show what the joints do; 1 where they move in proportion."""
        ...

    def at(self, share: float, near: Sequence[float]) -> SectionPoint:
        """Returns the point at a share.

        Args:
            share: 0 to 1.
            near: Joint angles close to it, [rad].

        Raises:
            KinematicsError: The pose there is out of reach or singular.
        """
        ...


class PoseSolver:
    """The joint angles of a pose that are nearest to others. Owned by a planner.

    A redundant arm moves its joints least, any other stays on its branch. An arm with fewer than six joints reaches the
    position, and the orientation almost (`MOST_TURNED`).

    Args:
        model: The arm with its tool.
    """

    def __init__(self, model: RobotModel) -> None:
        self._tracker = IkTracker(model)
        self._is_redundant, self._is_short = bool(model.redundancy), model.n < 6
        self._model = model

    def next_to(self, pose: Pose, near: Sequence[float]) -> list[float]:
        """Returns the joint angles of a pose a small step away, [rad].

        Raises:
            KinematicsError: The pose is out of reach or singular.
        """
        try:
            return self._tracker.aim(pose, near) if self._is_short else self._tracker.follow(pose, near)
        except KinematicsError:
            if self._is_short:
                return self.nearest(pose, near)
            q = self._tracker.approach(pose, near)  # A path may begin at a singularity, or pass through it.
            return self.nearest(pose, near) if q is None else q

    def nearest(self, pose: Pose, near: Sequence[float]) -> list[float]:
        """Returns the joint angles of any pose, [rad].

        A redundant joint, or the arm angle, stays that of `near` if the pose is within reach with it; otherwise the
        joints move least on a straight line to the pose. So do those of an arm with fewer than six.

        Raises:
            KinematicsError: The pose is out of reach or singular.
        """
        psi = self._model.arm_angle(near) if self._is_redundant else 0.0
        try:
            return self._tracker.solve(pose, psi, near)
        except KinematicsError as error:
            if not (self._is_redundant or self._is_short):
                raise
            try:
                return self._along_line(pose, near)
            except KinematicsError:
                if isinstance(error, UnreachableError) and error.distance > 0.0:
                    raise error from None
                raise

    def _along_line(self, pose: Pose, near: Sequence[float]) -> list[float]:
        line, q = build_line(self._model.forward(near), pose), list(near)
        for step in range(1, _LINE_STEPS + 1):
            between = line.at(step / _LINE_STEPS)[0]
            if not self._is_short:
                q = self._tracker.follow(between, q)
            else:  # Only at the end the orientation counts.
                q = self._tracker.aim(between, q, most_turned=MOST_TURNED if step == _LINE_STEPS else pi)
        return q


class JointSection:
    """A straight line in joint space.

    Args:
        start: Joint angles at the start, n plain floats, [rad].
        goal: At the end, [rad].
    """

    path = None
    intervals = 1

    def __init__(self, start: Sequence[float], goal: Sequence[float]) -> None:
        self.start, self.goal = list(start), list(goal)
        self.distances = [b - a for a, b in zip(start, goal, strict=True)]

    def at(self, share: float, near: Sequence[float]) -> SectionPoint:
        """Returns the point at a share."""
        if share >= 1.0:
            return SectionPoint(self.goal)
        return SectionPoint([a + share * d for a, d in zip(self.start, self.distances, strict=True)])

    def positions(self, model: RobotModel, shares: Array) -> Array:
        """Returns positions of the tool, shape (N, 3), [m], at many shares, shape (N,)."""
        return model.position_path(np.array(self.start) + shares[:, np.newaxis] * np.array(self.distances))

    def state(self, model: RobotModel, share: float) -> State:
        """Returns joint angles and their first two derivatives by the share, each of shape (n,)."""
        distances = np.array(self.distances)
        return np.array(self.start) + share * distances, distances, np.zeros_like(distances)


class CurveSection:
    """A path of the tool.

    Args:
        poses: Its poses.
        intervals: Number of intervals after which its samples show what the joints do.
        solver: For the joint angles.
    """

    def __init__(self, poses: PosePath, intervals: int, solver: PoseSolver) -> None:
        self._poses, self._solver = poses, solver
        self.intervals = intervals
        self._guide: Guide | None = None

    def set_guide(self, guide: Guide) -> None:
        """Sets joint angles near the path, once they are known."""
        self._guide = guide

    def at(self, share: float, near: Sequence[float]) -> SectionPoint:
        """Returns the point at a share."""
        pose = self._poses(share)
        guide = self._guide
        return SectionPoint(self._solver.next_to(pose, near if guide is None else guide.at(share)), pose)


class ToolSection(CurveSection):
    """A line or an arc of the tool.

    Args:
        path: Its poses.
        solver: For the joint angles.
    """

    def __init__(self, path: Path, solver: PoseSolver) -> None:
        length = path.distance if path.unit == "m" else 0.0
        super().__init__(lambda share: path.at(share)[0], intervals_of(length, path.turn), solver)
        self.path = path

    def positions(self, model: RobotModel, shares: Array) -> Array:
        """Returns positions of the tool, shape (N, 3), [m], at many shares, shape (N,)."""
        return self.path.positions(shares)

    def state(self, model: RobotModel, share: float) -> State:
        """Returns joint angles and their first two derivatives by the share, each of shape (n,)."""
        before, here, after = (np.array(self.at(share + side * DIFFERENCE_STEP, ()).q) for side in (-1.0, 0.0, 1.0))
        return central_state(before, here, after)


def intervals_of(length: float, turn: float) -> int:
    """Returns the number of intervals of a path of the tool with a length, [m], and a turn, [rad]."""
    return int(min(max(_FEWEST, length / _LENGTH_STEP, turn / _ANGLE_STEP), _MOST))


def blend_section(blend: Blend, left: State, right: State, solver: PoseSolver) -> CurveSection | BlendOfJoints:
    """Returns the curve that rounds a corner.

    Args:
        blend: The curve.
        left: Joint angles and their derivatives by the share of the blend at its begin.
        right: At its end.
        solver: For the joint angles.
    """
    if blend.corner is None:
        return BlendOfJoints(blend)
    section = CurveSection(_BlendPoses(blend, blend.corner), _BLEND_INTERVALS, solver)
    section.set_guide(Guide.between(left, right))
    return section


class BlendOfJoints:
    """The curve of the joints that rounds a corner."""

    intervals = _BLEND_INTERVALS

    def __init__(self, blend: Blend) -> None:
        self._guide = Guide(tuple(power[np.newaxis] for power in blend.powers))

    def at(self, share: float, near: Sequence[float]) -> SectionPoint:
        """Returns the point at a share."""
        return SectionPoint(self._guide.at(share))


class _BlendPoses:
    """The poses of a blend."""

    def __init__(self, blend: Blend, corner: Pose) -> None:
        self._values = Guide(tuple(power[np.newaxis] for power in blend.powers))
        self._corner = corner

    def __call__(self, share: float) -> Pose:
        x, y, z, rx, ry, rz, _ = self._values.at(share)
        half = 0.5 * hypot(rx, ry, rz)
        scale = 0.5 * sin(half) / half if half > 0.0 else 0.5
        turn = Pose.from_parts(rotation_from_wxyz((cos(half), scale * rx, scale * ry, scale * rz)), (0.0, 0.0, 0.0))
        return Pose.from_parts((self._corner @ turn).parts[0], (x, y, z))
