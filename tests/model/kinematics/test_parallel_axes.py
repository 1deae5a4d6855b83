"""The inverse of arms with axes 2, 3 and 4 parallel, and of one with a shoulder ahead of axis 1."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import ModelError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.kinematics.solvers.offset6.solver import OffsetSix
from rcilab.model.kinematics.solvers.parallel6 import ParallelSix, build_parallel_six
from rcilab.model.kinematics.solvers.planar5 import PlanarFive, build_planar_five
from rcilab.model.robot_model import load_model

POSES = 1000
TOLERANCE = 1e-9  # [m] and rotation elements.
SOLVERS = {"xArm5": (PlanarFive, 4), "ECO65": (ParallelSix, 8), "ECO63": (ParallelSix, 8), "RML63-III": (OffsetSix, 8)}
"""With the largest number of solutions."""


@pytest.mark.parametrize("name", SOLVERS)
def test_every_solution_gives_the_pose_back_and_that_of_the_pose_is_among_them(name: str) -> None:
    model = load_model(name)
    solver = build_solver(model.description)
    kind, most = SOLVERS[name]
    assert type(solver) is kind
    limits = model.limits.joint
    q = np.random.default_rng(1).uniform(limits.lower, limits.upper, (POSES, model.n))
    T = model.forward_path(q)
    table = solver.batch(T, np.zeros(POSES))
    exists = np.isfinite(table[..., 0])
    assert table.shape[1] == most
    assert set(exists.sum(axis=1)) <= set(range(2, most + 1, 2))
    rows, branches = np.nonzero(exists)
    assert np.abs(model.forward_path(table[rows, branches]) - T[rows]).max() < TOLERANCE
    apart = np.abs(np.mod(table - q[:, None] + np.pi, 2.0 * np.pi) - np.pi).max(axis=2)
    assert np.nanmin(apart, axis=1).max() < 1e-6
    for row in range(50):
        alone = solver.at(Pose.from_matrix(T[row]), None).branches(0.0)
        np.testing.assert_allclose(sorted(alone), sorted(table[row][exists[row]].tolist()), atol=1e-8)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_pose_beyond_the_stretched_arm_is_refused(name: str) -> None:
    with pytest.raises(UnreachableError):
        load_model(name).inverse(Pose([0.0, 1.5, 0.2]))


@pytest.mark.parametrize("build", [build_planar_five, build_parallel_six])
def test_an_arm_of_another_build_is_refused(build) -> None:
    with pytest.raises(ModelError, match="parallel axes 2, 3 and 4"):
        build(load_model("xArm6").description)


@pytest.mark.parametrize("name", ["ECO65", "ECO63"])
def test_with_axis_6_parallel_to_axes_2_to_4_joint_6_stays_where_it_is(name: str) -> None:
    model = load_model(name)
    q = model.home.copy()
    q[4:] = 0.0, 0.7
    np.testing.assert_allclose(model.inverse(model.forward(q), near=q).nearest(q), q, atol=1e-7)


def test_with_the_flange_of_5_axes_on_axis_1_the_plane_is_that_of_the_wrist() -> None:
    model = load_model("xArm5")
    q = np.array([0.4, -0.3, -0.9, 0.5, 0.2])
    flat = np.linspace(-1.6, 3.1, 4000)
    radius = [float(np.hypot(*model.forward([*q[:3], angle, q[4]]).position[:2])) for angle in flat]
    q[3] = flat[int(np.argmin(radius))]
    found = model.inverse(model.forward(q), near=q)
    np.testing.assert_allclose(found.nearest(q), q, atol=1e-7)


def test_a_pose_out_of_the_plane_of_5_axes_is_refused() -> None:
    model = load_model("xArm5")
    with pytest.raises(UnreachableError):
        model.inverse(model.forward(model.home) @ Pose.from_rpy((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))
