"""The RealMan arms: figures of the maker's offline library, and the library itself where it is installed."""

from __future__ import annotations

import math
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from rcilab.core.arrays import Array
from rcilab.core.rotation import rotation_vector
from rcilab.core.spatial import Pose
from rcilab.makers.realman.robots import ROBOTS
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.robot_model import load_model

ZERO_POSES = {  # x, y, z [m], rx, ry, rz [rad] of the library, all joints at zero.
    "RM65": (0.0, 0.0, 0.8505, 0.0, 0.0, math.pi),
    "RM75": (0.0, 0.0, 0.8505, 0.0, 0.0, 0.0),
    "RML63-III": (-0.017, 0.0, 1.0626, 0.0, 0.0, 0.0),
    "ECO65": (-0.086, 0.02062, 0.7725, -math.pi / 2, 0.0, 0.0),
    "ECO63": (-0.086, 0.0206, 1.0625, -math.pi / 2, 0.0, 0.0),
    "GEN72": (0.1115, 0.0, 0.8175, -math.pi, -math.pi / 2, 0.0),
}
MODELS = {
    "RM65": "RM_MODEL_RM_65_E",
    "RM75": "RM_MODEL_RM_75_E",
    "RML63-III": "RM_MODEL_RM_63_III_E",
    "ECO65": "RM_MODEL_ECO_65_E",
    "ECO63": "RM_MODEL_ECO_63_E",
    "GEN72": "RM_MODEL_GEN_72_E",
}


def rotation(rx: float, ry: float, rz: float) -> Array:
    """Rz Ry Rx, as the maker means three angles."""
    (cx, cy, cz), (sx, sy, sz) = np.cos((rx, ry, rz)), np.sin((rx, ry, rz))
    return np.array(
        [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ]
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_the_flange_at_zero_is_where_the_makers_library_has_it(name: str):
    model = load_model(name)
    pose = model.forward([0.0] * model.n)
    *position, rx, ry, rz = ZERO_POSES[name]
    np.testing.assert_allclose(pose.position, position, atol=1e-12)
    np.testing.assert_allclose(pose.rotation, rotation(rx, ry, rz), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "q_deg", "pose"),
    [
        ("RM65", (10, 20, 30, 40, 50, 60), (-0.35566, -0.13471, 0.61081, 1.60716, 0.00837, -0.88074)),
        ("RM75", (10, 20, 30, 40, 50, 60, 70), (0.25648, 0.25244, 0.5801, 1.66686, -0.49573, 2.95871)),
    ],
)
def test_other_poses_are_those_of_the_makers_library(name: str, q_deg: tuple[float, ...], pose: tuple[float, ...]):
    found = load_model(name).forward(np.radians(q_deg))
    *position, rx, ry, rz = pose
    np.testing.assert_allclose(found.position, position, atol=2e-5)
    np.testing.assert_allclose(found.rotation, rotation(rx, ry, rz), atol=2e-5)


@pytest.mark.parametrize("name", ROBOTS)
def test_every_branch_leads_to_its_pose(name: str):
    model = load_model(name)
    solver = build_solver(model.description)
    rng = np.random.default_rng(5)
    lower = np.maximum(model.limits.joint.lower, -np.pi)
    upper = np.minimum(model.limits.joint.upper, np.pi)
    for _ in range(200):
        q = rng.uniform(lower, upper)
        T = model.forward(q)
        psi = solver.redundancy_angle(q.tolist()) if solver.redundancy else 0.0
        branches = solver.at(T, None).branches(psi)
        own = min(np.abs(np.mod(np.array(branch) - q + np.pi, 2.0 * np.pi) - np.pi).max() for branch in branches)
        assert own < 1e-6
        assert len(branches) == 8 or name not in ("RM65", "RM75")
        for branch in branches:
            found = model.forward(branch)
            np.testing.assert_allclose(found.position, T.position, atol=1e-9)
            np.testing.assert_allclose(found.rotation, T.rotation, atol=1e-9)


@pytest.fixture(scope="module")
def library() -> ModuleType:
    """The maker's client library."""
    return pytest.importorskip("Robotic_Arm.rm_robot_interface", reason="needs the extra realman")


def open_algo(library: ModuleType, name: str) -> Any:
    """Returns the library's offline kinematics of an arm."""
    kind = getattr(library.rm_robot_arm_model_e, MODELS[name])
    return library.Algo(kind, library.rm_force_type_e.RM_MODEL_RM_B_E)


def solutions_of(library: ModuleType, algo: Any, q: Array, pose: list[float]) -> Array:
    """Returns the solutions that the library gives for a pose, [rad]: all of 6 axes, one of 7."""
    params = library.rm_inverse_kinematics_params_t(np.degrees(q).tolist(), pose, 0)
    if len(q) == 6:
        found = algo.rm_algo_inverse_kinematics_all(params)
        return np.radians([list(found.q_solve[k])[:6] for k in range(found.num)])
    code, angles = algo.rm_algo_inverse_kinematics(params)
    assert code == 0
    return np.radians([angles[:7]])


@pytest.mark.parametrize("name", ROBOTS)
def test_geometry_and_limits_are_those_of_the_makers_library(name: str, library: ModuleType):
    algo, model = open_algo(library, name), load_model(name)
    joint = model.limits.joint
    n = model.n
    np.testing.assert_allclose(np.degrees(joint.lower), algo.rm_algo_get_joint_min_limit()[:n], rtol=1e-6)
    np.testing.assert_allclose(np.degrees(joint.upper), algo.rm_algo_get_joint_max_limit()[:n], rtol=1e-6)
    np.testing.assert_allclose(np.degrees(joint.velocity), algo.rm_algo_get_joint_max_speed()[:n], rtol=1e-6)
    rng = np.random.default_rng(6)
    for q in rng.uniform(joint.lower, joint.upper, (1000, n)):
        x, y, z, *wxyz = algo.rm_algo_forward_kinematics(np.degrees(q).tolist(), 0)
        pose = model.forward(q)
        np.testing.assert_allclose(pose.position, (x, y, z), atol=1e-6)
        assert np.linalg.norm(rotation_vector(pose.rotation, Pose((x, y, z), wxyz).rotation)) < 1e-6


@pytest.mark.parametrize("name", ROBOTS)
def test_every_solution_of_the_makers_library_is_among_ours(name: str, library: ModuleType):
    algo, model = open_algo(library, name), load_model(name)
    solver, joint, rng = build_solver(model.description), model.limits.joint, np.random.default_rng(7)
    compared = 0
    for q in rng.uniform(joint.lower, joint.upper, (100, model.n)):
        T = model.forward(q)
        pose = algo.rm_algo_forward_kinematics(np.degrees(q).tolist(), 0)
        for theirs in solutions_of(library, algo, q, pose):
            if np.abs(model.forward(theirs).position - T.position).max() > 1e-5:
                continue  # Near a singularity it returns what is some millimetres off.
            psi = solver.redundancy_angle(theirs.tolist()) if solver.redundancy else 0.0
            ours = np.array(solver.at(T, None).branches(psi))
            assert np.abs(np.mod(ours - theirs + np.pi, 2.0 * np.pi) - np.pi).max(axis=1).min() < 2e-3
            compared += 1
    assert compared > (95 if model.n == 7 else 400)
