"""Every field of the state datagram, at rest, in motion and under a force, against the arm's own model."""

from __future__ import annotations

import math
import struct
from itertools import pairwise

import numpy as np
import pytest

from rcilab.model.robot_model import RobotModel, load_model
from tests.peers.franka import programs, wire
from tests.peers.franka.arena import MODELS, FciArena
from tests.peers.franka.robot import Output, Robot
from tests.peers.franka.wire import State

IDENTITY = tuple(np.eye(4).ravel())
FLIP = -0.467002423653011  # [rad]
SINGLE = {5: 1e-12, 10: 5e-7}  # Rounding.
RATES = {5: 1e-9, 10: 5e-4}


def model_of(robot: Robot) -> RobotModel:
    return load_model(MODELS[robot.version])


def matrix(columns: tuple[float, ...]) -> np.ndarray:
    return np.reshape(columns, (4, 4)).T


def thresholds(contact: float, collision: float) -> bytes:
    return wire.doubles(*((contact,) * 7 + (collision,) * 7) * 2, *((contact,) * 6 + (collision,) * 6) * 2)


def hold(robot: Robot, state: State, cycles: int) -> State:
    """Commands the angles of a state for some cycles."""
    start = state
    for _ in range(cycles):
        robot.answer(state, Output(q=start.q_d))
        state = robot.state()
    return state


def test_the_state_of_a_stationary_arm(robot: Robot) -> None:
    state, model = robot.state(), model_of(robot)
    near = SINGLE[robot.version]
    assert state.q == state.q_d == state.theta == pytest.approx(model.home, abs=near)
    for name in ("dq", "dq_d", "ddq_d", "dtheta", "dtau_J", "tau_ext_hat_filtered", "joint_contact", "joint_collision"):
        assert getattr(state, name) == programs.ZERO, name
    for name in ("O_dP_EE_d", "O_dP_EE_c", "O_ddP_EE_c", "O_F_ext_hat_K", "K_F_ext_hat_K", "cartesian_contact"):
        assert getattr(state, name) == (0.0,) * 6, name
    assert state.cartesian_collision == (0.0,) * 6
    for name in ("O_T_EE", "O_T_EE_d", "O_T_EE_c"):
        assert matrix(getattr(state, name)) == pytest.approx(model.forward(model.home).matrix, abs=near)
    for name in ("F_T_EE", "EE_T_K", "F_T_NE", "NE_T_EE"):
        assert getattr(state, name) == IDENTITY, name
    assert (state.m_ee, state.m_load) == ((0.0,), (0.0,))
    assert state.I_ee == state.I_load == (0.0,) * 9
    assert state.F_x_Cee == state.F_x_Cload == (0.0,) * 3
    assert state.elbow == state.elbow_d == state.elbow_c == (0.0, -1.0)
    assert state.delbow_c == state.ddelbow_c == (0.0, 0.0)
    assert state.tau_J == pytest.approx(model.torque(model.home).full, abs=1e-5)
    assert state.tau_J_d == programs.ZERO
    assert state.O_ddP_O == pytest.approx((0.0, 0.0, -9.81))
    assert (state.generator, state.controller, state.robot_mode) == (0, wire.OTHER, wire.ROBOT_IDLE)
    assert state.flags == bytes(82)
    assert state.success_rate == 0.0


def test_the_acceleration_sensors_of_a_stationary_arm_read_gravity(robot: Robot, place: FciArena) -> None:
    q = [0.3, -0.6, 0.4, -2.0, 0.5, 1.5, 0.2]
    assert place.simulate("place_arm", q=q)["ok"]
    state = robot.skip(3)
    if robot.version == 5:
        assert len(state.data) == wire.STATE_SIZES[5]  # It has none.
        return
    T = np.eye(4)
    for i, (a, d, alpha) in enumerate(CRAIG):
        c, s, ca, sa = math.cos(q[i]), math.sin(q[i]), math.cos(alpha), math.sin(alpha)
        T = T @ [[c, -s, 0, a], [s * ca, c * ca, -sa, -sa * d], [s * sa, c * sa, ca, ca * d], [0, 0, 0, 1]]
        expected = T[:3, :3].T @ (0.0, 0.0, 9.81)
        assert state.accelerometer_top[3 * i : 3 * i + 3] == pytest.approx(expected, abs=1e-5)
        assert state.accelerometer_bottom[3 * i : 3 * i + 3] == pytest.approx(expected, abs=1e-5)


