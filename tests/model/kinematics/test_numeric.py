"""The numeric solver: an arm with three offsets that has no closed form, and the other arms against theirs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rcilab.core.errors import KinematicsError, ModelError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.kinematics.solvers.numeric.solver import NumericSolver
from rcilab.model.kinematics.solvers.solver import Redundancy
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.motion import plan_line
from rcilab.robots.description import DhRow, RobotDescription

QUARTER = math.pi / 2
TOLERANCE = 1e-9  # [m] and rotation elements.


def described(a, d, alpha, lower, upper) -> RobotDescription:
    """The Panda's description with another geometry."""
    other = load_model("Panda").description
    dh = tuple(DhRow(a=x, alpha=y, d=z) for x, y, z in zip(a, alpha, d, strict=True))
    n = len(dh)
    joint = replace(
        other.limits.joint,
        **{
            name: getattr(other.limits.joint, name)[:n]
            for name in other.limits.joint.__slots__
            if isinstance(getattr(other.limits.joint, name), np.ndarray)
        },
    )
    joint = replace(joint, lower=np.radians(lower), upper=np.radians(upper))
    home = np.radians([0.0, 20.0, 0.0, 60.0, 0.0, 40.0, 0.0])[:n]
    return replace(other, name="offset arm", dh=dh, limits=replace(other.limits, joint=joint), home=home)


SEVEN = RobotModel(
    described(  # As an xArm 7, with an offset at joint 5: no closed form applies.
        a=(0.0, 0.0, 0.0525, 0.0775, 0.01, 0.076, 0.0),
        d=(0.267, 0.0, 0.293, 0.0, 0.3425, 0.0, 0.097),
        alpha=(-QUARTER, QUARTER, QUARTER, QUARTER, QUARTER, -QUARTER, 0.0),
        lower=(-360.0, -118.0, -360.0, -11.0, -360.0, -97.0, -360.0),
        upper=(360.0, 120.0, 360.0, 225.0, 360.0, 180.0, 360.0),
    )
)
SIX = RobotModel(
    described(  # As an xArm 6, with an offset at joint 4: no closed form applies.
        a=(0.0, 0.2895, 0.0775, 0.01, 0.076, 0.0),
        d=(0.267, 0.0, 0.0, 0.3425, 0.0, 0.097),
        alpha=(-QUARTER, 0.0, -QUARTER, QUARTER, -QUARTER, 0.0),
        lower=(-360.0, -200.0, -200.0, -360.0, -97.0, -360.0),
        upper=(360.0, 30.0, 30.0, 360.0, 180.0, 360.0),
    )
)


def configurations(model: RobotModel, count: int, seed: int) -> np.ndarray:
    joint = model.limits.joint
    return np.random.default_rng(seed).uniform(joint.lower, joint.upper, (count, model.n))


def turned(angle: np.ndarray) -> np.ndarray:
    return angle - math.tau * np.round(angle / math.tau)


def test_the_builds_declare_their_redundancy():
    assert isinstance(SEVEN.solver, NumericSolver)
    assert SEVEN.redundancy == Redundancy("joint", 3)
    assert isinstance(SIX.solver, NumericSolver)
    assert not SIX.redundancy
    kinds = {name: load_model(name).redundancy.kind for name in ("xMatePro7", "xMate7", "Panda")}
    assert kinds == {"xMatePro7": "arm_angle", "xMate7": "none", "Panda": "joint"}
    with pytest.raises(KinematicsError, match="no arm angle"):
        SIX.solver.redundancy_angle([0.0] * 6)


