"""The circle of the elbow: where the arm's own elbow is, at every arm angle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.errors import KinematicsError, SingularError
from rcilab.model.robot_model import load_model
from tests.model.kinematics.elbow import branch_ranges

PRO7 = load_model("xMatePro7")
BENT = np.array([0.3, 0.5, -0.4, 1.1, 0.2, 1.2, -0.5])


@pytest.mark.parametrize("name", ["xMatePro7", "xMatePro3"])
@pytest.mark.parametrize("psi", [-2.0, 0.0, 1.3])
def test_the_elbow_of_every_branch_is_on_the_circle_at_its_arm_angle(name, psi):
    model = load_model(name)
    circle = model.elbow_circle(BENT)
    batch = model.inverse_batch(model.forward(BENT).matrix[None], psi)
    for q in batch.q[0]:
        assert np.allclose(model.joint_frames(q)[2].position, circle.points(psi)[0], atol=1e-9)


def test_the_circle_goes_through_the_elbow_it_was_asked_with():
    psi = PRO7.arm_angle(BENT)
    assert np.allclose(PRO7.elbow_circle(BENT).points(psi)[0], PRO7.joint_frames(BENT)[2].position, atol=1e-12)


@pytest.mark.parametrize("psi", [-3.1, -1.0, 0.01, 2.2])
def test_a_line_of_sight_at_a_point_of_the_circle_finds_its_arm_angle(psi):
    circle = PRO7.elbow_circle(BENT)
    eye = np.array([2.0, -2.1, 1.45])
    through = eye + 0.7 * (circle.points(psi, 0.1)[0] - eye)
    assert abs(math.remainder(circle.angle_along(eye, through, psi, 0.1) - psi, math.tau)) < math.radians(0.3)


def test_a_circle_seen_from_its_edge_keeps_to_the_side_that_was_held():
    circle = PRO7.elbow_circle(BENT)
    eye = circle.center + 3.0 * circle.upward
    for near in (0.0, math.pi):
        assert abs(math.remainder(circle.angle_along(eye, circle.center, near) - near, math.tau)) < 0.02


def test_a_stretched_arm_a_short_one_and_one_with_offsets_have_no_circle():
    with pytest.raises(SingularError):
        PRO7.elbow_circle(np.array([0.0, 0.5, 0.0, 0.0, 0.0, 0.5, 0.0]))
    with pytest.raises(KinematicsError, match="6 axes"):
        load_model("xMate3").elbow_circle(np.zeros(6))
    with pytest.raises(KinematicsError, match="offsets"):
        load_model("Panda").elbow_circle(BENT)


def test_the_nearest_arm_angle_of_one_branch_is_possible_in_that_branch():
    arcs = PRO7.feasible_arcs(PRO7.forward(BENT))
    for branch in range(8):
        found = arcs.nearest(2.5, branch)
        assert (found is None) == (not branch_ranges(arcs, branch))
        if found is not None:
            assert branch in arcs.at(found).branches
