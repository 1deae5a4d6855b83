from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.model.kinematics.solvers.spherical.inverse import build_geometry, inverse_seven, inverse_six
from rcilab.model.robot_model import load_model
from rcilab.robots import ROBOT_NAMES
from tests.arms import CLOSED_FORM

AT_LIMIT = 1e-3  # [rad] A smaller excess is not given as a number.

POSES_PER_ARM = 2500  # 10 000 over the four arms.
TOLERANCE = 1e-9  # [m] and rotation elements.


def random_configurations(model, count, seed):
    limits = model.limits.joint
    return np.random.default_rng(seed).uniform(limits.lower, limits.upper, (count, model.n))


@pytest.mark.parametrize("name", ROBOTS)
def test_every_one_of_eight_branches_gives_the_pose_back(name):
    model = load_model(name)
    for q in random_configurations(model, POSES_PER_ARM, seed=1):
        T = model.forward(q)
        psi = model.arm_angle(q) if model.n == 7 else None
        solutions = model.inverse(T, psi=psi)
        assert len(solutions.all) == 8
        assert len({tuple(np.round(branch.q, 6)) for branch in solutions.all}) == 8
        assert all(model.forward(branch.q).is_close(T, TOLERANCE) for branch in solutions.all)
        np.testing.assert_allclose(solutions.nearest(q), q, atol=1e-6)  # Conditioning near singular poses costs digits.


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7"])
def test_every_branch_has_the_arm_angle_that_was_asked_for(name):
    model = load_model(name)
    rng = np.random.default_rng(2)
    asked = 0
    for q in random_configurations(model, 300, seed=3):
        psi = rng.uniform(-math.pi, math.pi)
        try:
            solutions = model.inverse(model.forward(q), psi=psi)
        except UnreachableError:
            continue
        asked += 1
        for branch in solutions.all:
            assert abs(math.remainder(model.arm_angle(branch.q) - psi, math.tau)) < 1e-6
    assert asked > 100


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_solutions_stay_inside_the_joint_limits(name):
    model = load_model(name)
    limits = model.limits.joint
    for q in random_configurations(model, 200, seed=4):
        for solution in model.inverse(model.forward(q), psi=model.arm_angle(q) if model.n == 7 else None):
            assert np.all(solution > limits.lower)
            assert np.all(solution < limits.upper)


SINGULAR = {
    7: [(0, 0, 0, 0, 0, 0, 0), (0.3, 0.5, 0.2, 0, 0.1, 0.4, 0.5), (0.3, 0, 0.2, 0.8, 0, 0.5, 0),
        (0.1, 0.4, 0, 1, 0.2, 0, 0.3)],
    6: [(0, 0, 0, 0, 0, 0), (0.3, 0.5, 0, 0.2, 0.4, 0.1), (0.3, 0.5, 0.6, 0.2, 0, 0.1), (0.4, -0.8, 1.6, 0.1, 0.5, 0)],
}  # fmt: skip


@pytest.mark.parametrize("name", ROBOTS)
def test_a_singular_pose_gives_the_solution_nearest_to_where_the_arm_is(name):
    model = load_model(name)
    for q in SINGULAR[model.n]:
        T = model.forward(q)
        solution = model.inverse(T, near=q).nearest(q)
        assert model.forward(solution).is_close(T, TOLERANCE)
        np.testing.assert_allclose(solution, q, atol=1e-7)


