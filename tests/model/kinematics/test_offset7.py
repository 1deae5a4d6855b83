"""The Panda's kinematics: Craig's table, every solution at an elbow, and the arcs of elbows that a pose leaves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import KinematicsError, ModelError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.makers.franka.robots.arm import CRAIG, ELBOW_FLIP
from rcilab.model.kinematics.solvers.offset7.arm import build_offset_geometry, trace
from rcilab.model.kinematics.solvers.offset7.singularity import held_singularity_path
from rcilab.model.robot_model import load_model
from rcilab.robots.description import CraigRow, rows_from_craig

PANDA = load_model("panda")
ARM = build_offset_geometry(PANDA.description)
LIMITS = PANDA.limits.joint
TOOL = Pose.from_rpy((0.0, 0.0, 0.1034), (0.0, 0.0, -math.pi / 4))
TOLERANCE = 1e-9  # [m] and rotation elements.


def configurations(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(LIMITS.lower, LIMITS.upper, (count, 7))


def craig_frames(q: np.ndarray) -> list[np.ndarray]:
    """Frames of links 1 to 7 and the flange by the page's own product, RotX(alpha) TransX(a) RotZ(theta) TransZ(d)."""
    T, frames = np.eye(4), []
    for row, angle in zip(CRAIG, [*q, 0.0], strict=True):
        ca, sa, c, s = math.cos(row.alpha), math.sin(row.alpha), math.cos(angle), math.sin(angle)
        about_x = np.array([[1, 0, 0, row.a], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        about_z = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, row.d], [0, 0, 0, 1]])
        T = T @ about_x @ about_z
        frames.append(T)
    return frames


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference of angles, whole turns aside, [rad]."""
    return float(np.abs(np.remainder(np.asarray(a) - b + math.pi, math.tau) - math.pi).max())


def test_the_flange_is_where_the_makers_table_puts_it():
    assert PANDA.forward(PANDA.home).position == pytest.approx([0.30689, 0.0, 0.59028], abs=5e-6)
    for q in configurations(200, seed=1):
        np.testing.assert_allclose(PANDA.forward(q).matrix, craig_frames(q)[-1], atol=1e-14)


def test_joint_axes_of_the_standard_rows_are_those_of_craigs_frames():
    q = configurations(1, seed=2)[0]
    axes = PANDA.jacobian(q)[3:].T
    np.testing.assert_allclose(axes, [frame[:3, 2] for frame in craig_frames(q)[:7]], atol=1e-14)


def test_a_craig_table_that_standard_rows_cannot_say_is_refused():
    with pytest.raises(ValueError, match="base z axis"):
        rows_from_craig((CraigRow(a=0.1, alpha=0.0, d=0.3), *CRAIG[1:]))


def test_the_elbow_flips_where_the_arm_is_longest_and_that_is_the_makers_number():
    assert ARM.flip == pytest.approx(ELBOW_FLIP, abs=1e-14)
    wrist = [math.dist(craig_frames(np.array([0, 0, 0, q4, 0, 0, 0]))[4][:3, 3], (0, 0, 0.333)) for q4 in (
        ELBOW_FLIP - 1e-3, ELBOW_FLIP, ELBOW_FLIP + 1e-3)]  # fmt: skip
    assert wrist[1] == pytest.approx(ARM.reach[1], abs=1e-12)
    assert wrist[1] > max(wrist[0], wrist[2])
    assert PANDA.elbow(PANDA.home) == (0.0, -1)
    assert PANDA.elbow([0, 0, 0.3, ELBOW_FLIP + 0.01, 0, 1, 0]) == (0.3, 1)
    with pytest.raises(KinematicsError, match="no elbow flip"):
        load_model("xMatePro7").elbow(np.zeros(7))


@settings(max_examples=30)
@given(st.integers(0, 2**32))
def test_in_closed_form_every_branch_at_an_angle_of_joint_7_gives_the_pose_back(seed):
    q = configurations(1, seed)[0]
    T = PANDA.forward(q)
    table, beyond = trace(ARM, T.rotation, T.position, np.array([q[6], q[6] + 0.3]))
    branches = table.reshape(-1, 7)
    branches = branches[np.isfinite(branches).all(axis=1)]
    assert beyond[0] <= 1e-12
    np.testing.assert_allclose(
        PANDA.forward_path(branches), np.broadcast_to(T.matrix, (len(branches), 4, 4)), atol=1e-9
    )
    turned = q + [math.pi, -2.0 * q[1], math.pi, 0, 0, 0, 0]
    assert min(min(apart(row, q), apart(row, turned)) for row in branches) < 1e-6


@settings(max_examples=25)
@given(st.integers(0, 2**32))
def test_every_solution_has_the_pose_and_the_elbow_and_the_arms_own_is_among_them(seed):
    q = configurations(1, seed)[0]
    model = PANDA.with_tool(TOOL)
    T = model.forward(q)
    found = model.inverse(T, psi=model.arm_angle(q), near=q)
    assert all(model.forward(branch.q).is_close(T, TOLERANCE) for branch in found.all)
    assert all(apart(branch.q[2], q[2]) < 1e-12 for branch in found.all)
    for solution in found:
        assert ((LIMITS.lower < solution) & (solution < LIMITS.upper)).all()
    np.testing.assert_allclose(found.nearest(q), q, atol=1e-6)


def test_without_a_hint_nearly_every_configuration_is_found_again():
    lost = 0
    for q in configurations(60, seed=3):
        found = PANDA.inverse(PANDA.forward(q), psi=q[2])
        lost += min(apart(branch.q, q) for branch in found.all) > 1e-6
    assert lost <= 1  # Only where two solutions meet one of them may be taken for both.


def test_without_an_arm_angle_a_solution_is_found_for_every_pose_the_arm_can_take():
    for q in configurations(25, seed=4):
        T = PANDA.forward(q)
        assert PANDA.forward(PANDA.inverse(T, near=q)[0]).is_close(T, TOLERANCE)


@pytest.mark.parametrize("short", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_a_stretched_arm_has_the_nearest_solution_and_beyond_a_named_error(short):
    q = np.array([0.2, 0.4, 0.1, ELBOW_FLIP, 0.3, 1.5, 0.5])
    T = PANDA.forward(q)
    outward = craig_frames(q)[4][:3, 3] - [0, 0, 0.333]
    outward /= np.linalg.norm(outward)
    pose = Pose(T.position - short * outward, T.wxyz)
    solution = PANDA.inverse(pose, near=q).nearest(q)
    assert np.isfinite(solution).all()
    assert PANDA.forward(solution).is_close(pose, TOLERANCE)
    assert np.abs(solution - q).max() < 40.0 * math.sqrt(max(short, 1e-12))


def test_a_pose_out_of_reach_says_by_how_much():
    with pytest.raises(UnreachableError, match=r"out of reach by \d+\.\d mm") as caught:
        PANDA.inverse(Pose((2.0, 0.0, 0.333)))
    assert caught.value.distance == pytest.approx(2.0 - ARM.reach[1] - 0.088, abs=0.02)


def test_an_elbow_that_the_pose_does_not_leave_is_named():
    with pytest.raises(UnreachableError, match="arm angle"):
        PANDA.inverse(PANDA.forward(PANDA.home), psi=1.5)


def test_many_poses_at_once_have_the_solutions_of_each():
    q = configurations(12, seed=5)
    found = PANDA.inverse_batch(PANDA.forward_path(q), q[:, 2])
    assert found.q.shape[2] == 7
    for row, T in enumerate(PANDA.forward_path(q)):
        alone = PANDA.inverse(T, psi=q[row, 2]).all
        real = found.q[row][np.isfinite(found.q[row]).all(axis=1)]
        assert len(real) == len(alone)
        assert all(min(apart(branch.q, other) for other in real) < 1e-9 for branch in alone)
    np.testing.assert_allclose(found.nearest(q), q, atol=1e-6)


def test_the_arcs_hold_exactly_the_elbows_that_have_a_solution():
    rng = np.random.default_rng(6)
    looked_at = 0
    for q in configurations(6, seed=7):
        T = PANDA.forward(q)
        arcs = PANDA.feasible_arcs(T)
        near_end = min(abs(q[2] - end) for arc in arcs.arcs for end in (arc.start, arc.end)) < 1e-3
        assert arcs.at(q[2]).reasons in ((), ("singularity",)) or near_end
        assert sum(arc.end - arc.start for arc in arcs.arcs) == pytest.approx(math.tau, abs=1e-6)
        for psi in rng.uniform(-math.pi, math.pi, 8):
            arc = arcs.at(psi)
            if min(psi - arc.start, arc.end - psi) < 1e-2 or arc.reasons == ("singularity",):
                continue
            try:
                possible = len(PANDA.inverse(T, psi=psi)) > 0
            except UnreachableError:
                possible = False
            assert possible == arc.ok, (psi, arc)
            looked_at += 1
    assert looked_at > 30


def test_arcs_name_singularities_where_two_solutions_are_about_to_meet():
    found = [PANDA.feasible_arcs(PANDA.forward(q)) for q in configurations(6, seed=7)]
    singular = [(row, arc) for row, arcs in enumerate(found) for arc in arcs.arcs if arc.reasons == ("singularity",)]
    assert singular
    for row, arc in singular:
        T = PANDA.forward(configurations(6, seed=7)[row])
        solutions = PANDA.inverse(T, psi=(arc.start + arc.end) / 2.0)
        assert held_singularity_path(ARM, np.array(list(solutions))).max() > 0.99


def test_another_table_is_refused():
    with pytest.raises(ModelError, match="no closed-form inverse"):
        build_offset_geometry(load_model("xMatePro7").description)
