"""The inverse of 5 axes in a plane that turns about a vertical axis."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import ModelError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.kinematics.solvers.planar5 import PlanarFive, build_planar_five
from rcilab.model.robot_model import load_model

POSES = 1000
TOLERANCE = 1e-9  # [m] and rotation elements.


def test_every_solution_gives_the_pose_back_and_that_of_the_pose_is_among_them() -> None:
    model = load_model("xArm5")
    solver = build_solver(model.description)
    assert type(solver) is PlanarFive
    limits = model.limits.joint
    q = np.random.default_rng(1).uniform(limits.lower, limits.upper, (POSES, 5))
    T = model.forward_path(q)
    table = solver.batch(T, np.zeros(POSES))
    exists = np.isfinite(table[..., 0])
    assert set(exists.sum(axis=1)) == {2, 4}
    rows, branches = np.nonzero(exists)
    assert np.abs(model.forward_path(table[rows, branches]) - T[rows]).max() < TOLERANCE
    apart = np.abs(np.mod(table - q[:, None] + np.pi, 2.0 * np.pi) - np.pi).max(axis=2)
    assert np.nanmin(apart, axis=1).max() < 1e-6
    for row in range(50):
        alone = solver.at(Pose.from_matrix(T[row]), None).branches(0.0)
        np.testing.assert_allclose(sorted(alone), sorted(table[row][exists[row]].tolist()), atol=1e-8)


def test_with_the_flange_on_axis_1_the_plane_is_that_of_the_wrist() -> None:
    model = load_model("xArm5")
    q = np.array([0.4, -0.3, -0.9, 0.5, 0.2])
    flat = np.linspace(-1.6, 3.1, 4000)
    radius = [float(np.hypot(*model.forward([*q[:3], angle, q[4]]).position[:2])) for angle in flat]
    q[3] = flat[int(np.argmin(radius))]
    found = model.inverse(model.forward(q), near=q)
    np.testing.assert_allclose(found.nearest(q), q, atol=1e-7)


def test_a_pose_beyond_the_stretched_arm_or_out_of_the_plane_is_refused() -> None:
    model = load_model("xArm5")
    with pytest.raises(UnreachableError):
        model.inverse(Pose([0.0, 1.5, 0.2]))
    with pytest.raises(UnreachableError):
        model.inverse(model.forward(model.home) @ Pose.from_rpy((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))


def test_an_arm_of_another_build_is_refused() -> None:
    with pytest.raises(ModelError, match="parallel axes 2, 3 and 4"):
        build_planar_five(load_model("xArm6").description)
