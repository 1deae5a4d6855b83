"""Frames, velocities and accelerations against numbers measured on the vendor's model library."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rcilab.core.errors import UnreachableError
from rcilab.core.spatial import Pose
from rcilab.model.robot_model import load_model

REFERENCE = json.loads((Path(__file__).parent / "reference_library.json").read_text())["models"]
TOLERANCE = 1e-9  # [m, rad] and their rates.


def arm(name):
    """The arm with the tool and the stiffness frame of the measurement."""
    tool, stiffness = (Pose.from_row_major(REFERENCE[name][key]) for key in ("tool", "stiffness"))
    return load_model(name, tool=tool).with_stiffness_frame(stiffness)


def column(name, key):
    return np.array([case[key] for case in REFERENCE[name]["cases"]])


def left_adjoint(T):
    """[[R, [p] R], [0, R]]: what takes a twist from the axes and origin of one frame to those of another."""
    x, y, z = T.position
    R, skew = T.rotation, np.array(((0, -z, y), (z, 0, -x), (-y, x, 0)))
    return np.block([[R, skew @ R], [np.zeros((3, 3)), R]])


@pytest.mark.parametrize("name", REFERENCE)
def test_the_stiffness_frame_is_where_the_vendor_has_it(name):
    model = arm(name)
    expected = column(name, "stiffness_pose")
    np.testing.assert_allclose(model.forward_path(column(name, "q"), "stiffness").reshape(-1, 16), expected, atol=1e-12)
    for q, pose in zip(column(name, "q"), expected, strict=True):
        assert model.pose(q, "stiffness").is_close(Pose.from_row_major(pose), 1e-12)


@pytest.mark.parametrize("name", REFERENCE)
def test_the_jacobian_of_a_joint_frame_agrees_and_later_joints_do_not_move_it(name):
    J = arm(name).jacobian(column(name, "q"), "joint5")
    np.testing.assert_allclose(J.reshape(-1, 42), column(name, "joint5_jacobian"), atol=TOLERANCE, rtol=0)
    assert not J[:, :, 5:].any()


@pytest.mark.parametrize("name", REFERENCE)
def test_velocity_and_acceleration_of_the_flange_agree(name):
    model, (q, dq, ddq) = arm(name), (column(name, key) for key in ("q", "dq", "ddq"))
    np.testing.assert_allclose(model.velocity(q, dq, "flange"), column(name, "twist"), atol=TOLERANCE, rtol=0)
    found = model.acceleration(q, dq, ddq, "flange")
    np.testing.assert_allclose(found, column(name, "acceleration"), atol=TOLERANCE, rtol=0)


@pytest.mark.parametrize("name", REFERENCE)
def test_the_vendors_quirk_is_known_its_jacobian_of_a_tool_is_not_the_derivative_of_the_tools_pose(name):
    model, q = arm(name), column(name, "q")
    at_flange, tool, offset = model.jacobian(q, "flange"), model.T_flange_tool, model.T_tool_stiffness
    quirk = left_adjoint(tool) @ at_flange
    np.testing.assert_allclose(quirk.reshape(-1, 42), column(name, "tool_jacobian"), atol=TOLERANCE, rtol=0)
    quirk = left_adjoint(offset @ tool) @ at_flange
    np.testing.assert_allclose(quirk.reshape(-1, 42), column(name, "stiffness_jacobian"), atol=TOLERANCE, rtol=0)
    for frame in ("tool", "stiffness"):
        T, step = model.forward_path(q, frame), 1e-6  # [rad]
        for joint in range(7):
            shift = step * np.eye(7)[joint]
            ahead, behind = model.forward_path(q + shift, frame), model.forward_path(q - shift, frame)
            slope = (ahead - behind) / (2 * step)
            turn = slope[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1)
            ours = model.jacobian(q, frame)[:, :, joint]
            np.testing.assert_allclose(slope[:, :3, 3], ours[:, :3], atol=1e-8)
            np.testing.assert_allclose(turn[:, (2, 0, 1), (1, 2, 0)], ours[:, 3:], atol=1e-8)
            assert np.abs(column(name, f"{frame}_jacobian").reshape(-1, 6, 7)[:, :, joint] - ours).max() > 1e-2


@pytest.mark.parametrize("name", REFERENCE)
def test_the_vendors_quirk_is_known_its_joint_velocity_is_not_always_the_smallest(name):
    model, q, twist = arm(name), column(name, "q"), column(name, "twist")
    ours, theirs = model.joint_velocity(q, twist, frame="flange"), column(name, "joint_velocity")
    np.testing.assert_allclose(model.velocity(q, theirs, "flange"), twist, atol=1e-5)
    exact = ~ours.damped
    assert exact.sum() >= 3
    np.testing.assert_allclose(model.velocity(q, ours.rates, "flange")[exact], twist[exact], atol=TOLERANCE, rtol=0)
    surplus = np.linalg.norm(theirs, axis=1) - np.linalg.norm(ours.rates, axis=1)
    assert (surplus > -1e-6).all()
    assert surplus.max() > 1e-2


@pytest.mark.parametrize("name", REFERENCE)
def test_the_vendors_quirk_is_known_its_joint_acceleration_is_no_number_and_ours_gives_the_acceleration_back(name):
    model, (q, dq, wanted) = arm(name), (column(name, key) for key in ("q", "dq", "acceleration"))
    ours = model.joint_acceleration(q, dq, wanted, frame="flange")
    assert np.isfinite(ours.rates).all()
    exact = ~ours.damped
    assert exact.sum() >= 3
    found = model.acceleration(q, dq, ours.rates, "flange")
    np.testing.assert_allclose(found[exact], wanted[exact], atol=TOLERANCE, rtol=0)


@pytest.mark.parametrize("name", REFERENCE)
def test_the_vendors_quirk_is_known_it_refuses_what_a_full_turn_or_another_branch_brings_inside_the_limits(name):
    """It keeps to the branch of the start, does not turn back, and writes the answer beyond its limits all the same."""
    model, bounds = load_model(name), load_model(name).limits.joint
    assert REFERENCE[name]["refused"]
    for case in REFERENCE[name]["refused"]:
        T, written = model.forward(case["q"]), np.array(case["q_written"])
        assert model.forward(written).is_close(T, TOLERANCE)
        beyond = np.flatnonzero((written < bounds.lower) | (written > bounds.upper)) + 1
        assert beyond.size
        found = refusal_or_solutions(model, T, case["psi"])
        if isinstance(found, UnreachableError):
            assert found.joint in beyond
            assert found.excess > 0.0
            continue
        same = [branch for branch in found.all if np.abs(full_turns_off(branch.q - written)).max() < TOLERANCE]
        assert len(same) == 1  # Theirs is among ours, and judged.
        assert same[0].ok or same[0].joint in beyond
        assert all(((q > bounds.lower) & (q < bounds.upper)).all() for q in found)
        assert all(model.forward(q).is_close(T, TOLERANCE) for q in found)


def refusal_or_solutions(model, T, psi):
    try:
        return model.inverse(T, psi=psi)
    except UnreachableError as error:
        return error


def full_turns_off(angles):
    return angles - 2 * np.pi * np.round(angles / (2 * np.pi))
