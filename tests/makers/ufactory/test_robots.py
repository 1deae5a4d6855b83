"""The UFACTORY arms: the numbers of the maker's client library and of its descriptions."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.conformance.check import check
from rcilab.core.errors import UnreachableError
from rcilab.core.spatial import Pose
from rcilab.makers.ufactory.robots import ROBOTS
from rcilab.model.kinematics.solvers.build import build_solver
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_line
from rcilab.robots.shapes import build_shapes
from tests.makers.ufactory.library import library_module, needs_library

ZERO_POSES = {  # x, y, z [m] with all joints at zero, flange down: the client library's, the 850's by its table.
    "xArm5": (0.207, 0.0, 0.112),
    "xArm6": (0.207, 0.0, 0.112),
    "xArm7": (0.206, 0.0, 0.1205),
    "Lite6": (0.087, 0.0, 0.1542),
    "850": (0.15, 0.0, 0.238),
}
DOWN = np.diag([1.0, -1.0, -1.0])  # Roll 180 degrees.
WEIGHTS = {
    "xArm5": 11.2,
    "xArm6": 12.2,
    "xArm7": 13.7,
    "Lite6": 7.2,
    "850": 20.0,
}  # [kg] Data sheets, with cables and covers.
robots = pytest.mark.parametrize("name", ROBOTS)


@robots
def test_the_flange_at_zero_is_where_the_client_library_has_it(name):
    model = load_model(name)
    pose = model.forward(np.zeros(model.n))
    np.testing.assert_allclose(pose.position, ZERO_POSES[name], atol=1e-12)
    np.testing.assert_allclose(pose.rotation, DOWN, atol=1e-12)


@robots
def test_centres_of_mass_are_inside_the_housings(name):
    model = load_model(name)
    shape = build_shapes(model.description, "coarse")
    for link, body in zip(model.description.links, shape.links, strict=True):
        depth = min(_outside(link.center_of_mass, capsule) for capsule in body.capsules)
        assert depth < 0.0


def _outside(point, capsule):
    line = capsule.end - capsule.start
    share = np.clip((point - capsule.start) @ line / (line @ line), 0.0, 1.0)
    return np.linalg.norm(point - capsule.start - share * line) - capsule.radius


@robots
def test_inertias_are_those_of_bodies_and_the_arm_weighs_what_its_data_sheet_says(name):
    description = load_model(name).description
    for link in (description.base, *description.links):
        smallest, middle, largest = np.linalg.eigvalsh(link.inertia)
        assert 0.0 < smallest <= largest < smallest + middle
    mass = sum(link.mass for link in (description.base, *description.links))
    assert 0.8 * WEIGHTS[name] < mass < 1.1 * WEIGHTS[name]


@robots
def test_the_drives_hold_the_arm_with_its_payload_everywhere(name):
    model = load_model(name)
    limits = model.limits.joint
    still = np.zeros(model.n)
    for q in np.random.default_rng(1).uniform(limits.lower, limits.upper, (200, model.n)):
        assert (np.abs(model.torque(q, still, still).gravity) < limits.torque).all()


@needs_library
@robots
def test_ranges_are_those_of_the_client_library(name):
    table = library_module("xarm.core.config.x_config").XCONF.Robot.JOINT_LIMITS
    axes, kind = {"xArm5": (5, 5), "xArm6": (6, 6), "xArm7": (7, 7), "Lite6": (6, 9), "850": (6, 12)}[name]
    limits = load_model(name).limits.joint
    np.testing.assert_array_equal(np.column_stack((limits.lower, limits.upper)), table[axes][kind])


@pytest.mark.parametrize(
    ("name", "solver"),
    [
        ("xArm5", "PlanarFive"),
        ("xArm6", "OffsetSix"),
        ("xArm7", "OffsetSeven"),
        ("Lite6", "OffsetSix"),
        ("850", "OffsetSix"),
    ],
)
def test_arms_have_a_closed_form(name, solver):
    assert type(build_solver(load_model(name).description)).__name__ == solver


def test_the_five_axes_of_the_xarm5_reach_what_they_can():
    model = load_model("xArm5")
    limits = model.limits.joint
    for q in np.random.default_rng(4).uniform(0.9 * limits.lower, 0.9 * limits.upper, (20, 5)):
        T = model.forward(q)
        found = model.inverse(T).all
        assert all(model.forward(branch.q).is_close(T, 1e-9) for branch in found)
        assert min(np.abs(np.sin((branch.q - q) / 2.0)).max() for branch in found) < 1e-6
    home = model.forward(model.home)
    aside = Pose(home.position + (0.05, 0.12, -0.1), (home @ Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.8))).wxyz)
    line = plan_line(model, model.home, aside)  # The flange stays down, and the tool turns about its own axis.
    assert model.forward(line.goal).is_close(aside, 1e-9)
    assert check(line, model).ok
    with pytest.raises(UnreachableError, match="no joint angles"):
        model.inverse(home @ Pose.from_rpy((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))


def test_joint_3_of_the_xarm7_keeps_its_full_turns_along_a_path():
    model = load_model("xArm7")
    q = np.array([0.3, -0.4, 4.0, 1.2, 0.2, 1.4, 0.5])
    T = model.forward(q)
    found = model.inverse(T, psi=model.arm_angle(q)).nearest(q)
    np.testing.assert_allclose(found, q, atol=1e-9)
    with pytest.raises(UnreachableError):
        model.inverse(model.forward(np.zeros(7)) @ T @ T @ T, psi=0.0)
