"""The Panda's inverse at a held elbow: one polynomial of degree 8 in joint 7, and nothing of it is overlooked."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.offset7.arm import build_offset_geometry, trace, wrapped
from rcilab.model.kinematics.solvers.offset7.inverse import DEGREE, polynomial, solve_held
from rcilab.model.kinematics.solvers.offset7.singularity import held_singularity, held_singularity_path
from rcilab.model.robot_model import load_model

PANDA = load_model("Panda")
ARM = build_offset_geometry(PANDA.description)
LIMITS = PANDA.limits.joint


@pytest.fixture(scope="module")
def case():
    """Random configurations, their poses, and all solutions at their elbows."""
    q = np.random.default_rng(11).uniform(LIMITS.lower, LIMITS.upper, (600, 7))
    T = PANDA.forward_path(q)
    return q, T, *solve_held(ARM, T[:, :3, :3], T[:, :3, 3], q[:, 2])


def test_the_polynomial_is_of_degree_8_and_its_higher_orders_cancel_to_rounding(case):
    q, T, _, _ = case
    values = polynomial(ARM, T[:, :3, :3], T[:, :3, 3], q[:, 2], np.arange(64) * (math.tau / 64))
    sizes = np.abs(np.fft.rfft(values, axis=1))
    assert (sizes[:, DEGREE + 1 :].max(axis=1) < 1e-13 * sizes.max(axis=1)).all()
    assert (sizes[:, DEGREE] > 1e-13 * sizes.max(axis=1)).mean() > 0.9


def test_every_solution_has_the_pose_and_the_elbow_and_each_is_there_once(case):
    q, T, rows, found = case
    assert np.abs(PANDA.forward_path(found) - T[rows]).max() < 2e-10
    assert np.abs(wrapped(found[:, 2] - q[rows, 2])).max() < 1e-15
    assert np.bincount(rows).max() <= 2 * DEGREE
    for shift in range(1, 2 * DEGREE):
        same = rows[shift:] == rows[:-shift]
        assert (np.abs(wrapped(found[shift:] - found[:-shift])).max(axis=1)[same] > 1e-6).all()


def test_solutions_that_share_their_first_joint_are_there_once():
    model = load_model("xArm7")
    for turn in ((0.0, -1.0, 0.0, 0.0), (0.0, 0.9, 0.1, 0.0), (0.0, 1.0, 0.0, 0.0)):
        found = np.array([branch.q for branch in model.inverse(Pose((0.4, 0.15, 0.35), turn), psi=0.0).all])
        apart = np.abs(wrapped(found[:, np.newaxis] - found)).max(axis=2)
        assert len(found) == 8
        assert apart[~np.eye(len(found), dtype=bool)].min() > 1e-3


def test_the_arms_own_configuration_is_among_them_unless_two_meet_there(case):
    q, _, rows, found = case
    apart = np.full(len(q), np.inf)
    np.minimum.at(apart, rows, np.abs(wrapped(found - q[rows])).max(axis=1))
    assert (held_singularity_path(ARM, q[apart > 1e-7]) > 100.0).all()
    assert apart.max() < 1e-4


def test_a_fine_search_along_the_self_motion_finds_no_other(case):
    q, T, rows, found = case
    q7 = np.linspace(-math.pi, math.pi, 4001)
    for row in range(25):
        table, _ = trace(ARM, T[row, :3, :3], T[row, :3, 3], q7)
        miss = wrapped(2.0 * (table[..., 2] - q[row, 2])).reshape(4, -1)  # The twin is half a turn away.
        crosses = (miss[:, 1:] * miss[:, :-1] < 0.0) & (np.abs(np.diff(miss)) < 0.5)
        places = 0.5 * (q7[1:] + q7[:-1])[np.nonzero(crosses)[1]]
        known = found[rows == row, 6]
        assert len(places) <= len(known)
        assert all(np.abs(wrapped(known - place)).min() < 2e-3 for place in places.tolist())


def test_one_and_many_configurations_are_judged_alike_for_singularities(case):
    q = case[0][:50]
    one = [held_singularity(ARM, row) for row in q.tolist()]
    np.testing.assert_allclose(one, held_singularity_path(ARM, q), rtol=1e-9)


@pytest.fixture(scope="module", params=["Panda", "FR3", "xArm7"])
def thousand(request):
    """An arm, random configurations within its range and their poses."""
    model = load_model(request.param)
    limits = model.limits.joint
    q = np.random.default_rng(11).uniform(limits.lower, limits.upper, (1000, 7))
    return model, q, model.forward_path(q)


def test_every_branch_of_a_thousand_poses_at_an_elbow_reaches_them(thousand) -> None:
    model, q, T = thousand
    found = model.inverse_batch(T, q[:, 2]).q
    rows, branches = np.nonzero(np.isfinite(found[:, :, 0]))
    assert np.abs(model.forward_path(found[rows, branches]) - T[rows]).max() < 1e-9
    distance = np.abs(wrapped(found - q[:, np.newaxis])).max(axis=2)
    assert np.nanmin(distance, axis=1).max() < 1e-6
    assert np.bincount(rows).max() > 4


def test_every_branch_of_a_thousand_poses_at_an_angle_of_joint_7_reaches_them(thousand) -> None:
    model, q, T = thousand
    arm = build_offset_geometry(model.description)
    table, _ = trace(arm, T[:, :3, :3], T[:, :3, 3], q[:, 6])
    upright = table.reshape(4, len(q), 7)
    twins = upright * np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0]) + np.array([math.pi, 0, math.pi, 0, 0, 0, 0])
    branches = np.concatenate((upright, twins))  # Joint 2 positive, and negative.
    assert branches.shape == (8, len(q), 7)
    number, row = np.nonzero(np.isfinite(branches[..., 0]))
    assert np.bincount(number).min() > 100
    assert np.abs(model.forward_path(branches[number, row]) - T[row]).max() < 1e-9
    distance = np.abs(wrapped(branches - q)).max(axis=2)
    assert np.nanmin(distance, axis=0).max() < 1e-6


@pytest.mark.parametrize("name", ["Panda", "FR3", "xArm7"])
def test_a_configuration_in_the_plane_of_symmetry_is_found_where_several_have_one_angle_of_joint_7(name) -> None:
    model = load_model(name)
    q = np.tile(model.home, (200, 1))
    q[:, [0, 2, 4]] = 0.0
    moving = [1, 3, 5]
    lower, upper = model.limits.joint.lower[moving], model.limits.joint.upper[moving]
    q[:, moving] = np.random.default_rng(3).uniform(lower, upper, (200, 3))
    found = model.inverse_batch(model.forward_path(q), 0.0).q
    distance = np.fmin.reduce(np.abs(wrapped(found - q[:, np.newaxis])).max(axis=2), axis=1)
    assert (distance < 1e-6).mean() > 0.95  # All but those where rounding hides the root itself.
