"""Paths that begin at a singularity, as those of arms do whose zero pose is one."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import KinematicsError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.sim.planner.section import PoseSolver


@pytest.mark.parametrize("name", ["xMatePro3", "xMate3"])
def test_a_path_leaves_a_singular_wrist_without_turning_it(name: str) -> None:
    model = load_model(name)
    q = np.array(model.home)
    q[-2] = 0.0  # Axes 4 and 6, or 5 and 7, are one line.
    solver, start = PoseSolver(model), model.forward(q)
    near = q.tolist()
    for step in range(1, 6):
        ahead = model.forward(q).inverse() @ start
        turned = q.copy()
        turned[-2] = 0.02 * step
        near = solver.next_to(model.forward(turned) @ ahead, near)
        np.testing.assert_allclose(near, turned, atol=1e-6)


def test_a_pose_out_of_reach_is_refused() -> None:
    model = load_model("xMate3")
    far = Pose.from_parts(model.forward(model.home).parts[0], (3.0, 0.0, 0.0))
    with pytest.raises(KinematicsError):
        PoseSolver(model).next_to(far, model.home.tolist())
