"""What the integration tests of franky do, through the same calls, with a virtual FR3 and its hand."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

from tests.makers.franka.clients.conftest import Served, served

if find_spec("franky") is None:
    pytest.skip("franky-control has no wheel for this Python or machine", allow_module_level=True)

START = np.array([0.0, 0.0, 0.0, -1.57, 0.0, 1.57, 0.785])
NEAR = np.array([-0.1, 0.1, 0.1, -1.5, 0.1, 1.6, 0.8])
JOINTS, TOOL = 0.03, 0.025  # [rad], [m] How close motions end.
WIDTH = 0.005  # [m]


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with served("FR3", tool="hand") as running:
        yield running


@pytest.fixture(scope="module")
def process() -> Iterator[ProcessPoolExecutor]:
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as executor:
        yield executor


@pytest.fixture
def run(arm: Served, process: ProcessPoolExecutor) -> Callable[..., Any]:
    """Runs one of `franky_programs` with the arm at its start; returns its result."""
    arm.place(*START)
    return lambda name, *values: process.submit(call, name, arm.host, *values).result(60.0)


def call(name: str, *values: object) -> Any:
    """Runs a program; in the other process only."""
    from tests.makers.franka.clients import franky_programs

    return getattr(franky_programs, name)(*values)


def along_axes(length: float) -> list[list[float]]:
    """Steps along x, -x, y, -y, z and -z."""
    return [list(side * row) for row in length * np.eye(3) for side in (1.0, -1.0)]


def test_every_joint_moves_to_goals_on_both_sides(run: Callable[..., Any]) -> None:
    steps = [[-0.3, 0.1, 0.3, 0.2, 0.1, 0.2, -0.1], [0.2, -0.1, -0.2, -0.2, -0.1, -0.1, 0.2]]
    goals = [START + step for step in steps]
    for goal, found in zip(goals, run("joint_waypoints", goals), strict=True):
        np.testing.assert_allclose(found, goal, atol=JOINTS)


def test_joints_move_by_their_velocities(run: Callable[..., Any]) -> None:
    rates = 0.1 * np.array([[1, 1, 1, 1, 1, 1, 1], [-1, -1, -1, 1, -1, 1, -1], [1, -1, 1, -1, 1, -1, 1]])
    for rate, moved in zip(rates, run("joint_velocities", rates.tolist(), 300), strict=True):
        np.testing.assert_allclose(moved, 0.35 * rate, atol=0.01)


def test_the_tool_moves_along_every_axis(run: Callable[..., Any]) -> None:
    steps = along_axes(0.03)
    for step, moved in zip(steps, run("poses", steps), strict=True):
        np.testing.assert_allclose(moved[:3, 3], step, atol=0.003)
        np.testing.assert_allclose(moved[:3, :3], np.zeros((3, 3)), atol=0.02)


def test_the_tool_moves_by_its_velocities(run: Callable[..., Any]) -> None:
    rates = along_axes(0.02)
    for rate, moved in zip(rates, run("tool_velocities", rates, 300), strict=True):
        np.testing.assert_allclose(moved, 0.31 * np.array(rate), atol=0.002)


def test_joint_impedance_ends_near_its_goal(run: Callable[..., Any]) -> None:
    np.testing.assert_allclose(run("joint_impedance", NEAR), NEAR, atol=JOINTS)


def test_cartesian_impedance_ends_near_its_goal(run: Callable[..., Any]) -> None:
    np.testing.assert_allclose(run("cartesian_impedance", [0.05, 0.05, 0.0])[:3, 3], np.zeros(3), atol=TOOL)


def test_a_posture_is_approached_while_the_tool_moves(run: Callable[..., Any]) -> None:
    one = run("posture", np.array([0.1, 0, 0, 0, 0, 0, 0]), np.array([100.0, 0, 0, 0, 0, 0, 0]), 1.5)
    assert one["joints"][0] == pytest.approx(0.1, abs=0.05)
    np.testing.assert_allclose(one["gains"], [100.0, 0, 0, 0, 0, 0, 0])
    both = run("posture", step := np.array([0.4, 0.0, -0.4, 0, 0, 0, 0]), 20.0, 2.0)
    assert np.linalg.norm(both["joints"] - step) < 0.5 * np.linalg.norm(step)
    np.testing.assert_allclose(both["gains"], [20.0] * 7)
    for found in (one, both):
        np.testing.assert_allclose(found["tool"][:3, 3], np.zeros(3), atol=TOOL)


def test_a_joint_tracker_arrives(run: Callable[..., Any]) -> None:
    np.testing.assert_allclose(run("joint_tracker", NEAR), NEAR, atol=JOINTS)


def test_a_cartesian_tracker_arrives(run: Callable[..., Any]) -> None:
    np.testing.assert_allclose(run("cartesian_tracker", [0.05, -0.05, 0.0])[:3, 3], np.zeros(3), atol=TOOL)


def test_torques_move_a_joint(run: Callable[..., Any]) -> None:
    torque = np.array([2.0, 0, 0, 0, 0, 0, 0])
    found = run("torques", torque)
    assert found["joints"][0] > 0.05
    np.testing.assert_allclose(found["held"], torque)


def test_a_torque_that_is_given_once_is_held(run: Callable[..., Any]) -> None:
    assert run("held_torque", np.array([-2.0, 0, 0, 0, 0, 0, 0]))[0] < -0.05


def test_a_torque_that_is_not_renewed_ends_its_motion(run: Callable[..., Any]) -> None:
    assert run("forgotten_torque") == "TorqueSignalTimeoutException"


def test_a_callback_sees_every_millisecond(run: Callable[..., Any]) -> None:
    hold = 1500
    rows = run("callbacks", hold)
    assert hold <= len(rows) <= hold + 500
    np.testing.assert_array_equal(np.diff(rows[:, 0]), rows[1:, 1])
    assert (rows[1:, 1] == 1).all()


def test_a_motion_runs_once(run: Callable[..., Any]) -> None:
    assert run("reused_motion", NEAR, START) == ["MotionReuseException"] * 2


def test_homing_finds_the_largest_width(run: Callable[..., Any]) -> None:
    done, before, after, largest = run("hand_homing")
    assert done
    assert largest == pytest.approx(0.08, abs=WIDTH)
    assert after == pytest.approx(before, abs=WIDTH)


def test_fingers_move_to_widths(run: Callable[..., Any]) -> None:
    widths = (0.08, 0.04, 0.06, 0.03)
    for width, (done, found) in zip(widths, run("hand_widths", widths), strict=True):
        assert done
        assert found == pytest.approx(width, abs=WIDTH)


def test_a_grasp_within_its_tolerance_holds(run: Callable[..., Any]) -> None:
    assert run("hand_grasp", 0.04, 0.02) == ("True", True)


def test_a_grasp_beyond_the_fingers_fails(run: Callable[..., Any]) -> None:
    assert run("hand_grasp", 0.09, 0.005) == ("CommandException", False)


def test_fingers_stop(run: Callable[..., Any]) -> None:
    assert run("hand_grasp", 0.04, 0.02) == ("True", True)
    assert run("hand_stop") == (True, False)
