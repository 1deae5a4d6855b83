"""What users of panda-python do first, through its calls, with a virtual Panda and its hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from rcilab.makers.franka.driver.libraries import kept_scheduling
from tests.makers.franka.clients.conftest import Served, matrix, served
from tests.waiting import wait_for

panda_py = pytest.importorskip("panda_py", reason="panda-python has no wheel for this Python or machine")

AWAY = (0.2, -0.6, 0.1, -2.0, 0.1, 1.4, 0.9)


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with served("Panda", tool="hand") as running:
        yield running


@pytest.fixture(scope="module")
def client(arm: Served) -> Any:
    arm.place(*AWAY)
    with kept_scheduling():
        return panda_py.Panda(arm.host)


@pytest.fixture
def panda(client: Any, arm: Served) -> Any:
    """A client of an arm off its start, without an error."""
    arm.world.release()
    client.recover()
    if np.abs(angles(client) - AWAY).max() > 0.02:  # It cannot move to where it is.
        assert client.move_to_joint_position(np.array(AWAY), speed_factor=0.6)
    return client


def angles(panda: Any) -> np.ndarray:
    """Returns the measured joint angles; the library's own stay those of the last motion's last cycle."""
    return np.array(panda.get_robot().read_once().q)


def test_its_own_kinematics_agree_with_the_state(panda: Any, arm: Served) -> None:
    T, q = matrix(panda.get_state().O_T_EE), np.array(panda.get_state().q)
    np.testing.assert_allclose(panda_py.fk(q), T, atol=5e-4)  # It rounds the hand's length.
    np.testing.assert_allclose(arm.model.forward(q).matrix, T, atol=1e-4)
    np.testing.assert_allclose(panda_py.ik(T, q_init=q, q_7=q[6]), q, atol=5e-3)


def test_its_model_is_the_arms(panda: Any, arm: Served) -> None:
    state = panda.get_state()
    q = np.array(state.q)
    mass = np.reshape(panda.get_model().mass(state), (7, 7)).T
    np.testing.assert_allclose(mass, arm.model.rigid_body.mass_matrix(q), atol=1e-6)
    np.testing.assert_allclose(panda.get_model().gravity(state), arm.model.torque(q).gravity, atol=1e-3)


def test_it_moves_to_its_start(panda: Any, arm: Served) -> None:
    assert panda.move_to_start(speed_factor=0.4)
    np.testing.assert_allclose(angles(panda), arm.model.home, atol=0.01)


def test_it_moves_to_joint_angles_and_through_waypoints(panda: Any) -> None:
    first, second = np.add(AWAY, 0.15), np.add(AWAY, [0.1, -0.1, 0.0, 0.2, 0.0, 0.1, -0.2])
    assert panda.move_to_joint_position(first, speed_factor=0.4)
    np.testing.assert_allclose(angles(panda), first, atol=0.01)
    assert panda.move_to_joint_position([second, np.array(AWAY)], speed_factor=0.4)
    np.testing.assert_allclose(angles(panda), AWAY, atol=0.01)


def test_it_moves_to_a_pose(panda: Any) -> None:
    goal = np.array(panda.get_pose())
    goal[:3, 3] += (0.05, -0.05, 0.04)
    assert panda.move_to_pose(goal, speed_factor=0.4)
    np.testing.assert_allclose(panda.get_pose()[:3, 3], goal[:3, 3], atol=0.02)


def test_its_impedance_controller_holds_the_tool_where_it_is_set(panda: Any) -> None:
    from panda_py import controllers

    position, orientation = np.array(panda.get_position()), panda.get_orientation()
    controller = controllers.CartesianImpedance(filter_coeff=0.01)
    panda.start_controller(controller)
    goal = position + (0.0, 0.05, 0.03)
    controller.set_control(goal, orientation)
    wait_for(lambda: np.abs(panda.get_position() - goal).max() < 0.02, what="the goal of the controller")
    panda.stop_controller()
    panda.raise_error()  # None.


def test_it_recovers_from_a_reflex(panda: Any, arm: Served) -> None:
    from panda_py import controllers, libfranka

    panda.get_robot().set_collision_behavior([80.0] * 7, [80.0] * 7, [15.0] * 6, [15.0] * 6)
    panda.start_controller(controllers.CartesianImpedance())
    arm.world.push([0.0, 0.0, -40.0, 0.0, 0.0, 0.0])

    def error() -> str:
        try:
            panda.raise_error()
        except RuntimeError as found:
            return str(found)
        return ""

    assert "cartesian_reflex" in wait_for(error, what="the reflex")
    panda.stop_controller()
    assert panda.get_state().robot_mode == libfranka.RobotMode.kReflex
    arm.world.release()
    panda.recover()
    assert panda.move_to_joint_position(np.add(AWAY, 0.05), speed_factor=0.4)
