"""The inverse of 6 axes with an offset wrist (xArm6), and without one but with an elbow (Lite6, 850)."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import ModelError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.kinematics.solvers.offset6.arm import build_offset_six
from rcilab.model.kinematics.solvers.offset6.inverse import DEGREE, polynomial, solve_poses
from rcilab.model.kinematics.solvers.offset6.solver import OffsetSix
from rcilab.model.robot_model import load_model

POSES = 1000
TOLERANCE = 1e-9  # [m] and rotation elements.
ARMS = ("xArm6", "Lite6", "850")
arms = pytest.mark.parametrize("name", ARMS)


def random_poses(name, seed):
    model = load_model(name)
    limits = model.limits.joint
    q = np.random.default_rng(seed).uniform(limits.lower, limits.upper, (POSES, 6))
    return model, q, model.forward_path(q)


def turned(angle):
    return np.abs((angle + np.pi) % (2.0 * np.pi) - np.pi)


@arms
def test_every_solution_gives_the_pose_back_and_that_of_the_pose_is_among_them(name):
    model, q, T = random_poses(name, 1)
    rows, found = solve_poses(build_offset_six(model.description), T[:, :3, :3], T[:, :3, 3])
    assert np.abs(model.forward_path(found) - T[rows]).max() < TOLERANCE
    distance = np.full(POSES, np.inf)
    np.minimum.at(distance, rows, turned(found - q[rows]).max(axis=1))
    assert distance.max() < 1e-6  # Conditioning near singular poses costs digits.


@arms
def test_the_solver_gives_each_solution_once_one_by_one_and_in_a_batch(name):
    model, _, T = random_poses(name, 2)
    solver = build_solver(model.description)
    assert isinstance(solver, OffsetSix)
    table = solver.batch(T[:100], np.zeros(100))
    for row, pose in zip(table, T[:100], strict=True):
        alone = solver.at(Pose.from_matrix(pose), None).branches(0.0)
        assert len(alone) == np.isfinite(row[:, 0]).sum() >= 2
        np.testing.assert_allclose(sorted(alone), sorted(row[: len(alone)].tolist()), atol=1e-8)
        apart = [turned(np.subtract(a, b)).max() for i, a in enumerate(alone) for b in alone[:i]]
        assert min(apart) > 1e-5
    if name != "xArm6":  # A spherical wrist: both sides, both elbows, both wrists.
        assert np.isfinite(table).all(axis=2).sum(axis=1).tolist() == [8] * 100


def test_an_offset_wrist_has_up_to_16_solutions():
    model, _, T = random_poses("xArm6", 1)
    rows, _ = solve_poses(build_offset_six(model.description), T[:, :3, :3], T[:, :3, 3])
    counts = np.bincount(rows, minlength=POSES)
    assert counts.min() >= 2
    table = build_solver(model.description).batch(T, np.zeros(POSES))
    assert table.shape[1] == 16


def test_higher_terms_of_the_polynomial_cancel():
    model, _, T = random_poses("xArm6", 3)
    angles = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    values = polynomial(build_offset_six(model.description), T[:, :3, :3], T[:, :3, 3], angles)
    terms = np.abs(np.fft.rfft(values, axis=1))
    share = (terms / terms.max(axis=1, keepdims=True)).max(axis=0)
    assert share[DEGREE] > 1e-3
    assert share[DEGREE + 1 :].max() < 1e-9


@pytest.mark.parametrize("name", ["Lite6", "850"])
def test_with_axes_4_and_6_in_line_joint_4_stays_where_it_is(name):
    model = load_model(name)
    q = model.home.copy()
    q[3:] = 0.7, 0.0, -0.4
    solution = model.inverse(model.forward(q), near=q).nearest(q)
    np.testing.assert_allclose(solution, q, atol=1e-7)


@arms
def test_a_wrist_above_the_shoulder_leaves_joint_1_where_it_is(name):
    model = load_model(name)
    geometry = build_offset_six(model.description)
    q = model.home.copy()
    q[:2] = 0.3, 0.0
    q[2] = np.arccos(0.0) if name == "Lite6" else -np.arccos(0.0)
    assert model.forward(model.inverse(model.forward(q), near=q).nearest(q)).is_close(model.forward(q), TOLERANCE)
    assert geometry.shoulder == model.description.dh[0].d


def test_an_arm_of_another_build_is_refused():
    with pytest.raises(ModelError, match="parallel axes 2 and 3"):
        build_offset_six(load_model("xArm7").description)
