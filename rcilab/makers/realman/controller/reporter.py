"""The neutral state of every maker, for records and displays."""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import make_readonly
from rcilab.core.fault import FaultCode
from rcilab.core.reported_pose import ReportedPose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState, build_state
from rcilab.model.robot_model import RobotModel
from rcilab.sim.virtual_arm import CycleSignals


def report_state(
    number: int,
    model: RobotModel,
    signals: CycleSignals,
    *,
    faults: tuple[FaultCode, ...],
    motion_generator_mode: MotionGeneratorMode,
    controller_mode: ControllerMode,
    robot_mode: RobotMode,
) -> RobotState:
    """Returns the state of a cycle.

    Args:
        number: Of the cycle.
        model: The arm with its tool and load.
        signals: Of the arm.
        faults: The errors that are set.
        motion_generator_mode: What is commanded.
        controller_mode: How it is followed.
        robot_mode: What the robot does.
    """
    commanded, tool_c, measured, tool, _, _, wrench = signals
    q_c, dq_c, ddq_c = commanded.arrays
    tau_c = model.rigid_body.shared_torque(q_c, dq_c, ddq_c)
    zeros = make_readonly(np.zeros(model.n))
    return build_state(
        (
            number,
            measured.q,
            q_c,
            measured.dq,
            dq_c,
            ddq_c,
            ReportedPose(tool.matrix),
            ReportedPose(tool_c.matrix),
            make_readonly(np.array(tool_c.twist)),
            make_readonly(np.array(tool_c.acceleration)),
            tool.psi,
            tool_c.psi,
            tool_c.dpsi,
            tool_c.ddpsi,
            measured.tau,
            measured.tau,
            tau_c,
            zeros,
            wrench,
            wrench,
            measured.q,
            measured.dq,
            measured.tau,
            measured.tau,
            faults,
            1.0,
            motion_generator_mode,
            controller_mode,
            robot_mode,
        )
    )
