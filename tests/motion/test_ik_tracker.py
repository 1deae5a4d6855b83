"""The inverse that follows a branch, and the closed-form singularities against the Jacobian's rank."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.errors import SingularError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.spherical.inverse import build_geometry
from rcilab.model.kinematics.solvers.spherical.singularity import find_singularity
from rcilab.model.robot_model import load_model
from rcilab.motion.ik_tracker import IkTracker

NAMES = ["xMatePro3", "xMatePro7", "xMate3", "xMate7"]
TOOL = Pose([0.1, 0.0, 0.2], [0.9, 0.1, 0.0, 0.2])
QUARTER = math.pi / 2.0


@pytest.mark.parametrize("name", NAMES)
def test_forward_and_back_is_the_same_branch(name: str) -> None:
    model = load_model(name, tool=TOOL)
    follower, geometry, rng = IkTracker(model), build_geometry(model.description), np.random.default_rng(7)
    count = 0
    for q in rng.uniform(model.limits.joint.lower, model.limits.joint.upper, (500, model.n)):
        if find_singularity(geometry, q.tolist()) is not None:
            continue
        psi = model.arm_angle(q) if model.n == 7 else 0.0
        near = q + rng.normal(scale=3e-3, size=model.n)
        assert np.allclose(follower.solve(model.forward(q), psi, near.tolist()), q, rtol=0, atol=1e-8)
        count += 1
    assert count > 400


@pytest.mark.parametrize("turns", [-1, 1])
def test_full_turns_of_the_last_joint_are_counted(turns: int) -> None:
    model = load_model("xMatePro7")
    q = model.home.copy()
    q[6] = turns * math.radians(300.0)
    found = IkTracker(model).solve(model.forward(q), model.arm_angle(q), (q - 1e-3).tolist())
    assert np.allclose(found, q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_out_of_reach_or_singular_is_refused_in_words(name: str) -> None:
    model = load_model(name)
    follower, home = IkTracker(model), model.home.tolist()
    with pytest.raises(UnreachableError, match="out of reach"):
        follower.solve(Pose((2.0, 0.0, 0.5)), 0.0, home)
    wrist = 5 if model.n == 7 else 4
    q = np.array(home)
    q[wrist - 2] = 1e-3
    with pytest.raises(SingularError, match="stretched"):
        follower.solve(model.forward(q), model.arm_angle(q) if model.n == 7 else 0.0, q.tolist())


SEVEN = [{3: 0.0}, {1: 0.0, 2: QUARTER}, {5: 0.0, 4: QUARTER}, {1: 0.0, 5: 0.0}]
SIX = [{2: 0.0}, {4: 0.0}, {1: 0.0, 2: math.pi}]


@pytest.mark.parametrize(
    ("name", "fixed"), [*(("xMatePro7", fixed) for fixed in SEVEN), *(("xMate7", fixed) for fixed in SIX[:2])]
)
def test_named_singularities_are_where_the_jacobian_loses_rank(name: str, fixed: dict[int, float]) -> None:
    model = load_model(name)
    geometry = build_geometry(model.description)
    q = np.random.default_rng(3).uniform(0.3, 1.0, model.n)
    assert find_singularity(geometry, q.tolist()) is None
    assert model.dexterity(q).smallest > 1e-3
    for joint, angle in fixed.items():
        q[joint] = angle
    assert find_singularity(geometry, q.tolist()) is not None
    assert model.dexterity(q).smallest < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_where_none_is_named_the_tool_can_be_moved_in_every_direction(name: str) -> None:
    model = load_model(name)
    geometry, rng = build_geometry(model.description), np.random.default_rng(11)
    for q in rng.uniform(model.limits.joint.lower, model.limits.joint.upper, (1000, model.n)):
        if find_singularity(geometry, q.tolist()) is None:
            assert model.dexterity(q).smallest > 1e-4


@pytest.mark.parametrize("name", ["Panda", "FR3"])
def test_with_a_joint_as_redundancy_the_solution_is_that_of_the_solver(name: str) -> None:
    model, rng = load_model(name, tool=TOOL), np.random.default_rng(5)
    limits, tracker, count = model.limits.joint, IkTracker(model), 0
    for q in rng.uniform(limits.lower, limits.upper, (300, model.n)):
        if model.solver.singularity(q.tolist()) is not None:
            continue
        near = q + rng.normal(scale=1e-3, size=model.n)
        found = tracker.solve(model.forward(q), model.arm_angle(q), near.tolist())
        assert model.forward(found).is_close(model.forward(q), 1e-10)
        assert found[2] == q[2]
        assert np.allclose(found, q, rtol=0, atol=1e-6)  # Weakly determined near a singularity.
        count += 1
    assert count > 200


def test_a_pose_far_from_the_last_one_is_that_of_the_solver() -> None:
    model = load_model("FR3")
    q = model.home + 0.4
    found = IkTracker(model).solve(model.forward(q), model.arm_angle(q), model.home.tolist())
    assert model.forward(found).is_close(model.forward(q), 1e-11)


@pytest.mark.parametrize("name", ["xMatePro7", "FR3"])
def test_without_a_redundancy_angle_the_joints_move_least(name: str) -> None:
    model = load_model(name, tool=TOOL)
    q = model.home + 0.2
    goal = Pose.from_rpy([1e-4, -2e-4, 1e-4], [1e-4, 0.0, 3e-4]) @ model.forward(q)
    found = np.array(IkTracker(model).follow(goal, q.tolist()))
    assert model.forward(found).is_close(goal, 1e-12)
    *_, null = np.linalg.svd(model.jacobian(q))[2]
    assert abs(null @ (found - q)) < 1e-3 * np.linalg.norm(found - q)


def test_without_a_redundancy_angle_a_stretched_arm_is_singular() -> None:
    model = load_model("xMatePro7")
    q = np.array(model.home)
    q[3] = 0.0
    with pytest.raises(SingularError, match="every direction"):
        IkTracker(model).follow(model.forward(q), q.tolist())
