"""What the examples of pylibfranka do, through the same calls, with a virtual FR3."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from rcilab.makers.franka.driver.libraries import kept_scheduling
from tests.makers.franka.clients.conftest import Served, matrix, served

franka = pytest.importorskip("pylibfranka", reason="pylibfranka has no wheel for this Python or machine")

SINGLE = 5e-7  # Rounding of a state.
STIFFNESS = np.array([600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0])  # [N m/rad]
DAMPING = np.array([40.0, 40.0, 40.0, 40.0, 20.0, 15.0, 8.0])  # [N m s/rad]


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with served("FR3") as running:
        yield running


@pytest.fixture(scope="module")
def client(arm: Served) -> Any:
    """A client; its library cannot close it before it is collected."""
    with kept_scheduling():
        return franka.Robot(arm.host, franka.RealtimeConfig.kIgnore)


@pytest.fixture
def robot(client: Any, arm: Served) -> Any:
    """The client with the settings that the examples begin with, of an arm at home without an error."""
    arm.world.release()
    client.automatic_error_recovery()
    arm.place()
    client.set_collision_behavior([20.0] * 7, [40.0] * 7, [10.0] * 6, [20.0] * 6)
    client.set_joint_impedance([3000.0, 3000.0, 3000.0, 2500.0, 2500.0, 2000.0, 2000.0])
    client.set_cartesian_impedance([3000.0] * 3 + [300.0] * 3)
    return client


def controller(name: str) -> Any:
    return getattr(franka.ControllerMode, name)


def swing(t: float, duration: float, height: float) -> float:
    """A path there and back, with standstill at both ends."""
    return height / 2.0 * (1.0 - np.cos(2.0 * np.pi * t / duration))


def loop(control: Any, duration: float, command: Callable[[Any, float, Any], Any]) -> list[Any]:
    """Answers each state with a command for it, and the last with one that is finished; returns the states."""
    t, states = 0.0, []
    while t < duration:
        state, period = control.readOnce()
        t += period.to_sec()
        states.append(state)
        output = command(states[0], t, state)
        output.motion_finished = t >= duration
        control.writeOnce(output)
    return states


def test_the_state_is_that_of_an_arm_at_standstill(robot: Any, arm: Served) -> None:
    first, second = robot.read_once(), robot.read_once()
    assert second.time.to_sec() > first.time.to_sec()
    assert second.robot_mode == franka.RobotMode.Idle
    np.testing.assert_allclose(second.q, arm.model.home, atol=1e-4)
    np.testing.assert_allclose(matrix(second.O_T_EE), arm.model.forward(second.q).matrix, atol=SINGLE)
    np.testing.assert_allclose(second.elbow, [second.q[2], -1.0], atol=SINGLE)
    np.testing.assert_allclose(second.tau_J, arm.model.torque(second.q).full, atol=0.2)
    np.testing.assert_allclose(second.O_F_ext_hat_K, np.zeros(6), atol=0.5)
    np.testing.assert_allclose(second.tau_ext_hat_filtered, np.zeros(7), atol=0.2)
    assert not str(second.current_errors).strip("[]")


def test_the_model_is_the_arms(robot: Any, arm: Served) -> None:
    arm.place(0.3, -0.5, 0.2, -2.0, 0.4, 1.7, 0.5)
    model, state = robot.load_model(), robot.read_once()
    while abs(state.q[0] - 0.3) > 1e-3:
        state = robot.read_once()
    q, dq = np.array(state.q), np.array(state.dq)
    np.testing.assert_allclose(np.reshape(model.mass(state), (7, 7)).T, arm.model.rigid_body.mass_matrix(q), atol=1e-5)
    np.testing.assert_allclose(model.gravity(state), arm.model.torque(q).gravity, atol=1e-3)
    np.testing.assert_allclose(model.coriolis(state), arm.model.torque(q, dq).coriolis, atol=1e-3)
    np.testing.assert_allclose(np.reshape(model.zero_jacobian(state), (7, 6)).T, arm.model.jacobian(q), atol=1e-5)


def test_joint_angles(robot: Any) -> None:
    def command(start: Any, t: float, _: Any) -> Any:
        return franka.JointPositions(np.add(start.q_d, swing(t, 1.5, 0.15) * np.array([0, 0, 0, 1, 1, 0, 1])))

    states = loop(robot.start_joint_position_control(controller("CartesianImpedance")), 1.5, command)
    moved = np.max([state.q for state in states], axis=0) - states[0].q
    np.testing.assert_allclose(moved[[3, 4, 6]], 0.15, atol=0.01)
    np.testing.assert_allclose(states[-1].q_d, states[0].q_d, atol=1e-5)


def test_joint_velocities(robot: Any) -> None:
    def command(start: Any, t: float, _: Any) -> Any:
        rate = swing(t, 0.5, 0.5) * (1.0 if t < 0.5 else -1.0)
        return franka.JointVelocities([0.0, 0.0, 0.0, rate, rate, rate, rate])

    states = loop(robot.start_joint_velocity_control(controller("CartesianImpedance")), 1.0, command)
    moved = np.max([state.q_d for state in states], axis=0) - states[0].q_d
    np.testing.assert_allclose(moved[3:], 0.125, atol=1e-3)
    np.testing.assert_allclose(states[-1].q_d, states[0].q_d, atol=1e-3)


def test_poses(robot: Any) -> None:
    def command(start: Any, t: float, _: Any) -> Any:
        pose = list(start.O_T_EE_c)
        pose[12] += swing(t, 1.5, 0.05)
        pose[14] -= swing(t, 1.5, 0.03)
        return franka.CartesianPose(pose)

    states = loop(robot.start_cartesian_pose_control(controller("JointImpedance")), 1.5, command)
    tips = np.array([matrix(state.O_T_EE)[:3, 3] for state in states])
    assert np.abs(tips - tips[0]).max(axis=0) == pytest.approx([0.05, 0.0, 0.03], abs=2e-3)
    np.testing.assert_allclose(states[-1].O_T_EE_d, states[0].O_T_EE_d, atol=1e-5)


def test_velocities_of_the_tool(robot: Any) -> None:
    def command(start: Any, t: float, _: Any) -> Any:
        rate = swing(t, 1.0, 0.1)
        return franka.CartesianVelocities([rate, 0.0, rate, 0.0, 0.0, 0.0])

    states = loop(robot.start_cartesian_velocity_control(controller("CartesianImpedance")), 1.0, command)
    moved = matrix(robot.read_once().O_T_EE) - matrix(states[0].O_T_EE)
    np.testing.assert_allclose(moved[:3, 3], [0.05, 0.0, 0.05], atol=2e-3)


def test_torques_of_a_joint_impedance_controller_with_the_model(robot: Any) -> None:
    control, model = robot.start_torque_control(), robot.load_model()  # A request between Move and the first command.
    step = np.array([0.0, 0.05, 0.0, 0.1, 0.0, 0.1, 0.2])

    def command(start: Any, t: float, state: Any) -> Any:
        u = min(t, 1.0)
        target = start.q + step * u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
        tau = STIFFNESS * (target - state.q) - DAMPING * np.array(state.dq) + model.coriolis(state)
        return franka.Torques(tau.tolist())

    states = loop(control, 2.0, command)
    np.testing.assert_allclose(states[-1].q, states[0].q + step, atol=0.02)


@pytest.mark.parametrize(("rotors", "damping", "error"), [(0.1, 1.0, 6e-3), (0.0, 0.0, 0.1)])
def test_computed_torques_need_the_rotors_and_the_damping_that_the_model_leaves_out(
    robot: Any, rotors: float, damping: float, error: float
) -> None:
    control, model, duration = robot.start_torque_control(), robot.load_model(), 1.5
    step, rate = np.array([0.3, 0.2, -0.3, 0.3, 0.3, -0.3, 0.5]), np.pi / duration

    def command(start: Any, t: float, state: Any) -> Any:
        dq, ddq = 0.5 * step * rate * np.sin(rate * t), 0.5 * step * rate**2 * np.cos(rate * t)
        tau = np.reshape(model.mass(state), (7, 7)) @ ddq + model.coriolis(state) + rotors * ddq + damping * dq
        return franka.Torques((min(1.0, t / 0.02) * tau).tolist())

    states = loop(control, duration, command)
    off = np.abs(np.subtract(states[-1].q, states[0].q) - step)
    assert (off.max() < error) if rotors else (off.min() > error)


def test_goals_that_the_arm_plans_itself(robot: Any, arm: Served) -> None:
    handling = franka.AsyncPositionControlHandler
    settings = handling.Configuration(maximum_joint_velocities=[1.0] * 7, goal_tolerance=10.0)
    configured = handling.configure(robot, settings)
    assert configured.error_message is None
    handler, goals = configured.handler, (arm.model.home + 0.1, arm.model.home - 0.05)
    for goal in goals:
        begun = time.monotonic()
        while time.monotonic() - begun < 0.7:  # A program at 50 Hz.
            assert handler.get_target_feedback().error_message is None
            target = handling.JointPositionTarget(joint_positions=goal.tolist())
            assert handler.set_joint_position_target(target).error_message is None
            time.sleep(0.02)
    handler.stop_control()
    np.testing.assert_allclose(robot.read_once().q, goals[-1], atol=1e-3)


def test_a_discontinuity_is_an_error_with_its_name_until_the_recovery(robot: Any) -> None:
    def jump(start: Any, t: float, _: Any) -> Any:
        return franka.JointPositions(np.add(start.q_d, 0.1 if t > 0.1 else 0.0))

    with pytest.raises(franka.ControlException, match="joint_motion_generator_velocity_discontinuity"):
        loop(robot.start_joint_position_control(controller("JointImpedance")), 1.0, jump)
    assert robot.read_once().robot_mode == franka.RobotMode.Reflex
    with pytest.raises(franka.CommandException, match=r"command rejected"):
        robot.start_joint_position_control(controller("JointImpedance"))
    robot.automatic_error_recovery()
    assert robot.read_once().robot_mode == franka.RobotMode.Idle
    test_joint_velocities(robot)


def test_a_push_is_a_reflex(robot: Any, arm: Served) -> None:
    def push_at(start: Any, t: float, _: Any) -> Any:
        if 0.05 < t < 0.0515:
            arm.world.push([0.0, 0.0, -40.0, 0.0, 0.0, 0.0])
        return franka.JointPositions(start.q_d)

    with pytest.raises(franka.ControlException, match="cartesian_reflex"):
        loop(robot.start_joint_position_control(controller("JointImpedance")), 2.0, push_at)
    assert robot.read_once().cartesian_collision[2] == 1.0


def test_a_motion_is_stopped(robot: Any) -> None:
    control = robot.start_joint_position_control(controller("JointImpedance"))
    state, _ = control.readOnce()
    for _ in range(20):
        control.writeOnce(franka.JointPositions(state.q_d))
        control.readOnce()
    robot.stop()
    assert robot.read_once().robot_mode == franka.RobotMode.Idle


def test_frames_and_load_show_in_the_state(robot: Any) -> None:
    frame, stiff = np.eye(4), np.eye(4)
    frame[:3, 3], stiff[:3, 3] = (0.0, 0.0, 0.1), (0.0, 0.02, 0.0)
    robot.set_EE(frame.T.ravel().tolist())
    robot.set_K(stiff.T.ravel().tolist())
    robot.set_load(0.5, [0.0, 0.0, 0.05], [0.001, 0.0, 0.0, 0.0, 0.001, 0.0, 0.0, 0.0, 0.001])
    robot.read_once()  # Of the cycle before the answer.
    state = robot.read_once()
    np.testing.assert_allclose(matrix(state.NE_T_EE), frame, atol=SINGLE)
    np.testing.assert_allclose(matrix(state.EE_T_K), stiff, atol=SINGLE)
    assert state.m_load == pytest.approx(0.5)
    assert state.F_x_Cload == pytest.approx([0.0, 0.0, 0.05])
    robot.set_load(0.0, [0.0] * 3, [0.0] * 9)
    for set_frame in (robot.set_EE, robot.set_K):
        set_frame(np.eye(4).ravel().tolist())


def test_the_hand_is_homed_and_grasps(arm: Served) -> None:
    hand = franka.Gripper(arm.host)
    assert hand.server_version() == 3
    assert hand.homing()
    state = hand.read_once()
    assert state.max_width == pytest.approx(0.08)
    assert (state.is_grasped, state.temperature > 0) == (False, True)
    assert hand.move(0.05, 0.1)
    assert hand.read_once().width == pytest.approx(0.05, abs=1e-3)
    assert hand.grasp(0.03, 0.1, 20.0)
    assert hand.read_once().is_grasped
    assert hand.stop()
    assert not hand.read_once().is_grasped
