"""The joint angles of a motion that is sent as poses without the arm angle: the controller chooses it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rcilab.conformance.common_conditions import condition_table
from rcilab.core.state import Mode
from rcilab.model.robot_model import RobotModel
from rcilab.motion.inverse_path import free_inverse_path
from rcilab.motion.motion import Motion

_SAME = 1e-9  # [rad] To which the inverse of its own result comes.


def leaves_elbow_free(model: RobotModel, mode: Mode | str) -> bool:
    """Returns whether a motion in a mode is sent as poses without the arm angle, which the controller leaves free."""
    table = condition_table(model.description)
    is_free = table.has_free_elbow and not table.sends_arm_angle
    return is_free and bool(model.redundancy) and mode.startswith("cartesian")


def resulting_motion(motion: Motion, model: RobotModel, mode: Mode) -> Motion:
    """Returns a motion with the joint angles that the arm will have, which move least; without a free elbow, as it is.

    It ends before the first pose that is out of reach or singular. A motion that has these joint angles already is
    returned as it is. About 0.1 ms per row.

    Args:
        motion: The motion; the arm is at its start.
        model: The arm, with its tool.
        mode: Mode in which it is sent.
    """
    if len(motion) < 2 or not leaves_elbow_free(model, mode):
        return motion
    free = np.full(len(motion) - 1, np.nan)
    q = free_inverse_path(model, model.forward_path(motion.q[1:]), free, motion.start)
    if len(q) == len(free) and np.abs(q - motion.q[1:]).max() <= _SAME:
        return motion
    found = Motion.from_cycles(np.concatenate((motion.q[:1], q)))
    return replace(found, speed=motion.speed, segment_starts=motion.segment_starts, notes=motion.notes)
