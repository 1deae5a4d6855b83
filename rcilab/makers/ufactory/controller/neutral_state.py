"""The state of every maker, for records and displays."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.arrays import make_readonly
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.makers.ufactory.controller.modes import Mode, State

if TYPE_CHECKING:
    from rcilab.makers.ufactory.controller.xarm_controller import XArmController

_GENERATORS = {
    Mode.POSITION: MotionGeneratorMode.JOINT_POSITION,
    Mode.SERVO: MotionGeneratorMode.JOINT_POSITION,
    Mode.TEACH: MotionGeneratorMode.IDLE,
    Mode.JOINT_VELOCITY: MotionGeneratorMode.JOINT_VELOCITY,
    Mode.CARTESIAN_VELOCITY: MotionGeneratorMode.CARTESIAN_VELOCITY,
    Mode.JOINT_ONLINE: MotionGeneratorMode.JOINT_POSITION,
    Mode.CARTESIAN_ONLINE: MotionGeneratorMode.CARTESIAN_POSITION,
}


def build_neutral_state(controller: XArmController) -> RobotState:
    """Returns the state of this cycle."""
    commanded, tool_c, measured, tool, _, _, wrench = controller.arm.signals
    q_c, dq_c, ddq_c = commanded.arrays
    rates = make_readonly(np.array([*tool_c.twist, *tool_c.acceleration]))
    shown = controller.shown_state
    is_moving = controller.is_moving
    zeros = np.zeros(len(q_c))
    if controller.error is not None:
        robot_mode = RobotMode.REFLEX
    elif controller.mode is Mode.TEACH and shown is State.READY:
        robot_mode = RobotMode.GUIDING
    else:
        robot_mode = RobotMode.MOVE if is_moving else RobotMode.IDLE
    return build_state(
        (
            controller.cycle_number,
            measured.q,
            q_c,
            measured.dq,
            dq_c,
            ddq_c,
            ReportedPose(tool.matrix),
            ReportedPose(tool_c.matrix),
            rates[:6],
            rates[6:],
            tool.psi,
            tool_c.psi,
            tool_c.dpsi,
            tool_c.ddpsi,
            measured.tau,
            measured.tau,
            measured.tau,
            zeros,
            wrench,
            wrench,
            measured.q,
            measured.dq,
            measured.tau,
            measured.tau,
            controller.faults,
            1.0,
            _GENERATORS[controller.mode] if is_moving else MotionGeneratorMode.IDLE,
            ControllerMode.JOINT_POSITION if is_moving else ControllerMode.OTHER,
            robot_mode,
        )
    )
