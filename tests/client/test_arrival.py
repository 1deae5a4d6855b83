"""A motion that did not arrive says so, whatever it was sent as: an arm angle counts, and so do torques."""

import numpy as np
import pytest

from rcilab.errors import ControlError
from rcilab.model import load_model
from rcilab.motion import plan_joint, plan_nullspace
from rcilab.protocols.world import NetworkFaults
from rcilab.supervisor.simulate import simulate

MODEL = load_model("xMatePro7")


def test_an_arm_angle_that_a_filter_holds_back_is_waited_for_or_reported():
    with simulate(MODEL) as robot:
        robot.power_on()
        robot.set_filters(0.5, 0.5, 0.5)
        robot.execute(plan_nullspace(MODEL, robot.state.q_c, 0.5), mode="cartesian_position")
        assert robot.state.psi_c == pytest.approx(0.5, abs=1e-5)
        robot.move_l(robot.state.T_base_tool_c, psi=0.2)
        assert robot.state.psi_c == pytest.approx(0.2, abs=1e-5)


@pytest.mark.parametrize("mode", ["cartesian_position", "torque"])
def test_commands_that_were_all_lost_are_no_success(mode):
    with simulate(MODEL, lockstep=False) as robot:
        robot.power_on()
        motion = plan_nullspace(MODEL, MODEL.home, 0.3)
        if mode == "torque":
            motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.1, law="torque_rate_limited")
        robot.world.set_network(NetworkFaults(loss=1.0), "commands")
        with pytest.raises(ControlError, match=r"did not arrive.*played none of the commands"):
            robot.execute(motion, mode=mode)
        assert np.array_equal(robot.state.q_c, MODEL.home) or mode == "torque"