@pytest.mark.parametrize("name", sorted({*CLOSED_FORM} - {"GEN72"}))  # Its flange looks aside from a stretched arm.
@pytest.mark.parametrize("short", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_almost_stretched_poses_are_finite_and_exact(name, short):
    model = load_model(name)
    row = model.description.dh
    reach = (row[2].d if model.n == 7 else row[1].a) + (row[4].d if model.n == 7 else row[3].d) - short
    for direction in ((1, 0, 0), (0, 0, 1), (0.6, 0, 0.8), (-0.48, 0.6, 0.64)):
        wrist = np.array([0, 0, row[0].d]) + reach * np.array(direction)
        pose = Pose(wrist + np.array([0, 0, row[-1].d]))  # The hand stands upright on the wrist.
        for solution in model.inverse(pose):
            assert np.isfinite(solution).all()
            assert model.forward(solution).is_close(pose, TOLERANCE)


def test_a_pose_out_of_reach_says_by_how_much():
    with pytest.raises(UnreachableError, match=r"out of reach by \d+\.\d mm") as caught:
        load_model("xMatePro7").inverse(Pose((1.5, 0, 0.4)))
    assert caught.value.distance == pytest.approx(math.hypot(1.5, 0.4 - 0.2755 - 0.404) - 0.85, abs=1e-9)


def test_a_pose_too_close_says_so():
    with pytest.raises(UnreachableError, match="too close"):
        load_model("xMate7").inverse(Pose((0, 0, 0.404 + 0.2755)))


def test_a_pose_beyond_a_joint_limit_names_the_joint():
    with pytest.raises(UnreachableError, match=r"joint \d would have to be at") as caught:
        load_model("xMatePro7").inverse(Pose((0, 0, 0.1)), psi=0.0)
    assert caught.value.joint is not None
    assert caught.value.excess > 0
    assert caught.value.distance == 0


def test_without_an_arm_angle_a_feasible_one_is_found():
    model = load_model("xMatePro3")
    found = 0
    for q in random_configurations(model, 300, seed=5):
        T = model.forward(q)
        try:
            model.inverse(T, psi=0.0)
        except UnreachableError:
            assert model.forward(model.inverse(T)[0]).is_close(T, TOLERANCE)
            found += 1
    assert found > 5


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7"])
def test_a_pose_is_found_even_where_the_arm_stands_close_to_its_limits(name):
    """Ranges of possible arm angles are narrow there: a few degrees, or less."""
    model, random = load_model(name), np.random.default_rng(5)
    limits = model.limits.joint
    narrow = 0
    for share in random.beta(0.15, 0.15, (600, 7)):
        T = model.forward(limits.lower + (0.002 + 0.996 * share) * (limits.upper - limits.lower))
        assert model.forward(model.inverse(T)[0]).is_close(T, TOLERANCE)
        narrow += all(end - start < math.radians(10.0) for start, end in model.feasible_arcs(T).feasible)
    assert narrow > 0


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from(["xMatePro3", "xMatePro7", "xMate3", "xMate7"]))
def test_a_refusal_names_the_joint_and_by_how_much_in_the_best_branch(seed, name):
    """Poses the wrist reaches, asked for at one arm angle and at any."""
    model, random = load_model(name), np.random.default_rng(seed)
    limits = model.limits.joint
    T = model.forward(random.uniform(1.3 * limits.lower, 1.3 * limits.upper))
    psi = random.uniform(-math.pi, math.pi) if model.n == 7 else None
    for asked in {psi, None}:
        try:
            found = model.inverse(T, psi=asked)
        except UnreachableError as refusal:
            error = refusal
        else:
            assert len(found) > 0
            continue
        assert error.distance == 0.0
        everywhere = model.n == 7 and asked is None
        branches = every_branch(model, T, np.radians(range(-180, 180, 10)) if everywhere else [asked])
        excess = np.maximum(limits.lower - branches, branches - limits.upper).max(axis=-1)
        assert error.excess == pytest.approx(excess.min(), abs=1e-9)
        best = branches[np.unravel_index(excess.argmin(), excess.shape)]
        assert error.joint == 1 + int(np.maximum(limits.lower - best, best - limits.upper).argmax())
        assert f"joint {error.joint} would have to be at" in str(error)
        by = f"{math.degrees(error.excess):.1f} deg beyond its limit"
        assert ("right at its limit" if error.excess < AT_LIMIT else by) in str(error)
        assert ("change the arm angle" in str(error)) == (asked is not None)
        assert ("at the best arm angle" in str(error)) == everywhere


def every_branch(model, T, psis):
    """All branches, limits or not, shape (arm angles, 8, n)."""
    geometry = build_geometry(model.description)
    solve = inverse_six if model.n == 6 else inverse_seven
    return np.array([solve(geometry, T, None) if model.n == 6 else solve(geometry, T, psi, None) for psi in psis])


def test_an_arm_angle_for_six_axes_is_refused():
    with pytest.raises(InvalidValueError, match="6-axis arm has no arm angle"):
        load_model("xMate3").inverse(Pose((0.4, 0, 0.5)), psi=0.1)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_a_pose_that_is_not_finite_is_refused(bad):
    model = load_model("xMatePro7")
    with pytest.raises(InvalidValueError):
        model.inverse(Pose.from_parts((1, 0, 0, 0, 1, 0, 0, 0, 1), (bad, 0.0, 0.5)))
    with pytest.raises(InvalidValueError):
        model.inverse(model.forward(model.home), psi=bad)


def test_the_manuals_literal_table_is_served_too():
    from dataclasses import replace

    from rcilab.model.robot_model import RobotModel

    upright = load_model("xMate3")
    rows = tuple(replace(row, theta_offset=0.0) for row in upright.description.dh)
    literal = RobotModel(replace(upright.description, dh=rows))
    q = np.array([0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    shifted = q + [0, -math.pi / 2, math.pi / 2, 0, 0, 0]
    assert literal.forward(shifted).is_close(upright.forward(q), 1e-12)
    assert any(np.allclose(branch.q, shifted) for branch in literal.inverse(upright.forward(q)).all)


def test_a_joint_with_more_than_a_turn_is_moved_by_full_turns_to_come_near():
    model = load_model("xMatePro7")
    q = np.array([0.1, 0.5, 0.2, 1.0, 0.3, 0.7, math.radians(300)])
    np.testing.assert_allclose(model.inverse(model.forward(q), psi=model.arm_angle(q)).nearest(q), q, atol=1e-9)


def test_a_pose_with_a_joint_right_at_its_limit_is_refused_in_words() -> None:
    model = load_model("xMatePro7")
    q = model.home.copy()
    q[1] = model.limits.joint.upper[1]
    with pytest.raises(UnreachableError, match=r"at 120\.0 deg, right at its limit, and has to stay inside"):
        model.inverse(model.forward(q), psi=model.arm_angle(q))


def test_an_arm_angle_in_degrees_is_refused():
    model = load_model("xMatePro7")
    with pytest.raises(InvalidValueError, match=r"psi: 30\.0 is more than two turns; the unit is rad"):
        model.inverse(model.forward(model.home), psi=30)
