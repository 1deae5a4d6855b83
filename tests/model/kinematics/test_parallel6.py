"""The inverse of 6 axes with axes 2, 3 and 4 parallel, and of those with a shoulder ahead of axis 1."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import ModelError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.kinematics.solvers.offset6.solver import OffsetSix
from rcilab.model.kinematics.solvers.parallel6 import ParallelSix, build_parallel_six
from rcilab.model.robot_model import load_model

POSES = 1000
TOLERANCE = 1e-9  # [m] and rotation elements.
SOLVERS = {"ECO65": ParallelSix, "ECO63": ParallelSix, "RML63-III": OffsetSix}
arms = pytest.mark.parametrize("name", SOLVERS)


@arms
def test_every_solution_gives_the_pose_back_and_that_of_the_pose_is_among_them(name: str) -> None:
    model = load_model(name)
    solver = build_solver(model.description)
    assert type(solver) is SOLVERS[name]
    limits = model.limits.joint
    q = np.random.default_rng(1).uniform(limits.lower, limits.upper, (POSES, 6))
    T = model.forward_path(q)
    table = solver.batch(T, np.zeros(POSES))
    exists = np.isfinite(table[..., 0])
    assert table.shape[1] == 8
    assert set(exists.sum(axis=1)) <= {2, 4, 6, 8}
    rows, branches = np.nonzero(exists)
    assert np.abs(model.forward_path(table[rows, branches]) - T[rows]).max() < TOLERANCE
    apart = np.abs(np.mod(table - q[:, None] + np.pi, 2.0 * np.pi) - np.pi).max(axis=2)
    assert np.nanmin(apart, axis=1).max() < 1e-6
    for row in range(50):
        alone = solver.at(Pose.from_matrix(T[row]), None).branches(0.0)
        np.testing.assert_allclose(sorted(alone), sorted(table[row][exists[row]].tolist()), atol=1e-8)


@pytest.mark.parametrize("name", ["ECO65", "ECO63"])
def test_with_axis_6_parallel_to_axes_2_to_4_joint_6_stays_where_it_is(name: str) -> None:
    model = load_model(name)
    q = model.home.copy()
    q[4:] = 0.0, 0.7
    np.testing.assert_allclose(model.inverse(model.forward(q), near=q).nearest(q), q, atol=1e-7)


@arms
def test_a_pose_beyond_the_stretched_arm_is_refused(name: str) -> None:
    model = load_model(name)
    with pytest.raises(UnreachableError):
        model.inverse(Pose([0.0, 1.5, 0.2]))


def test_an_arm_of_another_build_is_refused() -> None:
    with pytest.raises(ModelError, match="parallel axes 2, 3 and 4"):
        build_parallel_six(load_model("xArm6").description)
