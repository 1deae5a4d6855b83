"""The URDF of GetRobotModel: what a client requires of it, and the same arm as ours."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
import pytest

from rcilab.makers.franka.controller.robot_model import build_robot_model
from rcilab.model.robot_model import load_model

MODEL = load_model("FR3")
TEXT = build_robot_model(MODEL.description)
RANDOM = np.random.default_rng(7)
ANGLES = RANDOM.uniform(MODEL.limits.joint.lower, MODEL.limits.joint.upper, (20, 7))


@pytest.fixture(scope="module")
def arm() -> tuple[pin.Model, pin.Data]:
    model = pin.buildModelFromXML(TEXT)
    return model, model.createData()


def test_it_has_what_a_client_requires() -> None:
    robot = ET.fromstring(TEXT)
    assert robot.get("name") == "fr3"
    assert "link8" in {link.get("name") for link in robot.findall("link")}
    joints = [joint for joint in robot.findall("joint") if joint.get("type") == "revolute"]
    assert [joint.get("name") for joint in joints] == [f"joint{number}" for number in range(1, 8)]
    limits, ends = MODEL.limits.joint, MODEL.limits.joint.near_ends
    assert ends is not None
    for i, joint in enumerate(joints):
        limit, near = joint.find("limit"), joint.find("position_based_velocity_limits")
        assert limit is not None
        assert near is not None
        found = [float(limit.get(name, "nan")) for name in ("lower", "upper", "velocity", "effort")]
        assert found == [limits.lower[i], limits.upper[i], limits.velocity[i], limits.torque[i]]
        found = [float(near.get(name, "nan")) for name in ("velocity_offset", "deceleration_limit")]
        assert found == [ends.offset[i], ends.deceleration[i]]


def test_the_flange_is_where_ours_is(arm: tuple[pin.Model, pin.Data]) -> None:
    model, data = arm
    for q in ANGLES:
        pin.framesForwardKinematics(model, data, q)
        found = data.oMf[model.getFrameId("link8")].homogeneous
        np.testing.assert_allclose(found, MODEL.forward(q).matrix, rtol=0.0, atol=1e-12)


def test_its_dynamics_are_ours(arm: tuple[pin.Model, pin.Data]) -> None:
    model, data = arm
    body = MODEL.rigid_body
    for q in ANGLES:
        dq, ddq = RANDOM.uniform(-2.0, 2.0, (2, 7))
        np.testing.assert_allclose(pin.rnea(model, data, q, dq, ddq), body.full_torque(q, dq, ddq), rtol=0.0, atol=1e-9)


def test_an_arm_without_bounds_near_the_ends_has_none_there() -> None:
    robot = ET.fromstring(build_robot_model(load_model("Panda").description))
    near = robot.findall(".//position_based_velocity_limits")
    assert len(near) == 7
    # Of the smallest angle to the end that counts, far above any velocity.
    assert all((2e-6 * float(element.get("deceleration_limit", "0"))) ** 0.5 > 10.0 for element in near)
