"""The bound on the tool's velocity in motions that are commanded in joint angles (`Limits.joint_tool_velocity`)."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from rcilab.core.arrays import Array, JointPath
from rcilab.core.clock import CYCLE_TIME
from rcilab.model.robot_model import RobotModel

TOOL_VELOCITY_PART = 0.85
"""Part of the bound that planned motions and jogs use.

Tuning value: a controller with this bound measures the tool on its own curve through the targets, which needs room to
make up for those that arrive late.
"""


def tool_excess(model: RobotModel, path: JointPath) -> Array:
    """Returns the used share of `TOOL_VELOCITY_PART` of the bound, from each row to the next, shape (N - 1,).

    Args:
        model: The arm, with its tool.
        path: Joint angles in consecutive cycles, shape (N, n), [rad].
    """
    steps = np.diff(model.position_path(path), axis=0)
    return np.linalg.norm(steps, axis=1) / (CYCLE_TIME * TOOL_VELOCITY_PART * model.limits.joint_tool_velocity)


class JointSpeedGovernor:
    """Keeps the tool below the bound while every joint accelerates by itself, in whatever order the joints do.

    A joint moves the tool at most by its speed times its lever, the largest distance of the tool from its axis. The sum
    over the joints stays below the bound, each with the larger one of the speed that it has and that it is to have.

    Args:
        model: The arm, with its tool.
        bound: Of the tool, [m/s].
        jerk: Of the joints, [rad/s^3].
    """

    def __init__(self, model: RobotModel, bound: float, jerk: Sequence[float]) -> None:
        self._bound, self._jerk = TOOL_VELOCITY_PART * bound, list(jerk)
        self._levers: list[float] = []
        beyond = float(np.linalg.norm(model.T_flange_tool.position))
        for row in reversed(model.description.dh):
            self._levers.insert(0, abs(row.a) + beyond)
            beyond += hypot(row.a, row.d)

    def part(self, speeds: Sequence[float], dq: Sequence[float], ddq: Sequence[float]) -> float:
        """Returns which part of their speeds the joints may have, 0 to 1.

        Args:
            speeds: That they should have, 0 or more, n numbers, [rad/s].
            dq: Their velocities, [rad/s].
            ddq: Their accelerations, [rad/s^2].
        """
        # While a joint removes its acceleration, its velocity still changes by ddq^2 / (2 jerk).
        peaks = [abs(v) + a * a / (2.0 * j) for v, a, j in zip(dq, ddq, self._jerk, strict=True)]
        part = 1.0
        while part > 0.0:  # Newton's method on a convex, piecewise linear sum: it ends after a few steps.
            fixed = slope = 0.0
            for lever, peak, speed in zip(self._levers, peaks, speeds, strict=True):
                if part * speed > peak:
                    slope += lever * speed
                else:
                    fixed += lever * peak
            allowed = (self._bound - fixed) / slope if slope > 0.0 else 1.0
            if allowed >= part:
                break
            part = max(allowed, 0.0)
        return part
