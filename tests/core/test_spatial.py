from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.command import CartesianPosition
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import IDENTITY, Pose, rotation_between
from rcilab.model.robot_model import load_model
from rcilab.motion import Waypoint, plan_line

angles = st.floats(-3.1, 3.1)
lengths = st.floats(-2.0, 2.0)
poses = st.builds(
    lambda x, y, z, a, b, c: Pose.from_rpy((x, y, z), (a, b, c)), lengths, lengths, lengths, angles, angles, angles
)


@given(poses, poses)
def test_composition_is_the_matrix_product(a, b):
    np.testing.assert_allclose((a @ b).matrix, a.matrix @ b.matrix, atol=1e-12)


@given(poses)
def test_a_pose_and_its_inverse_cancel(pose):
    assert (pose @ pose.inverse()).is_close(IDENTITY, 1e-12)


@given(poses)
def test_every_spelling_gives_the_pose_back(pose):
    assert Pose(pose.position, pose.wxyz).is_close(pose, 1e-12)
    assert Pose.from_matrix(pose.matrix).is_close(pose, 1e-12)
    assert Pose.from_row_major(pose.as_row_major()).is_close(pose, 1e-12)
    assert Pose.from_rpy(pose.position, pose.rpy).is_close(pose, 1e-7)  # Gimbal lock costs half the digits.


@pytest.mark.parametrize("wxyz", [(0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (0, 0.6, 0.8, 0)])
def test_half_turns_survive_the_quaternion(wxyz):
    np.testing.assert_allclose(np.abs(Pose(wxyz=wxyz).wxyz), np.abs(wxyz), atol=1e-12)


def test_what_is_no_pose_is_refused_in_words():
    mirror, scaled, shifted, unknown = (np.eye(4) for _ in range(4))
    mirror[0, 0], scaled[0, 0], shifted[3, 0], unknown[0, 3] = -1.0, 1.1, 1.0, np.nan
    for matrix, word in (
        (mirror, "reflection"),
        (scaled, "not a rotation"),
        (shifted, "last row"),
        (unknown, "finite"),
    ):
        with pytest.raises(InvalidValueError, match=word):
            Pose.from_matrix(matrix)
    with pytest.raises(InvalidValueError, match="norm is zero"):
        Pose(wxyz=(0, 0, 0, 0))


@pytest.mark.parametrize(
    "other",
    [3, None, "x", [[1.0], [1.0, 2.0]], np.eye(3)[:2, :2]],
    ids=["number", "nothing", "word", "ragged", "matrix"],
)
def test_a_pose_times_what_is_no_pose_says_how_to_make_one(other):
    with pytest.raises(InvalidValueError, match="must be a Pose"):
        IDENTITY @ other
    with pytest.raises(InvalidValueError, match="must be a Pose"):
        IDENTITY.is_close(other)


def test_a_matrix_that_is_no_pose_is_shown_in_one_short_line():
    with pytest.raises(InvalidValueError, match=r"^pose needs shape \(4, 4\), got None$"):
        Pose.from_matrix(None)
    with pytest.raises(InvalidValueError, match=r"^pose needs shape \(4, 4\), got an array of shape \(3, 3\)$"):
        Pose.from_matrix(np.eye(3))
    broken = np.eye(4)
    broken[1, 3] = np.nan
    with pytest.raises(InvalidValueError, match=r"^pose\[1, 3\] must be finite, got nan$"):
        Pose.from_matrix(broken)


@given(poses, st.tuples(lengths, lengths, lengths), st.floats(-9.0, 0.49))
def test_the_turn_between_two_rotations_is_the_one_that_was_made(pose, axis, exponent):
    if np.linalg.norm(axis) < 1e-3:
        return
    angle = 10.0**exponent  # 1 nrad, which is one cycle of a slow wrist, up to nearly half a turn.
    axis = np.array(axis) / np.linalg.norm(axis)
    step = Pose(wxyz=[np.cos(angle / 2.0), *(np.sin(angle / 2.0) * axis)])
    turn = rotation_between(pose.parts[0], (step @ pose).parts[0])
    np.testing.assert_allclose(turn, angle * axis, rtol=1e-6, atol=1e-15 + 1e-6 * angle)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.0, -0.8), (-0.48, 0.6, 0.64)])
def test_half_a_turn_has_an_axis_and_a_length_of_pi(axis):
    a = np.array(axis, dtype=float)
    old = Pose.from_rpy((0.0, 0.0, 0.0), (0.2, 0.4, -0.3))
    turn = np.array(rotation_between(old.parts[0], (Pose(wxyz=[0.0, *a]) @ old).parts[0]))
    assert np.linalg.norm(turn) == pytest.approx(np.pi)
    assert abs(turn @ a) == pytest.approx(np.pi)


@given(st.floats(-14.0, 0.0), poses)
def test_near_half_a_turn_the_axis_is_as_exact_as_elsewhere(exponent, old):
    axis = np.array((0.48, -0.6, 0.64))
    angle = math.pi - 10.0**exponent
    new = Pose(wxyz=[math.cos(angle / 2.0), *(math.sin(angle / 2.0) * axis)]) @ old
    turn = np.array(rotation_between(old.parts[0], new.parts[0]))
    if exponent < -13.0:
        turn = math.copysign(1.0, turn @ axis) * turn  # The matrix no longer tells the two directions apart.
    np.testing.assert_allclose(turn, angle * axis, rtol=0.0, atol=1e-13)


def test_no_turn_is_zero():
    old = Pose.from_rpy((0.0, 0.0, 0.0), (0.2, 0.4, -0.3)).parts[0]
    np.testing.assert_allclose(rotation_between(old, old), np.zeros(3), atol=1e-16)


@given(poses, poses)
def test_a_matrix_serves_as_a_pose_in_products(a, b):
    assert (a @ b.matrix).is_close(a @ b, 1e-12)
    assert (a.matrix @ b).is_close(a @ b, 1e-12)
    assert np.array_equal(np.asarray(a), a.matrix)


@given(poses)
def test_a_pose_times_points_moves_them(pose):
    points = np.array([[0.1, -0.2, 0.3], [0.0, 0.0, 0.0]])
    moved = pose @ points
    assert moved.shape == (2, 3)
    for point, there in zip(points, moved, strict=True):
        np.testing.assert_allclose(there, (pose @ Pose(point)).position, atol=1e-12)
        np.testing.assert_allclose(pose @ point, there, atol=1e-12)


def test_what_takes_a_pose_takes_its_matrix():
    model = load_model("xMatePro7")
    T = model.forward(model.home).matrix
    T[2, 3] -= 0.05
    assert np.array_equal(plan_line(model, model.home, T).q, plan_line(model, model.home, Pose.from_matrix(T)).q)
    assert model.with_tool(T).T_flange_tool.is_close(T, 1e-9)
    assert SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=T).T_base_box.is_close(T)
    assert Waypoint.line(T).position == pytest.approx(T[:3, 3])
    assert np.array_equal(CartesianPosition(Pose.from_matrix(T)).T_base_tool, Pose.from_matrix(T).matrix)
