from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, KinematicsError, SingularError
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES

TOOL = Pose.from_rpy((0.03, -0.02, 0.12), (0.3, -0.4, 0.5))


def configurations(model, count=50, seed=7):
    limits = model.limits.joint
    return np.random.default_rng(seed).uniform(limits.lower, limits.upper, (count, model.n))


@pytest.mark.parametrize("name", ROBOTS)
def test_at_zero_the_arm_stands_upright(name):
    model = load_model(name)
    height = {"3": 1.3518, "7": 1.5295}[name[-1]]
    assert model.forward(np.zeros(model.n)).is_close(Pose((0, 0, height)), 1e-12)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_the_path_of_the_tools_origin_is_that_of_its_poses(name):
    model = load_model(name, tool=TOOL)
    q = configurations(model)
    np.testing.assert_allclose(model.position_path(q), model.forward_path(q)[:, :3, 3], atol=1e-12)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_path_frames_and_single_pose_agree(name):
    model = load_model(name, tool=TOOL)
    q = configurations(model)
    for row, T in zip(q, model.forward_path(q), strict=True):
        np.testing.assert_allclose(model.forward(row).matrix, T, atol=1e-14)
        np.testing.assert_allclose((model.joint_frames(row)[-1] @ TOOL).matrix, T, atol=1e-14)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_jacobian_is_the_derivative_of_the_tool_pose(name):
    model = load_model(name, tool=TOOL)
    step = 1e-6  # [rad] Balances truncation (step**2) against rounding (1e-16 / step) near 1e-9.
    for q in configurations(model, 20):
        J = model.jacobian(q)
        R = model.forward(q).rotation
        for joint in range(model.n):
            shift = np.eye(model.n)[joint] * step
            ahead, behind = model.forward(q + shift), model.forward(q - shift)
            np.testing.assert_allclose((ahead.position - behind.position) / (2 * step), J[:3, joint], atol=1e-8)
            turn = (ahead.rotation - behind.rotation) / (2 * step) @ R.T
            np.testing.assert_allclose([turn[2, 1], turn[0, 2], turn[1, 0]], J[3:, joint], atol=1e-8)


def test_arm_angle_is_zero_with_the_elbow_above_and_pi_below():
    model = load_model("xMatePro7")
    assert model.arm_angle([0, 0.5, 0, 1.0, 0, 0.5, 0]) == pytest.approx(0, abs=1e-12)
    assert abs(model.arm_angle([0, 1.5, 0, -1.0, 0, 0.5, 0])) == pytest.approx(np.pi, abs=1e-12)


def test_arm_angle_without_a_meaning_is_a_named_error():
    model = load_model("xMatePro7")
    with pytest.raises(SingularError, match="stretched"):
        model.arm_angle([0, 0.5, 0, 0, 0, 0, 0])
    with pytest.raises(SingularError, match="above each other"):
        model.arm_angle(np.zeros(7))
    with pytest.raises(KinematicsError, match="6 axes"):
        load_model("xMate3").arm_angle(np.zeros(6))


@pytest.mark.parametrize("bad", [[0, 0, 0], [np.nan] * 7, [np.inf] * 7, "home", None, [[0] * 7]])
def test_joint_angles_that_are_none_are_refused_by_name(bad):
    with pytest.raises(InvalidValueError, match="q"):
        load_model("xMatePro7").forward(bad)


def test_an_array_that_is_not_finite_is_refused_on_the_fast_way_too():
    with pytest.raises(InvalidValueError, match="finite"):
        load_model("xMatePro7").forward(np.array([0, 0, 0, np.nan, 0, 0, 0]))


def test_manipulability_vanishes_where_the_arm_is_stretched():
    model = load_model("xMatePro7")
    assert model.manipulability(np.zeros(7)) < 1e-9
    assert model.manipulability(model.home) > 0.01


@pytest.mark.parametrize("give", [list, tuple, np.array])
def test_degrees_by_mistake_are_not_taken_for_radians(give):
    model = load_model("xMatePro7")
    degrees = [0.0, 30.0, 0.0, 60.0, 0.0, 90.0, 0.0]
    for method in (model.forward, model.arm_angle):
        with pytest.raises(InvalidValueError, match=r"q of joint 6: 90\.0 rad is more than two turns; .* np\.radians"):
            method(give(degrees))
    assert model.forward(np.radians(degrees)).is_close(model.forward(model.home), 1e-12)
