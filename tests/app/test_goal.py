"""What the page says about a target, and where the arm goes instead."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.app.goal.goal import NEAR_LIMIT, evaluate_joints, evaluate_pose, goal_toward, margin, verdict_lead
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.model.robot_model import load_model


@pytest.mark.parametrize("name", ROBOTS)
def test_a_reachable_pose_is_reached(name):
    model = load_model(name)
    rng = np.random.default_rng(3)
    for _ in range(100):
        q = rng.uniform(0.9 * model.limits.joint.lower, 0.9 * model.limits.joint.upper)
        reach = evaluate_pose(model, model.forward(q), q)
        assert reach.tone in ("good", "warn")
        assert model.forward(reach.q).is_close(model.forward(q), 1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_target_out_of_reach_says_by_how_much_and_the_arm_stretches_towards_it(name):
    model = load_model(name)
    here = model.forward(model.home)
    target = Pose(here.position + (3.0, 0.0, 0.0), here.wxyz)
    reach = evaluate_pose(model, target, model.home)
    assert reach.tone == "bad"
    assert reach.reason.code == "reach.far"
    assert reach.reason.values["distance"] > 1.0
    assert reach.missed_by is not None
    assert reach.missed_by.values["distance"] == reach.reason.values["distance"], "one miss has one number"
    assert np.linalg.norm(model.forward(reach.q).position - target.position) < 3.0
    assert (reach.q >= model.limits.joint.lower).all()
    assert (reach.q <= model.limits.joint.upper).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_dragging_along_the_edge_of_reach_never_jumps_by_more_than_the_target_does(name):
    model = load_model(name)
    q, here = model.home, model.forward(model.home)
    before = None
    for step in range(60):
        angle = 0.01 * step
        target = Pose((1.6 * math.cos(angle), 1.6 * math.sin(angle), here.position[2]), here.wxyz)
        reach = evaluate_pose(model, target, q)
        position = model.forward(reach.q).position
        if before is not None:
            assert np.linalg.norm(position - before) < 0.03
        q, before = reach.q, position


@pytest.mark.parametrize("name", ROBOTS)
def test_a_joint_near_its_limit_is_named(name):
    model = load_model(name)
    q = np.array(model.home)
    q[0] = model.limits.joint.upper[0] - 0.5 * NEAR_LIMIT
    reach = evaluate_joints(model, q)
    assert reach.tone == "warn"
    assert verdict_lead(reach.tone, reach.reason) == "reach.tone.warn"
    assert reach.reason.code == "reach.limit"
    assert reach.reason.values["joint"] == 1
    assert margin(model, q).joint == 1
    q[0] = model.limits.joint.upper[0]
    reach = evaluate_joints(model, q)
    assert (reach.reason.code, verdict_lead(reach.tone, reach.reason)) == ("reach.at_limit", "reach.tone.no_goal")


def test_a_stretched_arm_is_called_singular():
    model = load_model("xMatePro7")
    assert evaluate_joints(model, np.zeros(7)).reason.code == "reach.singular"


def test_any_target_is_answered_without_an_exception():
    model = load_model("xMatePro3")
    rng = np.random.default_rng(5)
    q = model.home
    for _ in range(150):
        wxyz = rng.normal(size=4)
        reach = evaluate_pose(model, Pose(rng.uniform(-2.0, 2.0, 3), wxyz), q)
        assert np.isfinite(reach.q).all()
        assert (reach.q >= model.limits.joint.lower).all()
        assert (reach.q <= model.limits.joint.upper).all()
        q = reach.q


def test_the_arm_angle_that_was_requested_returns_when_the_target_allows_it_again():
    model = load_model("xMatePro7")
    home = model.forward(model.home)
    asked = goal_toward(model, home, model.home, psi=1.3)
    moved = goal_toward(model, Pose(home.position + [-0.16, 0.16, 0.24], home.wxyz), asked.q, kept_psi=asked.kept_psi)
    assert moved.reach.missed_by is None
    assert moved.psi < 1.2
    assert moved.snapped is not None
    assert moved.snapped.values["wanted"] == pytest.approx(1.3)
    assert moved.snapped.values["taken"] == moved.psi
    back = goal_toward(model, home, moved.q, kept_psi=moved.kept_psi)
    assert back.psi == pytest.approx(1.3)
    assert back.snapped is None


def test_a_target_out_of_reach_leaves_the_arm_of_a_panda_in_its_plane_of_symmetry():
    model = load_model("Panda")
    home = model.forward(model.home)
    goal = goal_toward(model, home, model.home)
    for x in (0.45, 2.0, 0.7):
        target = Pose((x, 0.0, 0.5), home.wxyz)
        goal = goal_toward(model, target, goal.q, kept_psi=goal.kept_psi)
    assert goal.reach.missed_by is None
    assert goal.psi == pytest.approx(0.0, abs=1e-9)
