"""Collisions by the stage that a client sets: a push at the simulation port stops a moving arm, also with MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.core.errors import CommandRejectedError, ControlError
from rcilab.makers.realman.errors import RealManError
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from tests.waiting import wait_for

pytest.importorskip("Robotic_Arm", reason="needs the extra realman")

PUSH = (0.0, -60.0, 0.0, 0.0, 0.0, 0.0)
MODEL = load_model("RM65")


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_a_push_is_a_collision_above_the_threshold_of_the_stage(plant):
    with simulate(MODEL, plant=plant) as robot:

        def turn(pushed: bool) -> tuple[object, ...]:
            pending = [PUSH] if pushed else []
            goal = np.array(robot.state.q_c)
            goal[0] += 0.4 if goal[0] < 0.3 else -0.4
            motion = plan_joint(robot.model, robot.state.q_c, goal, speed=0.1)

            def push(t: float, duration: float) -> None:
                if pending and t > 0.3:
                    robot.world.push(pending.pop(), duration=0.2)

            try:
                return robot.execute(motion, progress=push).faults
            except ControlError as error:
                return error.faults

        assert turn(pushed=True) == (), "stage 0 is off"
        robot.realman.set_collision_stage(8)
        assert turn(pushed=False) == ()
        assert turn(pushed=True) == (RealManError.COLLISION,)
        assert "external torque" in robot.world.status().reason
        with pytest.raises(CommandRejectedError, match="0x100D"):
            robot.realman.move_j(MODEL.home)
        wait_for(lambda: not robot.world.status().pushed, 5.0, "the end of the push")
        for _ in range(50):  # Of 5 ms, in which the estimate of the external torque decays.
            robot.receive_state()
        robot.recover()
        robot.realman.move_j(MODEL.home)
        assert robot.state.faults == ()