CRAIG = (  # a, d, alpha of the joints that have sensors, as the maker's page prints them.
    (0.0, 0.333, 0.0), (0.0, 0.0, -math.pi / 2), (0.0, 0.316, math.pi / 2), (0.0825, 0.0, math.pi / 2),
    (-0.0825, 0.384, -math.pi / 2), (0.0, 0.0, math.pi / 2),
)  # fmt: skip


def test_the_state_of_a_motion_of_the_tool_agrees_with_the_model_and_with_differences(robot: Robot) -> None:
    model, h = model_of(robot), 0.001
    start = robot.move(wire.JOINT_IMPEDANCE, wire.CARTESIAN_POSE)
    program = programs.motion(start, wire.CARTESIAN_POSE, cycles=300, height=0.02, elbow=True)
    assert robot.play(start, program, cycles=301).status == "success"
    moving = [state for state in robot.states if state.robot_mode == wire.ROBOT_MOVE][20:250]
    near, rates = SINGLE[robot.version], RATES[robot.version]
    for last, state in pairwise(moving):
        assert state.message_id == last.message_id + 1
        assert matrix(state.O_T_EE_d) == pytest.approx(model.forward(state.q_d).matrix, abs=2.0 * near)
        assert matrix(state.O_T_EE) == pytest.approx(model.forward(state.q).matrix, abs=2.0 * near)
        assert state.O_T_EE_c == state.O_T_EE_d
        assert state.elbow == pytest.approx((state.q[2], -1.0), abs=near)
        assert state.elbow_c == state.elbow_d == pytest.approx((state.q_d[2], -1.0), abs=near)
        assert (state.theta, state.dtheta) == (state.q, state.dq)
        assert state.delbow_c == pytest.approx((state.dq_d[2], 0.0), abs=10.0 * rates)
        assert state.O_dP_EE_d == state.O_dP_EE_c
        assert state.O_dP_EE_d == pytest.approx(model.jacobian(state.q_d) @ state.dq_d, abs=2.0 * rates)
        if robot.version == 5:
            assert state.dq_d == pytest.approx(np.subtract(state.q_d, last.q_d) / h, abs=1e-9)
            assert state.ddq_d == pytest.approx(np.subtract(state.dq_d, last.dq_d) / h, abs=1e-6)
            assert state.O_ddP_EE_c == pytest.approx(np.subtract(state.O_dP_EE_c, last.O_dP_EE_c) / h, abs=1e-6)
            assert state.dtau_J == pytest.approx(np.subtract(state.tau_J, last.tau_J) / h, abs=1e-6)
            assert state.tau_J == pytest.approx(model.torque(state.q, state.dq, state.ddq_d).full, abs=1e-6)
            terms = model.torque(state.q_d, state.dq_d, state.ddq_d)
            assert state.tau_J_d == pytest.approx(terms.full - terms.gravity, abs=1e-6)
        assert state.success_rate == 1.0


def test_commanded_torques_are_in_the_state_without_gravity(robot: Robot) -> None:
    generator = wire.NONE if robot.version == 10 else wire.JOINT_VELOCITY
    state = robot.move(wire.EXTERNAL, generator)
    for k in range(30):
        tau = tuple(0.01 * k * (joint + 1) for joint in range(7))
        robot.answer(state, Output(dq=programs.ZERO, tau=tau))
        last, state = state, robot.state()
        assert state.tau_J_d == pytest.approx(tau, abs=1e-6)
    ddq = np.subtract(state.dq, last.dq) / 0.001
    of_links = model_of(robot).torque(state.q, state.dq, ddq).full
    assert state.tau_J == pytest.approx(of_links, abs=2e-2)  # Less than tau_J_d and gravity, by rotors and damping.


