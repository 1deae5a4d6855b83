from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from tests.arms import CLOSED_FORM


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_a_reachable_target_is_reached(name):
    model = load_model(name)
    target = Pose(model.forward(model.home).position + [0.02, 0.05, -0.03], model.forward(model.home).wxyz)
    reach = model.closest(target, model.home)
    assert reach.refusal is None
    assert model.forward(reach.q).is_close(target, 1e-9)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_a_target_beyond_reach_is_pulled_back_and_keeps_its_orientation(name):
    model = load_model(name)
    home = model.forward(model.home)
    reach = model.closest(Pose((2.0, 0.3, 0.5), home.wxyz), model.home)
    assert reach.refusal is not None
    assert reach.refusal.distance > 0.5
    assert model.forward(reach.q).is_close(reach.pose, 1e-9)
    np.testing.assert_allclose(reach.pose.rotation, home.rotation, atol=1e-9)


@pytest.mark.parametrize("name", CLOSED_FORM)
def test_following_a_dragged_target_never_jumps(name):
    model = load_model(name)
    home = model.forward(model.home)
    q = model.home
    for share in np.linspace(0, 1, 120):
        target = Pose(home.position + share * np.array([0.9, 0.2, -0.3]), home.wxyz)
        following = model.closest(target, q).q
        assert np.abs(following - q).max() < 0.35
        q = following


def test_a_target_behind_a_joint_limit_is_approached_as_far_as_it_goes():
    model = load_model("xMatePro7")
    home = model.forward(model.home)
    target = Pose((0.3, 0.0, -0.55), home.wxyz)
    reach = model.closest(target, model.home, psi=0.0)
    assert reach.refusal is not None
    assert reach.refusal.joint is not None
    closer = np.linalg.norm(reach.pose.position - target.position)
    assert closer < np.linalg.norm(home.position - target.position)
    assert model.forward(reach.q).is_close(reach.pose, 1e-9)
