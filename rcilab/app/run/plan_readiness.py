"""What prevents the execution of a plan, from arm and plan alone; and the description of a robot's next motion."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rcilab.app.planning import Plan
from rcilab.core.arrays import JointVector
from rcilab.i18n.translator import Message, message
from rcilab.makers.maker import commanded_start
from rcilab.motion.extent import MotionExtent, measure_extent

if TYPE_CHECKING:
    from rcilab.model.robot_model import RobotModel

_SAME_PLACE = 1e-9  # [rad] Tolerance of the check between the arm and the start of a motion.
_NOT_IDLE = {
    "starting": "ready.starting",
    "connecting": "ready.starting",
    "moving": "ready.moving",
    "stopping": "ready.moving",
    "fault": "ready.fault",
    "lost": "ready.lost",
    "crashed": "ready.lost",
    "closed": "ready.closed",
}


class ArmStatus(Protocol):
    """Position and state of an arm."""

    @property
    def phase(self) -> str:
        """Phase of the control process."""
        ...

    @property
    def q_c(self) -> JointVector | None:
        """Commanded joint angles, shape (n,), [rad]; None while unknown."""
        ...


def arm_obstacle(
    phase: str, powered: bool | None, *, is_pressed: bool = False, is_released: bool = False
) -> Message | None:
    """Returns why an arm cannot move in this phase of its control process, or None.

    Args:
        phase: Phase of the control process.
        powered: Motor power; None if unknown.
        is_pressed: Whether an emergency stop or the safety gate stops the arm.
        is_released: Whether one stopped it, and only its error bit is left.
    """
    if is_pressed and phase in ("idle", "fault"):
        return message("ready.pressed")
    if is_released:
        return message("ready.released")
    if phase in _NOT_IDLE:
        return message(_NOT_IDLE[phase])
    return None if powered else message("ready.power")


def plan_obstacle(plan: Plan | None, q_c: JointVector | None) -> Message | None:
    """Returns why a plan cannot be executed from the commanded position, [rad], or None."""
    if plan is None:
        return message("ready.no_plan")
    if not plan.report.ok:
        return message(
            "ready.violations", conditions=plan.report.violated_conditions, count=len(plan.report.violations)
        )
    if q_c is None or not _is_at(q_c, plan.starts_at, plan.model):
        if q_c is None or not is_done(plan, q_c):
            return message("ready.elsewhere")
        return message("ready.done_elbow", away=plan.away) if plan.away else message("ready.done")
    return None


def is_done(plan: Plan, q_c: JointVector) -> bool:
    """Returns whether the arm, commanded to be at q_c, [rad], is at the end of a plan."""
    return _is_at(q_c, plan.motion.goal, plan.model)


def ask_to_move(plan: Plan, address: str) -> Message:
    """Returns the description of the next motion of the robot at an address, for the question before it."""
    extent = measure_extent(plan.motion, plan.model)
    return message(
        "run.ask",
        model=plan.model.name,
        address=address,
        duration=f"{extent.duration:.2f}",
        ranges=_joint_ranges(extent),
        distance=extent.tool_distance,
        joint=extent.fastest_joint,
        angle=extent.joint_speed,
        speed=extent.tool_speed,
    )


def _joint_ranges(extent: MotionExtent) -> Message:
    ranges = [
        message("run.range", joint=joint, low=float(extent.lower[joint - 1]), high=float(extent.upper[joint - 1]))
        for joint in extent.moving_joints
    ]
    if not ranges:
        return message("run.no_range")
    return reduce(lambda first, second: message("run.ranges", first=first, second=second), ranges)


def is_moving(status: ArmStatus) -> bool:
    """Returns whether we move the arm."""
    return status.phase in ("moving", "stopping")


def _is_at(q: JointVector, place: JointVector, model: RobotModel) -> bool:
    return float(np.abs(commanded_start(place, q, model) - place).max()) <= _SAME_PLACE