def test_the_elbow_changes_sides_where_the_arm_is_stretched(robot: Robot, place: FciArena) -> None:
    for q4, side in ((FLIP + 0.01, 1.0), (FLIP - 0.01, -1.0)):
        assert place.simulate("place_arm", q=[0.0, -0.3, 0.4, q4, 0.0, 1.5, 0.7])["ok"]
        state = robot.skip(3)
        assert state.elbow == state.elbow_d == state.elbow_c == pytest.approx((0.4, side))


def test_a_force_on_the_tool_is_estimated_in_base_and_in_K(toucher: Robot, felt: FciArena) -> None:
    assert toucher.ask("set_collision_behavior", thresholds(100.0, 100.0)).status == "success"
    turned = (0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.05, 0.0, 0.1, 1.0)
    assert toucher.ask("set_ee_to_k", wire.doubles(*turned)).status == "success"
    force = np.array([5.0, -8.0, -12.0])
    felt.simulate("push", wrench=[*force.tolist(), 0.0, 0.0, 0.0])
    state, model = toucher.skip(400), model_of(toucher)
    T = matrix(state.O_T_EE) @ matrix(turned)
    lever = matrix(state.O_T_EE)[:3, 3] - T[:3, 3]
    in_base = np.concatenate((-force, np.cross(lever, -force)))
    in_K = np.concatenate((T[:3, :3].T @ in_base[:3], T[:3, :3].T @ in_base[3:]))
    assert state.O_F_ext_hat_K == pytest.approx(in_base, abs=0.2)
    assert state.K_F_ext_hat_K == pytest.approx(in_K, abs=0.2)
    tau = model.jacobian(state.q).T @ [*(-force).tolist(), 0.0, 0.0, 0.0]
    assert state.tau_ext_hat_filtered == pytest.approx(tau, abs=0.1)
    felt.simulate("release")
    state = toucher.skip(400)
    assert state.O_F_ext_hat_K == pytest.approx((0.0,) * 6, abs=0.2)


def test_contacts_and_collisions_are_the_axes_above_their_thresholds(toucher: Robot, felt: FciArena) -> None:
    assert toucher.ask("set_collision_behavior", thresholds(5.0, 15.0)).status == "success"
    felt.simulate("push", wrench=[0.0, 0.0, -10.0, 0.0, 0.0, 0.0])
    state = toucher.skip(300)
    assert state.cartesian_contact == (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    assert state.cartesian_collision == (0.0,) * 6
    assert state.joint_collision == programs.ZERO
    expected = tuple(float(abs(torque) > 5.0) for torque in state.tau_ext_hat_filtered)
    assert state.joint_contact == expected
    felt.simulate("push", wrench=[0.0, 0.0, -20.0, 0.0, 0.0, 0.0])
    state = toucher.skip(300)
    assert state.cartesian_collision == (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    felt.simulate("release")
    state = toucher.skip(300)
    assert state.cartesian_contact == (0.0,) * 6
    assert state.cartesian_collision == (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    assert state.errors == ()  # No motion was aborted.
    assert toucher.ask("automatic_error_recovery").status == "success"
    assert toucher.skip(3).cartesian_collision == (0.0,) * 6


def test_numbers_of_states_rise_one_by_one_from_connect_on(robot: Robot) -> None:
    robot.skip(200)
    numbers = [state.message_id for state in robot.states]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert numbers[0] >= 1


def test_flags_are_bytes_of_zero_and_one_at_the_maker_s_places(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    ending = robot.play(start, [Output(q=programs.with_offset(start.q_d, 2, 0.2))])
    state = ending.state
    offset = {5: 2282, 10: 1290}[robot.version]
    assert struct.unpack_from("82B", state.data, offset) == tuple(float(k in (11, 52)) for k in range(82))
    assert state.robot_mode == wire.ROBOT_REFLEX
