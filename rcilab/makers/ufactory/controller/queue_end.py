"""Where the queued targets end: what relative commands and unnamed axes refer to."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, isinf, sin

import numpy as np

from rcilab.core.errors import PlanningError
from rcilab.core.spatial import Pose
from rcilab.makers.ufactory.wire.poses import (
    pose_as_mm_rotation,
    pose_as_mm_rpy,
    pose_from_mm_rotation,
    pose_from_mm_rpy,
)
from rcilab.model.robot_model import RobotModel
from rcilab.motion.path import circle_through
from rcilab.sim.planner.section import PoseSolver


class QueueEnd:
    """The joint angles or the pose at the end of the last target. Owned by the controller.

    Attributes:
        solver: The inverse of the arm with its tool.

    Args:
        model: The arm with its tool.
        q: Joint angles of the stationary arm, [rad].
    """

    def __init__(self, model: RobotModel, q: Sequence[float]) -> None:
        self._model = model
        self.solver = PoseSolver(model)
        self._pose: Pose | None = None
        self.begin(q)

    def begin(self, q: Sequence[float]) -> None:
        """Sets the joint angles, n numbers, [rad]."""
        self._q, self._pose = list(q), None

    def move(self, pose: Pose) -> None:
        """Sets the pose of the tool in base; the joint angles there are those of the target before."""
        self._pose = pose

    def turn(self, via: Pose, pose: Pose, angle: float) -> None:
        """Sets the end of a circle that goes so far, [rad]; its orientation is that of the start."""
        start = self.pose
        try:
            centre, axis = circle_through(start, via, pose)
        except PlanningError:  # The planner refuses it, with the reason.
            return
        arm = start.position - centre
        x, y, z = (centre + cos(angle) * arm + sin(angle) * np.cross(axis, arm)).tolist()
        self.move(Pose.from_parts(start.parts[0], (x, y, z)))

    def solve(self, pose: Pose) -> list[float]:
        """Returns the joint angles of a pose that are nearest to the end, [rad].

        Raises:
            KinematicsError: The pose is out of reach or singular.
        """
        return self.solver.nearest(pose, self._q)

    @property
    def q(self) -> list[float]:
        """Joint angles, [rad].

        Raises:
            KinematicsError: The end is a pose out of reach or singular.
        """
        return self._q if self._pose is None else self.solve(self._pose)

    @property
    def pose(self) -> Pose:
        """Pose of the tool in base."""
        return self._model.forward(self._q) if self._pose is None else self._pose


def absolute_pose(values: Sequence[float], end: Pose, T_base_user: Pose, *, is_rotation_vector: bool) -> Pose:
    """Returns the pose in base of six numbers in the user frame; an infinite one keeps that of the end of the queue.

    Args:
        values: x, y, z in mm; roll, pitch, yaw or a rotation vector in rad.
        end: Pose of the tool in base at the end of the queue.
        T_base_user: User frame.
        is_rotation_vector: Which of both the rotation is.
    """
    if any(map(isinf, values)):
        present = (pose_as_mm_rotation if is_rotation_vector else pose_as_mm_rpy)(T_base_user.inverse() @ end)
        values = [old if isinf(new) else new for new, old in zip(values, present, strict=True)]
    return T_base_user @ (pose_from_mm_rotation(values) if is_rotation_vector else pose_from_mm_rpy(values))


def relative_pose(values: Sequence[float], end: Pose, T_base_user: Pose, *, is_rotation_vector: bool) -> Pose:
    """Returns the pose in base that is six numbers away from the end of the queue, in axes of the user frame.

    Roll, pitch and yaw are added one by one; a rotation vector turns about the axes of the user frame.
    """
    present = T_base_user.inverse() @ end
    if not is_rotation_vector:
        added = [old + new for old, new in zip(pose_as_mm_rpy(present), values, strict=True)]
        return T_base_user @ pose_from_mm_rpy(added)
    step = pose_from_mm_rotation(values)
    rotation, _ = (Pose.from_parts(step.parts[0], (0.0, 0.0, 0.0)) @ present).parts
    x, y, z = (a + b for a, b in zip(present.parts[1], step.parts[1], strict=True))
    return T_base_user @ Pose.from_parts(rotation, (x, y, z))


def tool_pose(values: Sequence[float], end: Pose, *, is_rotation_vector: bool) -> Pose:
    """Returns the pose in base of six numbers in the frame of the tool at the end of the queue."""
    return end @ (pose_from_mm_rotation(values) if is_rotation_vector else pose_from_mm_rpy(values))
