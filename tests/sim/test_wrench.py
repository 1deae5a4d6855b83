from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.sim.wrench import wrench_at, wrench_in

WRENCH = np.array([3.0, -5.0, 7.0, 0.1, 0.2, -0.3])
T_BASE_TOOL = Pose.from_rpy([0.4, 0.1, 0.5], [0.3, -0.7, 2.0])
T_TOOL_K = Pose.from_rpy([0.02, -0.05, 0.1], [-1.0, 0.4, 0.2])


def test_a_wrench_at_another_point_and_in_other_axes_does_the_same_work() -> None:
    """For the twist of any rigid motion, taken at the same point and in the same axes."""
    T_base_K, rng = T_BASE_TOOL @ T_TOOL_K, np.random.default_rng(1)
    moved = wrench_at(WRENCH, T_BASE_TOOL.parts[1], T_base_K.parts[1])
    turned = wrench_in(moved, T_base_K.parts[0])
    for v, w in rng.normal(size=(20, 2, 3)):
        at_K = v + np.cross(w, T_base_K.position - T_BASE_TOOL.position)
        power = WRENCH @ np.concatenate((v, w))
        assert moved @ np.concatenate((at_K, w)) == pytest.approx(power)
        R = T_base_K.rotation
        assert turned @ np.concatenate((R.T @ at_K, R.T @ w)) == pytest.approx(power)


def test_a_force_to_the_side_of_a_point_is_a_moment_there() -> None:
    push = np.array([0.0, 0.0, -10.0, 0.0, 0.0, 0.0])
    assert wrench_at(push, (0.1, 0.0, 0.0), (0.0, 0.0, 0.0)) == pytest.approx([0.0, 0.0, -10.0, 0.0, 1.0, 0.0])
