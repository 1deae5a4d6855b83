"""One step of a jog: where a press leads, or why it does not move the arm."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rcilab.app.goal.goal import evaluate_pose
from rcilab.app.jog.jog_state import AXES, Axis, Frame, JogState, at_limit
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message, message
from rcilab.motion.online import POSITION_MARGIN

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_MIN_STEP = 1e-9  # [rad] A smaller step counts as none.
_FARTHEST = math.radians(20.0)  # A joint that turns more for a step of the tool would take the arm far from here.


@dataclass(frozen=True, eq=False)
class JogStepResult:
    """Where a step leads."""

    q: JointVector | None
    """Shape (n,), [rad]; None: no step."""
    sentence: Message | None = None
    """The limit that prevents it, or why there is no step."""


def take_step(model: RobotModel, q: JointVector, jog: JogState, axis: Axis) -> JogStepResult:
    """Returns where one press of a button leads from joint angles `q`.

    A joint moves as far as its range allows; a tool makes a whole step or none.
    """
    joint = axis.joint
    if joint is None:
        reach = evaluate_pose(model, step_pose(model.forward(q), axis, jog.step, jog.frame), q)
        if reach.tone == "bad":
            return JogStepResult(None, message("jog.no_way", reason=reach.reason))
        turns = np.abs(reach.q - q)
        if turns.max() > _FARTHEST:
            farthest = int(turns.argmax())
            angle = float(turns[farthest])
            return JogStepResult(None, message("jog.far", joint=farthest + 1, angle=angle))
        return JogStepResult(reach.q)
    limits, moved = model.limits.joint, np.array(q)
    low, high = limits.lower[joint] + POSITION_MARGIN, limits.upper[joint] - POSITION_MARGIN
    moved[joint] = min(max(q[joint] + math.radians(axis.sign * jog.step), low), high)
    is_further = axis.sign * (moved[joint] - q[joint]) > _MIN_STEP
    return JogStepResult(readonly_copy(moved) if is_further else None, at_limit(model, readonly_copy(moved), axis))


def step_pose(T_base_tool: Pose, axis: Axis, step: float, frame: Frame) -> Pose:
    """Returns a pose that is moved along, or turned about, one axis of the base or of the tool.

    Args:
        T_base_tool: The pose.
        axis: One of `AXES`; a turn leaves the tip where it is.
        step: Size of the step, [mm] or [deg].
        frame: Frame of the axis.
    """
    index, amount = AXES.index(axis.name), axis.sign * step
    along, about = np.zeros(3), np.zeros(3)
    if index < 3:
        along[index] = amount / 1000.0
    else:
        about[index - 3] = math.radians(amount)
    turn = Pose.from_rpy(np.zeros(3), about)
    if frame == "tool":
        return T_base_tool @ Pose(along) @ turn
    return Pose(T_base_tool.position + along, (turn @ Pose(wxyz=T_base_tool.wxyz)).wxyz)
