"""The arcs of feasible arm angles against a dense look with the inverse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import KinematicsError, UnreachableError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.model.kinematics.elbow_ranges import INSIDE
from rcilab.model.kinematics.solvers.spherical.inverse import build_geometry, inverse_seven
from rcilab.model.kinematics.solvers.spherical.singularity import find_singularity
from rcilab.model.robot_model import RobotModel, load_model
from tests.model.kinematics.elbow import branch_ranges

NAMES = ["xMatePro3", "xMatePro7"]
TOOL = Pose.from_rpy((0.03, -0.02, 0.12), (0.3, -0.4, 0.5))
NARROW = 1e-7  # [rad] Samples this close to the end of an arc may be on either side.
seeds = st.integers(0, 2**32 - 1)


def random_q(model, seed):
    limits = model.limits.joint
    return np.random.default_rng(seed).uniform(limits.lower, limits.upper)


def compare(model, T, samples):
    """Asserts that branches and singularity at every sample are those of the scalar inverse; returns how many were."""
    found, geometry, limits = model.feasible_arcs(T), build_geometry(model.description), model.limits.joint
    ends = np.array([arc.start for arc in found.arcs])
    flange, count = T @ model.T_flange_tool.inverse(), 0
    for psi in samples:
        if np.abs(np.remainder(ends - psi + math.pi, math.tau) - math.pi).min() < NARROW:
            continue
        arc, q = found.at(psi), np.array(inverse_seven(geometry, flange, psi, None))
        inside = ((q > limits.lower) & (q < limits.upper)).all(axis=1)
        assert arc.branches == tuple(np.flatnonzero(inside))
        assert ("joint limits" in arc.reasons) == (not inside.any()) == bool(arc.joints)
        singular = find_singularity(geometry, q[0].tolist()) is not None
        assert ("singularity" in arc.reasons) == singular
        if arc.joints:
            beyond = (q <= limits.lower) | (q >= limits.upper)
            assert [number - 1 for number in arc.joints] in [np.flatnonzero(row).tolist() for row in beyond]
            assert len(arc.joints) == beyond.sum(axis=1).min()
        count += 1
    return count


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=40)
@given(seed=seeds)
def test_arcs_are_what_the_inverse_says_at_every_arm_angle(name, seed):
    model = load_model(name, tool=TOOL)
    T = model.forward(random_q(model, seed))
    assert compare(model, T, np.linspace(-math.pi, math.pi, 121)) > 110


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=25)
@given(seed=seeds)
def test_arcs_are_right_under_narrow_and_uneven_limits_too(name, seed):
    plain, rng = load_model(name), np.random.default_rng(seed)
    lower, upper = rng.uniform(-2.2, -0.2, 7), rng.uniform(0.2, 2.2, 7)
    joint = replace(plain.limits.joint, lower=lower, upper=upper)
    model = RobotModel(replace(plain.description, limits=replace(plain.limits, joint=joint)))
    compare(model, plain.forward(rng.uniform(lower, upper)), rng.uniform(-math.pi, math.pi, 60))


@pytest.mark.parametrize("name", NAMES)
def test_singular_arcs_are_found_where_the_elbow_goes_through_them(name):
    """The elbow circle leads through an upright upper arm, with joint 3 a quarter turn away: axes 1 and 3 in line."""
    model, seen = load_model(name), 0
    for q in ([0.3, 0.001, math.pi / 2, 1.0, 0.4, 0.8, 0.2], [0.3, 0.8, 0.4, 1.0, math.pi / 2, 0.001, 0.2]):
        T, psi = model.forward(q), model.arm_angle(q)
        arc = model.feasible_arcs(T).at(psi)
        assert arc.reasons == ("singularity",)
        assert arc.end - arc.start < 0.2
        assert not arc.ok
        seen += compare(model, T, psi + np.linspace(-0.1, 0.1, 101))
    assert seen > 150


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=50)
@given(seed=seeds)
def test_arcs_cover_the_circle_once_and_neighbours_differ(name, seed):
    model = load_model(name)
    q = random_q(model, seed)
    found = model.feasible_arcs(model.forward(q))
    assert sum(arc.end - arc.start for arc in found.arcs) == pytest.approx(math.tau, abs=1e-9)
    assert -math.pi <= found.arcs[0].start < math.pi
    for before, after in zip(found.arcs, found.arcs[1:], strict=False):
        assert before.end == after.start
        kinds = [(arc.reasons, arc.joints, arc.branches) for arc in (before, after)]
        assert kinds[0] != kinds[1]
    psi = model.arm_angle(q)
    is_in = any((psi - start) % math.tau <= end - start for start, end in found.feasible)
    assert is_in == found.at(psi).ok
    for branch in range(8):
        for start, end in branch_ranges(found, branch):
            middle = found.at(0.5 * (start + end))
            assert middle.ok
            assert branch in middle.branches


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=60)
@given(seed=seeds, zeros=st.sets(st.sampled_from([0, 1, 2, 4, 5, 6])))
def test_at_even_poses_where_limits_are_met_together_no_arc_is_as_thin_as_rounding(name, seed, zeros):
    model = load_model(name)
    q = random_q(model, seed)
    q[sorted(zeros)], q[3] = 0.0, 0.7
    assert all(arc.end - arc.start > 1e-11 for arc in model.feasible_arcs(model.forward(q)).arcs)


def test_a_box_forbids_all_arm_angles_or_none_and_an_inactive_one_nothing():
    model = load_model("xMatePro7", tool=TOOL)
    T = model.forward(model.home)
    around = SafetyBox(size=(0.1, 0.1, 0.1), T_base_box=Pose(T.position))
    away = replace(around, T_base_box=Pose(T.position + [0.2, 0, 0]))
    free = model.feasible_arcs(T)
    assert model.feasible_arcs(T, around) == free
    assert model.feasible_arcs(T, replace(away, active=False)) == free
    boxed = model.feasible_arcs(T, away)
    assert boxed.feasible == ()
    assert all("safety box" in arc.reasons for arc in boxed.arcs)
    assert [arc.branches for arc in boxed.arcs] == [arc.branches for arc in free.arcs]
    assert "safety box" in repr(boxed)


@pytest.mark.parametrize("q", [[0.0] * 7, [0.3, 0.5, 0.2, 0.0, 0.1, 0.4, 0.5]])
def test_a_stretched_arm_has_no_arm_angle_to_choose(q):
    model = load_model("xMatePro7")
    found = model.feasible_arcs(model.forward(q))
    assert [arc.reasons for arc in found.arcs] == [("singularity",)]
    assert found.feasible == ()
    assert "no arm angle" in repr(found)


@pytest.mark.parametrize("q", [[0.3, 0.5, 0.2, 0.01, 0.1, 0.4, 0.5], [0.3, -0.5, 0.0, 1.0, 0.2, 0.4, 0.5]])
def test_an_arm_close_to_stretched_or_with_the_wrist_above_the_shoulder_is_singular_all_round(q):
    model = load_model("xMatePro7")
    if q[3] > 0.5:  # Lean the upper arm so that the wrist comes to 5 mm beside the vertical.
        upper, fore = 0.4375, 0.4125
        q[1] = -math.atan2(fore * math.sin(q[3]), upper + fore * math.cos(q[3])) + 0.005 / 0.75
    T = model.forward(q)
    found = model.feasible_arcs(T)
    assert all("singularity" in arc.reasons for arc in found.arcs)
    assert any(arc.branches for arc in found.arcs)  # Within the joint limits all the same.
    assert compare(model, T, np.linspace(-math.pi, math.pi, 101)) > 90


def test_a_circle_without_any_obstacle_is_one_range():
    model = load_model("xMatePro7")
    wide = replace(model.limits.joint, lower=np.full(7, -4.0), upper=np.full(7, 4.0))
    free = RobotModel(replace(model.description, limits=replace(model.limits, joint=wide)))
    found = free.feasible_arcs(free.forward(free.home))
    assert len(found.arcs) == 1
    ((start, end),) = found.feasible
    assert end - start == pytest.approx(math.tau)


def test_what_has_no_answer_is_a_named_error():
    model = load_model("xMatePro7")
    with pytest.raises(UnreachableError, match="out of reach"):
        model.feasible_arcs(Pose((2.0, 0, 0)))
    with pytest.raises(KinematicsError, match="6 axes"):
        load_model("xMate3").feasible_arcs(Pose((0.4, 0, 0.5)))


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=40)
@given(seed=seeds, psi=st.floats(-math.pi, math.pi))
def test_the_nearest_arm_angle_is_possible_and_no_possible_one_is_much_nearer(name, seed, psi):
    model = load_model(name, tool=TOOL)
    found = model.feasible_arcs(model.forward(random_q(model, seed)))
    angle = found.nearest(psi)
    assert angle is not None  # The pose was made from joint angles inside the limits.
    assert found.at(angle).branches
    samples = np.linspace(-math.pi, math.pi, 721)
    possible = samples[[bool(found.at(sample).branches) for sample in samples]]
    if possible.size:
        away = np.abs(np.remainder(possible - psi + math.pi, math.tau) - math.pi).min()
        assert abs(math.remainder(angle - psi, math.tau)) <= away + INSIDE + 1e-9
    if found.at(psi).branches:
        assert abs(math.remainder(angle - psi, math.tau)) < 1e-9


def test_where_no_arm_angle_is_possible_there_is_no_nearest_one_and_the_words_say_so():
    model = load_model("xMatePro7")
    found = model.feasible_arcs(Pose((0.3, 0.0, -0.55), model.forward(model.home).wxyz))
    assert found.nearest(0.0) is None
    assert repr(found) == "<FeasibleArcs at no arm angle; forbidden by: joint limits>"
