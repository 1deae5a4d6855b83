"""An arm that was stopped beyond a joint's range is led back inside, by the real virtual controller."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab import JointPosition, check, load_model, plan_joint, plan_recovery, simulate
from rcilab.errors import ControlError, PlanningError
from rcilab.faults import Fault

MODEL = load_model("xMate3")


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize("proof", ["own check", "certificate"])
def test_recovery_ends_inside_and_the_next_move_starts(plant, proof):
    upper = float(MODEL.limits.joint.upper[4])
    with simulate(MODEL, plant=plant) as robot:
        robot.power_on()
        near = robot.state.q_c.copy()
        near[4] = upper - np.radians(3.0)
        robot.execute(plan_joint(MODEL, robot.state.q_c, near, speed=0.5))
        with pytest.raises(ControlError) as stopped:
            robot.control(swing(robot.state.q_c))
        assert stopped.value.faults == (Fault.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,)
        assert robot.state.q_c[4] > upper
        robot.recover()
        robot.power_on()
        with pytest.raises(PlanningError, match="plan_recovery"):
            robot.move_j(MODEL.home)

        motion = plan_recovery(robot.model, robot.state.q_c)
        certificate = None if proof == "own check" else check(motion, robot.model, box=robot.safety_box).certificate
        assert robot.execute(motion, certificate).stopped is None
        assert robot.state.q_c[4] < upper
        assert robot.move_j(MODEL.home, speed=0.5).stopped is None


def swing(start):
    """Returns a callback that moves joint 5 out past its range, ever faster at first."""

    def command(state, t):
        q = start.copy()
        q[4] += 0.5 * (t - np.sin(2.0 * np.pi * min(t, 1.0)) / (2.0 * np.pi))
        return JointPosition(q, finished=t > 2.0)

    return command
