"""The inverse of many poses against the scalar one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError, UnreachableError
from rcilab.core.spatial import Pose
from rcilab.makers.rokae.robots import ROBOTS
from rcilab.model.robot_model import RobotModel, load_model

TOOL = Pose.from_rpy((0.03, -0.02, 0.12), (0.3, -0.4, 0.5))
CLEAR = 0.01  # Sine of the angles at which axes line up: from here on rounding costs at most two digits.


def configurations(model, count, seed):
    limits = model.limits.joint
    return np.random.default_rng(seed).uniform(limits.lower, limits.upper, (count, model.n))


def around(angles):
    """Angles brought to [-pi, pi]: -pi and pi are the same."""
    return np.remainder(angles + math.pi, math.tau) - math.pi


def clearance(model, q, T):
    """Smallest sine next to which an angle of the solution is badly conditioned."""
    row = model.description.dh
    wrist = T[:3, 3] - row[-1].d * T[:3, 2] - [0, 0, row[0].d]
    bends = (1, 3, 5) if model.n == 7 else (2, 4)
    level = math.hypot(wrist[0], wrist[1]) / np.linalg.norm(wrist)
    return min(level, *(abs(math.sin(q[i])) for i in bends))


def scalar_branches(model, T, psi):
    """The branches of the scalar inverse, whether or not a joint limit forbids all of them."""
    from rcilab.model.kinematics.solvers.spherical.inverse import build_geometry, inverse_seven, inverse_six

    geometry, pose = build_geometry(model.description), Pose.from_matrix(T)
    return np.array(inverse_seven(geometry, pose, psi, None) if model.n == 7 else inverse_six(geometry, pose, None))


@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_every_branch_is_that_of_the_scalar_inverse(name, seed):
    model, rng = load_model(name), np.random.default_rng(seed)
    T = model.forward_path(configurations(model, 40, seed))
    psi = rng.uniform(-math.pi, math.pi, len(T))
    found = model.inverse_batch(T, psi)
    limits, compared = model.limits.joint, 0
    for row in range(len(T)):
        expected = scalar_branches(model, T[row], psi[row])
        if min(clearance(model, q, T[row]) for q in expected) > CLEAR:
            np.testing.assert_allclose(around(found.q[row] - expected), 0.0, atol=1e-12)
            inside = ((expected > limits.lower) & (expected < limits.upper)).all(axis=1)
            np.testing.assert_array_equal(found.inside[row], inside)
            compared += 1
    assert compared > 20


@pytest.mark.parametrize("name", ROBOTS)
def test_every_branch_puts_the_tool_at_its_pose(name):
    model = load_model(name, tool=TOOL)
    q = configurations(model, 3000, seed=1)  # More than one block.
    T = model.forward_path(q)
    found = model.inverse_batch(T, [model.arm_angle(row) for row in q] if model.n == 7 else 0.0)
    assert len(found) == 3000
    assert found.reachable.all()
    for branch in range(8):
        np.testing.assert_allclose(model.forward_path(found.q[:, branch]), T, atol=1e-9)
    np.testing.assert_allclose(found.nearest(q), q, atol=1e-6)
    np.testing.assert_allclose(
        found.nearest(model.home)[7], model.inverse(T[7], psi=psi_of(model, q[7])).nearest(model.home), atol=1e-9
    )


def psi_of(model, q):
    return model.arm_angle(q) if model.n == 7 else None


@pytest.mark.parametrize("name", ROBOTS)
def test_singular_poses_are_answered_as_the_scalar_inverse_does(name):
    model = load_model(name)
    q = configurations(model, 60, seed=2)
    q[:20, -2], q[20:30, -4], q[30:40, 1], q[40:50] = 0.0, 0.0, 0.0, 0.0
    T = model.forward_path(q)
    found = model.inverse_batch(T, 0.3)
    for branch in range(8):
        np.testing.assert_allclose(model.forward_path(found.q[:, branch]), T, atol=1e-9)
    np.testing.assert_allclose(around(found.q[45] - scalar_branches(model, T[45], 0.3)), 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_pose_out_of_reach_is_no_number_and_the_others_do_not_care(name):
    model = load_model(name)
    T = np.tile(model.forward(model.home).matrix, (5, 1, 1))
    T[2, :3, 3] = 3.0, 0.0, 0.0
    found = model.inverse_batch(T)
    assert found.reachable.tolist() == [True, True, False, True, True]
    assert np.isnan(found.q[2]).all()
    assert np.isnan(found.nearest(model.home)[2]).all()
    assert np.isfinite(found.q[[0, 1, 3, 4]]).all()
    assert "4 inside" in repr(found)
    with pytest.raises(UnreachableError):
        model.inverse(T[2])


def test_joint_offsets_of_another_table_are_counted_in():
    from dataclasses import replace

    upright = load_model("xMate3")
    rows = tuple(replace(row, theta_offset=0.0) for row in upright.description.dh)
    literal = RobotModel(replace(upright.description, dh=rows))
    T = upright.forward_path(configurations(upright, 50, seed=3))
    for branch in range(8):
        np.testing.assert_allclose(literal.forward_path(literal.inverse_batch(T).q[:, branch]), T, atol=1e-9)


def test_a_joint_with_more_than_a_turn_is_moved_by_full_turns_to_come_near():
    model = load_model("xMatePro7")
    q = np.array([0.1, 0.5, 0.2, 1.0, 0.3, 0.7, math.radians(300)])
    found = model.inverse_batch(model.forward_path([q, q]), model.arm_angle(q))
    np.testing.assert_allclose(found.nearest(q), [q, q], atol=1e-9)
    with pytest.raises(InvalidValueError, match="near"):
        found.nearest([0.0] * 6)


def test_solutions_cannot_be_written_to():
    model = load_model("xMatePro7")
    found = model.inverse_batch(model.forward_path([model.home]))
    for array in (found.q, found.inside):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def sheared(T):
    T[1, 0, 1] += 0.1


def mirrored(T):
    T[1, :3, 0] *= -1.0


def endless(T):
    T[1, 0, 3] = np.inf


def unfinished(T):
    T[1, 3, 3] = 0.0


@pytest.mark.parametrize("spoil", [sheared, mirrored, endless, unfinished])
def test_what_is_no_pose_is_refused(spoil):
    model = load_model("xMatePro7")
    T = model.forward_path(configurations(model, 3, seed=4)).copy()
    spoil(T)
    with pytest.raises(InvalidValueError, match="pose"):
        model.inverse_batch(T)


def test_arguments_of_another_shape_are_refused():
    model = load_model("xMatePro7")
    T = model.forward_path(configurations(model, 3, seed=4))
    for bad in ([0.0, 0.1], np.nan, np.zeros((3, 1))):
        with pytest.raises(InvalidValueError, match="psi"):
            model.inverse_batch(T, bad)
    with pytest.raises(InvalidValueError, match=r"\(4, 4\), needs|shape"):
        model.inverse_batch(T[0])
