from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox, active_box, require_box
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model

TURNED = SafetyBox(size=(0.4, 0.6, 1.0), T_base_box=Pose.from_rpy((0.5, -0.2, 0.4), (0.3, -0.7, 2.0)))


def at(x: float, y: float, z: float) -> list[float]:
    """A point given in the box's frame, in base."""
    return (TURNED.T_base_box @ Pose((x, y, z))).position.tolist()


@pytest.mark.parametrize(
    ("point", "excess"),
    [
        ((0.0, 0.0, 0.0), -0.2),
        ((0.15, 0.0, 0.0), -0.05),
        ((0.2, 0.0, 0.0), 0.0),
        ((0.25, 0.1, -0.2), 0.05),
        ((0.0, -0.34, 0.0), 0.04),
        ((0.23, 0.34, 0.5), 0.05),
        ((0.3, 0.5, 0.7), 0.3),
    ],
)
def test_excess_is_the_distance_from_the_box_and_minus_the_depth_inside(point, excess):
    assert TURNED.excess(at(*point)) == pytest.approx(excess, abs=1e-12)


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_excess_agrees_with_the_nearest_point_of_the_box(point):
    local = TURNED.T_base_box.rotation.T @ (np.array(point) - TURNED.T_base_box.position)
    half = np.array(TURNED.size) / 2.0
    distance = float(np.linalg.norm(local - np.clip(local, -half, half)))
    excess = TURNED.excess(point)
    assert max(excess, 0.0) == pytest.approx(distance, abs=1e-12)
    assert (excess <= 0.0) == bool((np.abs(local) <= half).all())


@pytest.mark.parametrize(
    ("point", "face", "distance"),
    [((0.25, 0.1, -0.2), "+x", 0.05), ((0.23, -0.36, 0.5), "−y", 0.06), ((0.0, 0.0, -0.499), "−z", -0.001)],
)
def test_the_face_that_a_point_lies_farthest_past_is_named(point, face, distance):
    assert TURNED.exceeded_face(at(*point)) == (face, pytest.approx(distance, abs=1e-12))


def test_a_path_of_points_is_judged_as_each_of_them():
    points = np.random.default_rng(3).normal(scale=0.6, size=(200, 3))
    assert TURNED.excess_path(points) == pytest.approx([TURNED.excess(p) for p in points.tolist()], abs=1e-12)


def test_the_corners_lie_on_the_box_and_are_as_far_apart_as_it_is_large():
    corners = TURNED.corners()
    assert corners.shape == (8, 3)
    assert TURNED.excess_path(corners) == pytest.approx(np.zeros(8), abs=1e-12)
    assert np.ptp(corners @ TURNED.T_base_box.rotation, axis=0) == pytest.approx(TURNED.size)


@pytest.mark.parametrize("size", [(1.0, 1.0), (1.0, 0.0, 1.0), (1.0, -1.0, 1.0), (1.0, float("nan"), 1.0)])
def test_a_size_that_is_none_is_refused(size):
    with pytest.raises(InvalidValueError, match="must be three lengths above 0"):
        SafetyBox(size=size, T_base_box=Pose())


def test_a_pose_that_is_none_is_refused():
    with pytest.raises(InvalidValueError, match="must be a Pose"):
        SafetyBox(size=(1.0, 1.0, 1.0), T_base_box=np.eye(3))


def test_only_an_active_box_bounds_anything_and_what_is_no_box_is_refused_in_words():
    assert active_box(None) is None
    assert active_box(replace(TURNED, active=False)) is None
    assert active_box(TURNED) is TURNED
    assert require_box(still := replace(TURNED, active=False)) is still
    model = load_model("xMatePro7")
    for ask in (
        lambda: model.feasible_arcs(model.forward(model.home), "box"),
        lambda: model.sample_workspace(5, box=3),
        lambda: require_box(None),
    ):
        with pytest.raises(InvalidValueError, match="must be a SafetyBox"):
            ask()
