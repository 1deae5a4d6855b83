"""An arm that was stopped beyond a joint's range is led back inside, by the real virtual controller."""

from __future__ import annotations

import pytest

from rcilab import check, load_model, plan_recovery, simulate
from rcilab.errors import PlanningError
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
