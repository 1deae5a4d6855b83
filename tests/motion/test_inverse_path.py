"""The inverse along a path: it undoes forward kinematics on every branch, and says where the branch ends."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rcilab.core.errors import SingularError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model
from rcilab.motion.inverse_path import inverse_path
from tests.arms import ANY_POSE, REPRESENTATIVE

ALL = pytest.mark.parametrize("name", REPRESENTATIVE)
TOOL = Pose.from_rpy((0.02, -0.01, 0.1), (0.1, 0.2, 0.3))
SEVEN = load_model("xMatePro7")


def psi_along(model, q):
    return np.unwrap([model.arm_angle(row) for row in q]) if model.n == 7 else None


@ALL
@given(seed=st.integers(0, 2**32))
def test_the_inverse_along_a_path_of_the_joints_finds_them_again(name, seed):
    model = load_model(name, tool=TOOL)
    rng = np.random.default_rng(seed)
    limits = model.limits.joint
    start = rng.uniform(0.9 * limits.lower, 0.9 * limits.upper)
    q = start + np.linspace(0.0, 1.0, 200)[:, np.newaxis] * rng.uniform(-0.3, 0.3, model.n)
    # Past a stretched elbow two branches begin, and both are smooth; beside a wrist singularity rounding grows.
    bends = np.sin(q[:, [1, 3, 5]] if model.n == 7 else q[:, [2, 4]])
    assume(np.abs(bends).min() > 1e-2)
    if model.n == 6:  # The wrist above the shoulder is where joint 1 is lost.
        assume(np.hypot(*(model.forward_path(q)[:, :2, 3]).T).min() > 0.3)
    found, loss = inverse_path(model, model.forward_path(q), psi_along(model, q), start)
    assume(loss is None)
    assert np.abs(found - q).max() < 1e-8


def test_a_path_through_a_singularity_in_the_arms_plane_goes_on_smoothly():
    q = np.array([0.0, 0.3, 0.0, 1.2, 0.0, 0.4, 0.0]) + np.linspace(0.0, 1.0, 401)[:, np.newaxis] * np.array(
        [0.0, -0.5, 0.0, 0.2, 0.0, -0.9, 0.0]
    )
    found, loss = inverse_path(SEVEN, SEVEN.forward_path(q), np.zeros(401), q[0])
    assert loss is None
    assert np.abs(found - q).max() < 1e-9


def test_a_path_closely_beside_a_singularity_is_told_from_one_through_it():
    T = SEVEN.forward(np.array([0.0, 0.3, 0.0, 1.2, 0.0, 0.4, 0.0]))
    turns = [T @ Pose.from_rpy((0.0, 0.0, 0.0), (1e-4, -0.8 * share, 0.0)) for share in np.linspace(0.0, 1.0, 201)]
    start = SEVEN.inverse(turns[0], 0.0, np.array([0.0, 0.3, 0.0, 1.2, 0.0, 0.4, 0.0]))
    q = start.nearest([0.0, 0.3, 0.0, 1.2, 0.0, 0.4, 0.0])
    _, loss = inverse_path(SEVEN, np.array([pose.matrix for pose in turns]), np.zeros(201), q)
    assert loss is not None
    assert isinstance(loss.reason, SingularError)
    assert 55 <= loss.row <= 65  # Where joint 6 is zero.


@pytest.mark.parametrize("name", ANY_POSE)
def test_the_first_row_out_of_reach_is_named(name):
    model = load_model(name)
    T = np.tile(model.forward(model.home).matrix, (50, 1, 1))
    T[20:, 0, 3] += 3.0
    psi = None if model.n == 6 else np.full(50, model.arm_angle(model.home))
    _, loss = inverse_path(model, T, psi, model.home)
    assert loss is not None
    assert loss.row == 20
    assert isinstance(loss.reason, UnreachableError)
