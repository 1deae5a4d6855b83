"""An arm that was stopped beyond a joint's range is led back inside, by the real virtual controller."""

from __future__ import annotations

import pytest

from rcilab import Pose, SafetyBox, check, load_model, plan_recovery, simulate
from rcilab.core.command import CartesianPosition
from rcilab.core.errors import CommandRejectedError, ControlError, PlanningError
from tests.outside import JOINT, drive_outside

MODEL = load_model("xMate3")


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize("proof", ["own check", "certificate"])
def test_recovery_ends_inside_and_the_next_move_starts(plant, proof):
    with simulate(MODEL, plant=plant) as robot:
        robot.power_on()
        drive_outside(robot)
        robot.recover()
        robot.power_on()
        for move in (lambda: robot.move_j(MODEL.home), lambda: robot.move_l(MODEL.forward(MODEL.home))):
            with pytest.raises(PlanningError, match="plan_recovery"):
                move()

        motion = plan_recovery(robot.model, robot.state.q_c)
        certificate = None if proof == "own check" else check(motion, robot.model, box=robot.safety_box).certificate
        assert robot.execute(motion, certificate).stopped is None
        assert robot.state.q_c[JOINT] < MODEL.limits.joint.upper[JOINT]
        assert robot.move_j(MODEL.home, speed=0.5).stopped is None


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_a_tool_that_was_stopped_outside_its_box_is_led_back_by_what_the_error_says(plant):
    model = load_model("xMatePro7")
    with simulate(model, plant=plant) as robot:
        robot.power_on()
        start = robot.state.T_base_tool_c
        robot.rci.set_cartesian_limit(SafetyBox(size=(0.04, 0.04, 0.04), T_base_box=Pose(start.position), active=True))
        robot.rci.set_cartesian_impedance([100.0] * 3 + [100.0] * 3)

        def hold(state, t):
            if t == 0.2:
                robot.world.push([0.0, 0.0, -20.0, 0.0, 0.0, 0.0], duration=0.3)
            return CartesianPosition(start, finished=t > 3.0)

        with pytest.raises(ControlError, match=r"plan_recovery\(.*robot\.safety_box\)") as caught:
            robot.control(hold, "cartesian_impedance")
        assert "recover() clears the fault" not in str(caught.value)
        assert robot.safety_box.excess(robot.state.T_base_tool.position) > 0.005
        with pytest.raises(CommandRejectedError, match=r"robot\.safety_box"):
            robot.recover()
        robot.power_off()
        robot.power_on()
        robot.execute(plan_recovery(robot.model, robot.state.q_c, robot.safety_box))
        assert robot.safety_box.excess(robot.state.T_base_tool_c.position) < -0.009
        robot.move_j(model.home)
