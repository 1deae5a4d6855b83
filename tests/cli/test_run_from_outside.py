"""`rcilab run --to-start` for an arm that was stopped a little beyond the range of a joint."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rcilab import JointPosition, load_model, plan_joint
from rcilab.cli import main
from rcilab.control_process.launch import start_controller
from rcilab.core.errors import ControlError
from rcilab.execution.connect import connect

MODEL = load_model("xMate3")


@pytest.mark.parametrize("speed", [0.5, 1.5])  # Recovered, and too far outside for that: the power is switched.
def test_the_way_to_the_start_leads_back_inside_the_joint_ranges_first(tmp_path, capsys, speed):
    near = MODEL.home.copy()
    near[4] = MODEL.limits.joint.upper[4] - np.radians(3.0)

    def swing(state, t):
        q = near.copy()
        q[4] += speed * (t - np.sin(2.0 * np.pi * min(t, 1.0)) / (2.0 * np.pi))
        return JointPosition(q, finished=t > 2.0)

    file = tmp_path / "motion.csv"
    plan_joint(MODEL, MODEL.home, MODEL.home + 0.1, speed=1.0).save(file)
    controller = start_controller(MODEL.name, lockstep=True)
    try:
        with connect(controller.address, MODEL) as robot:
            robot.power_on()
            robot.execute(plan_joint(MODEL, robot.state.q_c, near))
            with pytest.raises(ControlError):
                robot.control(swing)
            assert robot.state.q_c[4] > MODEL.limits.joint.upper[4]
        assert main(["run", str(file), "--robot", controller.address, "--yes", "--to-start", "--json"]) == 0
        moves = json.loads(capsys.readouterr().out)["moves"]
        assert [move["outcome"] for move in moves] == ["done"] * 3
    finally:
        controller.end()
