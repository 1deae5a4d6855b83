"""What the inverse of every build answers for a whole path and for one cycle, against its answers for one pose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import KinematicsError, SingularError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.robot_model import load_model

MODELS = {name: load_model(name) for name in ("xMatePro3", "xMatePro7", "xMate3", "xMate7", "Panda")}
names, seeds = st.sampled_from(sorted(MODELS)), st.integers(0, 2**32)
SPECIAL = np.radians([0.0, 90.0, -90.0, 180.0, 0.9, 1.3, 89.2])


def configurations(name: str, seed: int, count: int = 40):
    """Random joint angles, a third of them at or near what makes an arm singular."""
    rng = np.random.default_rng(seed)
    limits = MODELS[name].limits.joint
    q = rng.uniform(limits.lower, limits.upper, size=(count, MODELS[name].n))
    return np.where(rng.random(q.shape) < 0.3, rng.choice(SPECIAL, size=q.shape), q)


@settings(max_examples=40)
@given(names, seeds)
def test_arm_angles_of_a_path_are_those_of_its_rows(name, seed):
    arm, q = build_solver(MODELS[name].description), configurations(name, seed)
    if MODELS[name].n == 6:
        with pytest.raises(KinematicsError, match="no arm angle"):
            arm.redundancy_angle_path(q)
        return
    for row, psi in zip(q, arm.redundancy_angle_path(q), strict=True):
        try:
            expected = arm.redundancy_angle(row.tolist())
        except SingularError:
            continue
        if arm.singularity_path(row[np.newaxis])[0] < 50.0:  # Closer than that, the last digits decide.
            assert np.remainder(psi - expected + np.pi, 2.0 * np.pi) - np.pi == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=40)
@given(names, seeds)
def test_what_counts_as_singular_on_a_path_is_what_counts_for_one_configuration(name, seed):
    arm, q = build_solver(MODELS[name].description), configurations(name, seed)
    for row, nearness in zip(q, arm.singularity_path(q), strict=True):
        if abs(nearness - 1.0) > 1e-9:
            assert arm.is_singular(row.tolist()) == (nearness > 1.0)
    assert name == "Panda" or arm.is_singular([0.0] * MODELS[name].n)


@settings(max_examples=40)
@given(names, seeds)
def test_the_solution_near_the_last_angles_is_the_arm_itself(name, seed):
    model, rng = MODELS[name], np.random.default_rng(seed)
    arm = build_solver(model.description)
    q = model.home + rng.uniform(-0.15, 0.15, model.n)
    near = q + rng.uniform(-2e-3, 2e-3, model.n)
    psi = arm.redundancy_angle(q.tolist()) if model.n == 7 else 0.0
    assert arm.solve_near(model.forward(q), psi, near.tolist()) == pytest.approx(q.tolist(), abs=1e-10)
    assert arm.solve_near(Pose((9.0, 0.0, 0.0)), psi, near.tolist()) is None
