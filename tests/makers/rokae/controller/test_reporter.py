"""Every field of the state, in its frame and unit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.makers.rokae import wire as rci
from rcilab.model.robot_model import RobotModel
from rcilab.motion.joint import plan_joint
from rcilab.sim.drive_report import DriveModel
from rcilab.sim.filters import low_pass_gain


@pytest.mark.parametrize("name", ["xMatePro7", "xMate7"])
def test_the_state_tells_the_truth_about_a_moving_arm(make_hand, name: str) -> None:
    hand = make_hand(name)
    model: RobotModel = hand.model
    hand.start()
    hand.play(plan_joint(model, model.home, model.home + 0.4, speed=0.8).q[:200])
    before, state = hand.states[-2:]
    h = 1e-3
    assert np.allclose(state.dq_c, (state.q_c - before.q_c) / h, rtol=0, atol=1e-9)
    assert np.allclose(state.ddq_c, (state.dq_c - before.dq_c) / h, rtol=0, atol=1e-6)
    assert np.array_equal(state.q, state.q_c)
    assert np.allclose(state.T_base_tool_c, model.forward(state.q_c).matrix, rtol=0, atol=1e-14)
    assert np.allclose(state.tool_velocity_c, model.jacobian(state.q_c) @ state.dq_c, rtol=0, atol=1e-12)
    assert np.allclose(
        state.tool_acceleration_c, (state.tool_velocity_c - before.tool_velocity_c) / h, rtol=0, atol=1e-9
    )
    moved = (state.T_base_tool_c.position - before.T_base_tool_c.position) / h
    assert np.allclose(state.tool_velocity_c[:3], moved, rtol=0, atol=5e-3)
    assert np.array_equal(state.tau, model.torque(state.q_c, state.dq_c, state.ddq_c).full)
    assert np.allclose(state.dtau_c, (state.tau_c - before.tau_c) / h, rtol=0, atol=1e-9)
    assert not state.tau_ext_in_base.any()
    if model.n == 7:
        assert state.psi == state.psi_c == model.arm_angle(state.q)
        assert state.dpsi_c == pytest.approx((state.psi_c - before.psi_c) / h)
    else:
        assert state.psi == state.psi_c == state.dpsi_c == 0.0


def test_a_resting_arm_reports_rest_in_every_field(hand) -> None:
    hand.start()
    hand.play(plan_joint(hand.model, hand.model.home, hand.model.home + 0.2).q)
    hand.ask(rci.StopMove())
    state = hand.step(300)
    for name in ("dq", "dq_c", "ddq_c", "tool_velocity_c", "tool_acceleration_c", "dtau_c", "dtheta"):
        assert not getattr(state, name).any(), name
    assert state.dpsi_c == state.ddpsi_c == 0.0
    assert np.array_equal(state.tau, hand.model.torque(state.q).full)
    assert np.array_equal(state.tau_filtered, state.tau)
    assert hand.step().q is state.q  # Nothing is computed again.


def test_the_state_survives_the_wire(hand) -> None:
    hand.start()
    hand.play(plan_joint(hand.model, hand.model.home, hand.model.home + 0.4).q[:100])
    state = hand.state
    decoded = rci.decode_state(rci.encode_state(state), 7)
    for name in state.__slots__:
        assert np.array_equal(getattr(decoded, name), getattr(state, name)), name


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_motor_side_and_filtered_torques_follow_from_the_joints(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    assert hand.ask(rci.SetTorqueFilterCutOffFrequency(40.0)) == 0
    hand.start()
    hand.play(plan_joint(hand.model, hand.model.home, hand.model.home + 0.4, speed=0.8).q[:200])
    before, state = hand.states[-2:]
    drive, h = DriveModel(hand.model), 1e-3
    ddq, dtau = (state.dq - before.dq) / h, (state.tau - before.tau) / h
    assert np.allclose(state.theta, drive.theta(state.q, state.tau), rtol=0, atol=1e-12)
    assert np.allclose(state.dtheta, drive.dtheta(state.dq, dtau), rtol=1e-9, atol=1e-9)
    assert np.allclose(state.motor_tau, drive.motor_tau(state.tau, state.dq, ddq), rtol=1e-9, atol=1e-12)
    gain = low_pass_gain(40.0)
    for name, filtered in (("tau", "tau_filtered"), ("motor_tau", "motor_tau_filtered")):
        last, new = getattr(before, filtered), getattr(state, name)
        assert np.allclose(getattr(state, filtered), last + gain * (new - last), rtol=0, atol=1e-12)


def test_a_commanded_torque_is_reported_and_its_rate(make_hand) -> None:
    hand = make_hand()
    hand.start(4, 0)
    for k in range(1, 20):
        state = hand.torque((0.5 * k, 0, 0, 0, 0, 0, 0))
        assert state.tau_c.tolist() == [0.5 * k, 0, 0, 0, 0, 0, 0]
        assert state.dtau_c[0] == pytest.approx(500.0)
    hand.ask(rci.StopMove())
    assert np.array_equal(hand.step(300).tau_c, hand.model.torque(hand.state.q).full)


def wrench_frames(hand, frame: tuple[float, ...], kind: int, wrench: tuple[float, ...]) -> tuple[np.ndarray, ...]:
    """Base wrench, wrench in the force frame, pose of the force frame, after something has pressed for a while."""
    assert hand.ask(rci.SetFcCoor(frame, kind)) == 0
    hand.cycle.plant.push(wrench)
    state = hand.step(300)
    T_flange_force = np.array(frame).reshape(4, 4)
    T_base_force = state.T_base_tool.matrix @ np.linalg.inv(hand.model.T_flange_tool.matrix) @ T_flange_force
    return state.tau_ext_in_base, state.tau_ext_in_stiff, T_base_force


FRAME = (0.0, -1.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.2, 0.0, 0.0, 0.0, 1.0)
WRENCH = (3.0, -5.0, 8.0, 0.4, -0.2, 0.1)


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize("kind", [0, 1, 2])
def test_an_outside_wrench_is_reported_in_the_frame_that_was_set(make_hand, plant: str, kind: int) -> None:
    hand = make_hand(plant=plant)
    hand.ask(rci.SetCoor((1.0, 0, 0, 0.05, 0, 1, 0, 0, 0, 0, 1, 0.1, 0, 0, 0, 1)))
    hand.ask(rci.SetMotorPower(1))
    base, stiff, T_base_force = wrench_frames(hand, FRAME, kind, WRENCH)
    assert np.allclose(base, WRENCH, rtol=0, atol=0.05)
    arm = hand.state.T_base_tool.position - T_base_force[:3, 3]
    force, moment = base[:3], base[3:] + np.cross(arm, base[:3])
    R = np.eye(3) if kind == 0 else T_base_force[:3, :3]  # No path yet: the axes of the force frame.
    assert np.allclose(stiff, np.concatenate((R.T @ force, R.T @ moment)), rtol=0, atol=1e-9)


def test_the_path_frame_looks_along_the_commanded_velocity_and_keeps_its_last_direction(make_hand) -> None:
    hand = make_hand()
    assert hand.ask(rci.SetFcCoor(tuple(np.eye(4).ravel()), 2)) == 0
    hand.start(1, 2)
    hand.shift((0.0, 0.06, 0.08), 0.8)
    hand.ask(rci.StopMove())
    hand.cycle.plant.push((0.0, 3.0, 4.0, 0.0, 0.0, 0.0))
    state = hand.step(300)
    assert np.allclose(state.tau_ext_in_stiff[:3], (5.0, 0.0, 0.0), rtol=0, atol=0.05)


def test_a_load_that_was_not_set_shows_as_an_outside_wrench(make_hand) -> None:
    from rcilab.model.dynamics.payload import Payload

    hand = make_hand()
    hand.ask(rci.SetMotorPower(1))
    assert not hand.step(50).tau_ext_in_base.any()
    hand.cycle.plant.mount(Payload(mass=2.0))
    assert np.allclose(hand.step(200).tau_ext_in_base[:3], (0.0, 0.0, -2.0 * 9.81), rtol=0, atol=0.1)
    assert hand.ask(rci.SetLoad(2.0, (0.0,) * 3, (0.0,) * 9)) == 0
    assert not hand.step(100).tau_ext_in_base.any()


@pytest.mark.parametrize("mode", [(0, 1), (1, 2), (2, 1), (3, 2), (4, 0)])
@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_commanded_values_are_backward_differences_in_every_mode(make_hand, plant: str, mode) -> None:
    hand = make_hand(plant=plant)
    hand.start(*mode)
    T = hand.state.T_base_tool_c.matrix
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.2, speed=0.5).q
    for k, row in enumerate(rows[:150]):
        T[2, 3] += 1e-8 * k
        hand.command(row, T_base_tool_c=tuple(T.ravel()), tau_c=(0.02 * k,) + (0.0,) * 6)
    before, state = hand.states[-2:]
    assert state.faults == ()
    assert np.allclose(state.dq_c, (state.q_c - before.q_c) * 1e3, rtol=0, atol=1e-9)
    assert np.allclose(state.ddq_c, (state.dq_c - before.dq_c) * 1e3, rtol=0, atol=1e-6)
    assert np.allclose(state.tool_velocity_c, hand.model.jacobian(state.q_c) @ state.dq_c, rtol=0, atol=1e-9)
    moved = (state.tool_velocity_c - before.tool_velocity_c) * 1e3
    assert np.allclose(state.tool_acceleration_c, moved, rtol=0, atol=1e-6)
    assert np.allclose(state.T_base_tool, hand.model.forward(state.q).matrix, rtol=0, atol=1e-12)
    assert state.psi == pytest.approx(hand.model.arm_angle(state.q), abs=1e-12)
    assert state.dpsi_c == pytest.approx(math.remainder(state.psi_c - before.psi_c, math.tau) * 1e3, abs=1e-9)
    assert state.ddpsi_c == pytest.approx((state.dpsi_c - before.dpsi_c) * 1e3, abs=1e-6)


def test_an_arm_angle_that_is_undefined_keeps_its_last_value(hand) -> None:
    """Where the arm is stretched, the arm angle keeps its last value; before there is one, it is zero."""
    hand.cycle.reset(np.zeros(7))
    assert hand.step().psi == 0.0


@pytest.mark.parametrize("sign", ["on-arm", "by-arm"])
def test_an_admittance_that_yields_to_minus_the_reported_force_follows_the_hand_with_by_arm(make_hand, sign) -> None:
    """A published program for the xMate yields by minus the reported force; see `ControllerConfig.force_sign`."""
    hand = make_hand(plant="mujoco", force_sign=sign)
    hand.start(1, 2)
    T, speed = hand.state.T_base_tool_c.matrix, np.zeros(3)
    start = T[:3, 3].copy()
    hand.cycle.plant.push((0.0, 8.0, 0.0, 0.0, 0.0, 0.0))
    for _ in range(300):
        speed += 1e-3 * (-hand.state.tau_ext_in_base[:3] - 40.0 * speed) / 8.0  # 8 kg, 40 N s/m.
        T[:3, 3] += 1e-3 * speed
        assert not hand.pose(T).faults
    moved = T[:3, 3] - start
    assert (moved[1] > 0.005) if sign == "by-arm" else (moved[1] < -0.005)
    assert abs(moved[1]) > 5.0 * abs(moved[0])
