from __future__ import annotations

import numpy as np
import pytest

from rcilab.kinematics.forward import build_chain
from rcilab.kinematics.twist import tool_motion
from rcilab.model import load_model
from rcilab.spatial import Pose


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7", "xMate3", "xMate7"])
@pytest.mark.parametrize("tool", [None, Pose([0.1, -0.05, 0.2], [0.9, 0.1, 0.3, 0.2])])
def test_pose_and_twist_are_those_of_forward_kinematics_and_jacobian(name: str, tool: Pose | None) -> None:
    model = load_model(name, tool=tool)
    chain, rng = build_chain(model.description.dh), np.random.default_rng(5)
    for q, dq in rng.normal(size=(50, 2, model.n)):
        pose, twist = tool_motion(chain, q.tolist(), dq.tolist(), tool)
        assert pose.is_close(model.forward(q), 1e-14)
        assert np.allclose(twist, model.jacobian(q) @ dq, rtol=0, atol=1e-12)
