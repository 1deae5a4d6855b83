"""The extent of a motion: ranges and top speeds, shown before it runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.model.robot_model import RobotModel
from rcilab.motion.motion import Motion

_MIN_TRAVEL = 1e-6  # [rad] A joint that turns less counts as stationary.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MotionExtent:
    """Ranges and top speeds over the whole motion, not only between its ends."""

    duration: float
    """[s]."""
    lower: JointVector
    """Smallest angle of each joint, shape (n,), [rad]."""
    upper: JointVector
    """Largest angle of each joint, shape (n,), [rad]."""
    tool_distance: float
    """Largest distance of the tool from its start, [m]."""
    joint_speed: float
    """Top speed of any joint, [rad/s]."""
    fastest_joint: int
    """Number of that joint, from 1."""
    tool_speed: float
    """Top speed of the tool, [m/s]."""

    @property
    def moving_joints(self) -> tuple[int, ...]:
        """Numbers, from 1, of the joints that turn."""
        return tuple(int(joint) + 1 for joint in np.flatnonzero(self.upper - self.lower > _MIN_TRAVEL))

    def describe_joints(self) -> str:
        """Returns the range of each joint that turns: "1: -6.5° to 6.5°, 4: 60.0° to 75.2°"."""
        ranges = np.degrees(np.column_stack((self.lower, self.upper)))
        parts = (f"{joint}: {ranges[joint - 1, 0]:.1f}° to {ranges[joint - 1, 1]:.1f}°" for joint in self.moving_joints)
        return ", ".join(parts)


def measure_extent(motion: Motion, model: RobotModel) -> MotionExtent:
    """Returns ranges and top speeds of a motion.

    Args:
        motion: The motion.
        model: The arm, with its tool.
    """
    positions = model.position_path(motion.q)
    speeds = np.linalg.norm(np.diff(positions, axis=0), axis=1) / CYCLE_TIME
    rates = np.abs(motion.dq).max(axis=0)
    return MotionExtent(
        duration=motion.duration,
        lower=motion.q.min(axis=0),
        upper=motion.q.max(axis=0),
        tool_distance=float(np.linalg.norm(positions - positions[0], axis=1).max()),
        joint_speed=float(rates.max()),
        fastest_joint=int(rates.argmax()) + 1,
        tool_speed=float(speeds.max(initial=0.0)),
    )