@pytest.mark.parametrize(("model", "count"), [(SEVEN, 1000), (SIX, 300)], ids=["7 joints", "6 joints"])
def test_reachable_poses_are_all_solved_and_exactly(model, count):
    # With its own redundancy angle a third, without any and near the arm itself another, with nothing the rest.
    for k, q in enumerate(configurations(model, count, seed=1)):
        T = model.forward(q)
        psi = model.arm_angle(q) if model.redundancy and k % 3 == 0 else None
        solutions = model.inverse(T, psi, near=q if k % 3 == 1 else None)
        assert len(solutions), k
        for found in solutions:
            assert np.abs(model.forward(found).matrix - T.matrix).max() < TOLERANCE
            assert psi is None or math.remainder(found[2] - psi, math.tau) == pytest.approx(0.0, abs=1e-12)
        if k % 3 == 1 and not model.solver.is_singular(q.tolist()):
            assert np.abs(solutions.nearest(q) - q).max() < 1e-6


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7", "xMate3", "xMate7", "Panda"])
def test_answers_are_those_of_the_closed_form(name):
    model = load_model(name)
    numeric, closed = NumericSolver(model.description), build_solver(model.description)
    asked = missing = 0
    for q in configurations(model, 40, seed=2):
        T = model.forward(q)
        found = np.array(numeric.at(T, None).branches(float(q[2])))
        for row in found:
            assert np.abs(model.forward(row).matrix - T.matrix).max() < TOLERANCE
            if closed.singularity_path(row[None])[0] > 0.5:
                continue  # Two solutions are about to meet: the last digits decide which angles they have.
            psi = closed.redundancy_angle(row.tolist()) if model.redundancy else 0.0
            exact = np.array(closed.at(T, row.tolist()).branches(psi))
            assert np.abs(turned(exact - row)).max(axis=1).min() < 1e-7
        asked += 1
        missing += np.abs(turned(found - q)).max(axis=1).min() > 1e-6
    assert missing <= 0.05 * asked


def test_many_poses_are_answered_as_one():
    q = configurations(SEVEN, 50, seed=3)
    batch = SEVEN.inverse_batch(SEVEN.forward_path(q), [SEVEN.arm_angle(row) for row in q])
    assert batch.reachable.mean() > 0.9
    for row, T in zip(batch.q, SEVEN.forward_path(q), strict=True):
        for found in row[np.isfinite(row[:, 0])]:
            assert np.abs(SEVEN.forward(found).matrix - T).max() < TOLERANCE


def test_arcs_hold_where_the_inverse_has_solutions_and_their_ends_are_safe():
    count = 0
    for q in configurations(SEVEN, 8, seed=4):
        T = SEVEN.forward(q)
        arcs = SEVEN.feasible_arcs(T)
        assert sum(arc.end - arc.start for arc in arcs.arcs) == pytest.approx(math.tau)
        assert arcs.at(float(q[2])).ok or SEVEN.solver.singularity_path(q[None])[0] > 0.9
        for start, end in arcs.feasible:
            for psi in (start + 1e-6, 0.5 * (start + end), end - 1e-6):
                assert len(SEVEN.inverse(T, psi=math.remainder(psi, math.tau)))
                count += 1
    assert count > 20


def test_a_line_is_followed_and_what_is_out_of_reach_is_refused():
    q = SEVEN.home
    T = SEVEN.forward(q)
    motion = plan_line(SEVEN, q, T @ Pose((0.0, 0.05, 0.1)), speed=0.3)
    poses = SEVEN.forward_path(motion.q)
    assert np.abs(poses[-1] - (T @ Pose((0.0, 0.05, 0.1))).matrix).max() < 1e-6
    assert np.abs(np.diff(motion.q, axis=0)).max() < 0.01
    with pytest.raises(UnreachableError, match="out of reach by"):
        SEVEN.inverse(Pose((2.0, 0.0, 0.3)))
    assert SEVEN.closest(Pose((2.0, 0.0, 0.3)), q).refusal is not None


def test_five_joints_are_solved_where_they_reach_and_eight_are_refused():
    five = described(  # As an xArm 5.
        a=(0.0, 0.2895, 0.0775, 0.076, 0.0),
        d=(0.267, 0.0, 0.0, 0.0, 0.097),
        alpha=(-QUARTER, 0.0, 0.0, -QUARTER, 0.0),
        lower=(-180.0, -118.0, -225.0, -97.0, -180.0),
        upper=(180.0, 120.0, 11.0, 180.0, 180.0),
    )
    model = RobotModel(five)
    for q in configurations(model, 30, seed=5):
        T = model.forward(q)
        for found in (solutions := model.inverse(T)):
            assert np.abs(model.forward(found).matrix - T.matrix).max() < TOLERANCE
        assert len(solutions)
    with pytest.raises(ModelError, match="up to 7"):
        NumericSolver(replace(five, dh=(five.dh[0],) * 8))
