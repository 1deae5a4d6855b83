from __future__ import annotations

import numpy as np
import pytest

from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint, plan_program
from rcilab.motion.extent import measure_extent

MODEL = load_model("xMatePro7")


def test_a_program_that_returns_to_its_start_is_as_large_as_its_way() -> None:
    away = MODEL.home + np.radians([13.0, 0, 0, -5.0, 0, 0, 0])
    program = Program(model=MODEL.name, start=MODEL.home, waypoints=(Waypoint.joint(away), Waypoint.joint(MODEL.home)))
    motion = plan_program(MODEL, program)
    extent = measure_extent(motion, MODEL)
    assert extent.moving_joints == (1, 4)
    assert extent.describe_joints() == "1: 0.0° to 13.0°, 4: 55.0° to 60.0°"
    reach = np.linalg.norm(MODEL.forward(away).position - MODEL.forward(MODEL.home).position)
    assert extent.tool_distance == pytest.approx(reach, rel=1e-9)
    assert extent.duration == motion.duration
    assert extent.fastest_joint == 1
    assert extent.joint_speed == np.abs(motion.dq).max()
    twist = np.einsum("nij,nj->ni", np.array([MODEL.jacobian(q) for q in motion.q[::50]]), motion.dq[::50])
    assert extent.tool_speed == pytest.approx(np.linalg.norm(twist[:, :3], axis=1).max(), rel=0.02)
