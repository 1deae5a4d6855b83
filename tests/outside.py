"""An arm that a client commanded out of a joint's range, and that its controller stopped there."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab import JointPosition, RobotSession, plan_joint
from rcilab.core.errors import ControlError
from rcilab.makers.rokae.faults import Fault

JOINT = 4
"""Index of the joint that goes out."""


def drive_outside(robot: RobotSession) -> None:
    """Leaves a joint about a degree beyond its upper bound, with the fault of that and no motor power."""
    near = robot.state.q_c.copy()
    near[JOINT] = robot.model.limits.joint.upper[JOINT] - np.radians(3.0)
    robot.execute(plan_joint(robot.model, robot.state.q_c, near, speed=0.5))

    def swing(state, t):
        q = near.copy()
        q[JOINT] += 0.5 * (t - np.sin(2.0 * np.pi * min(t, 1.0)) / (2.0 * np.pi))
        return JointPosition(q, finished=t > 2.0)

    with pytest.raises(ControlError) as stopped:
        robot.control(swing)
    assert stopped.value.faults == (Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,)
    assert robot.state.q_c[JOINT] > robot.model.limits.joint.upper[JOINT]
