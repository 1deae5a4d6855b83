"""The five controller modes, each through a motion in both plants."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.spatial import Pose, rotation_between
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from rcilab.motion.joint import plan_joint

PLANTS = pytest.mark.parametrize("plant", ["ideal", "mujoco"])
ARMS = pytest.mark.parametrize("name", ["xMatePro7", "xMate7"])


@PLANTS
@ARMS
def test_a_line_of_the_tool_is_followed_with_its_arm_angle_held(make_hand, name: str, plant: str) -> None:
    hand = make_hand(name, plant)
    hand.start(1, 2)
    assert hand.state.motion_generator_mode is MotionGeneratorMode.CARTESIAN_POSITION
    psi, start = hand.state.psi_c, hand.state.T_base_tool_c.matrix
    hand.shift((-0.05, -0.15, 0.1), 1.5)
    assert hand.state.faults == ()
    assert np.allclose(hand.state.T_base_tool_c.position - start[:3, 3], (-0.05, -0.15, 0.1), rtol=0, atol=1e-12)
    assert np.allclose(hand.state.T_base_tool_c.rotation, start[:3, :3], rtol=0, atol=1e-12)
    assert np.allclose(hand.state.T_base_tool, hand.state.T_base_tool_c, rtol=0, atol=2e-4)
    assert hand.state.psi_c == pytest.approx(psi, abs=1e-9)
    assert hand.ask(rci.StopMove()) == 0
    assert not hand.state.dq_c.any()


@PLANTS
def test_a_null_space_motion_turns_the_elbow_and_leaves_the_tool(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    hand.start(1, 2)
    start = hand.state.T_base_tool_c.matrix
    hand.shift((0, 0, 0), 1.5, psi=0.6)
    assert hand.state.faults == ()
    assert hand.state.psi_c == pytest.approx(0.6, abs=1e-9)
    assert all(np.allclose(state.T_base_tool_c, start, rtol=0, atol=1e-9) for state in hand.states)


def test_an_arm_angle_passes_zero_although_the_vendors_client_cannot_say_zero(make_hand) -> None:
    hand = make_hand()
    hand.start(1, 2)
    hand.shift((0, 0, 0), 1.0, psi=0.2)
    T = hand.state.T_base_tool_c.matrix
    for k in range(1, 1201):  # From 0.2 to -0.2; on its way a command of exactly zero, which goes out as "not valid".
        u = k / 1200.0
        psi = 0.2 - 0.4 * (u**4 * (35.0 - 84.0 * u + 70.0 * u * u - 20.0 * u**3))
        psi = 0.0 if abs(psi) < 1e-12 else psi
        assert hand.command(T_base_tool_c=tuple(T.ravel()), psi_valid=psi != 0.0, psi_c=psi).faults == ()
    assert hand.state.psi_c == pytest.approx(-0.2, abs=1e-9)


def test_poses_without_an_arm_angle_hold_one_that_is_nearly_zero(make_hand) -> None:
    hand = make_hand()
    hand.start(1, 2)
    hand.shift((0, 0, 0), 0.2, psi=1e-4)
    hand.ask(rci.StopMove())
    hand.rest()
    hand.start(1, 2)
    T, psi = hand.state.T_base_tool_c.matrix, hand.state.psi_c
    for _ in range(5):
        assert hand.pose(T).faults == ()
    assert hand.state.psi_c == pytest.approx(psi, abs=1e-12)
    assert psi == pytest.approx(1e-4, abs=1e-9)


@PLANTS
def test_a_turn_of_the_tool_is_followed_through_the_tool_that_was_set(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    tool = (1.0, 0, 0, 0.1, 0, 1, 0, 0.0, 0, 0, 1, 0.15, 0, 0, 0, 1)
    assert hand.ask(rci.SetCoor(tool)) == 0
    hand.start(1, 2)
    start = hand.state.T_base_tool_c.matrix
    for k in range(1, 1001):
        u = k / 1000.0
        angle = 0.4 * u**4 * (35.0 - 84.0 * u + 70.0 * u * u - 20.0 * u**3)
        T = start.copy()
        T[:3, :3] = T[:3, :3] @ Pose.from_rpy((0, 0, 0), (angle, 0, 0)).rotation
        hand.pose(T)
    assert hand.state.faults == ()
    turn = rotation_between(tuple(start[:3, :3].ravel()), tuple(hand.state.T_base_tool_c.rotation.ravel()))
    assert math.hypot(*turn) == pytest.approx(0.4, abs=1e-9)
    assert np.allclose(hand.state.T_base_tool_c.position, start[:3, 3], rtol=0, atol=1e-12)


def test_lost_poses_are_bridged_on_their_curve(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start(1, 2)
    start = hand.state.T_base_tool_c.matrix
    for k in range(1, 1001):
        u = k / 1000.0
        T = start.copy()
        T[0, 3] -= 0.15 * u**4 * (35.0 - 84.0 * u + 70.0 * u * u - 20.0 * u**3)
        if k % 37 != 5:
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, T_base_tool_c=tuple(T.ravel())))
        hand.step()
    assert not any(state.faults for state in hand.states)
    assert hand.cycle.playout.lost > 20


@PLANTS
def test_joint_impedance_arrives_near_its_goal(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    assert hand.ask(rci.SetJointImpedance((1000.0,) * 4 + (100.0,) * 3)) == 0
    hand.start(2, 1)
    assert hand.state.controller_mode is ControllerMode.JOINT_IMPEDANCE
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.2, speed=0.5).q
    hand.play(rows)
    hand.play(np.tile(rows[-1], (300, 1)))
    assert hand.state.faults == ()
    assert np.allclose(hand.state.q, rows[-1], rtol=0, atol=5e-3)
    assert hand.ask(rci.StopMove()) == 0


@PLANTS
@pytest.mark.parametrize("stiffness", [500.0, 2000.0])
def test_a_joint_spring_yields_by_torque_over_stiffness(make_hand, plant: str, stiffness: float) -> None:
    hand = make_hand(plant=plant)
    assert hand.ask(rci.SetJointImpedance((stiffness,) * 4 + (200.0,) * 3)) == 0
    hand.start(2, 1)
    q_c = hand.state.q_c
    wrench = np.array((0.0, 8.0, -10.0, 0.0, 0.0, 0.0))
    hand.cycle.plant.push(wrench)
    hand.play(np.tile(q_c, (1500, 1)))
    assert hand.state.faults == ()
    expected = hand.model.jacobian(hand.state.q).T @ wrench / np.array([stiffness] * 4 + [200.0] * 3)
    assert np.allclose(hand.state.q - q_c, expected, rtol=0.05, atol=2e-4)


@PLANTS
@ARMS
def test_a_cartesian_spring_yields_by_force_over_stiffness(make_hand, name: str, plant: str) -> None:
    hand = make_hand(name, plant)
    assert hand.ask(rci.SetCartesianImpedance((800.0, 800.0, 400.0, 100.0, 100.0, 100.0))) == 0
    hand.start(3, 2)
    T = hand.state.T_base_tool_c.matrix
    hand.cycle.plant.push((0.0, 0.0, -8.0, 0.0, 0.0, 0.0))
    for _ in range(1500):
        hand.pose(T)
    assert hand.state.faults == ()
    assert np.allclose(hand.state.T_base_tool.position - T[:3, 3], (0.0, 0.0, -0.02), rtol=0.05, atol=1e-3)
    assert np.allclose(hand.state.tau_ext_in_base[:3], (0, 0, -8.0), rtol=0, atol=0.4)


@PLANTS
def test_the_desired_wrench_may_change_while_the_spring_acts(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    assert hand.ask(rci.SetCartesianImpedance((1000.0,) * 3 + (100.0,) * 3)) == 0
    hand.start(3, 2)
    T = hand.state.T_base_tool_c.matrix
    assert hand.ask(rci.SetCartImpDesiredTau((10.0, 0.0, 0.0, 0.0, 0.0, 0.0))) == 0
    for _ in range(1500):
        hand.pose(T)
    assert np.allclose(hand.state.T_base_tool.position - T[:3, 3], (0.01, 0.0, 0.0), rtol=0.05, atol=1e-3)


@PLANTS
@pytest.mark.parametrize("motion", [0, 1])
def test_torques_act_on_top_of_gravity(make_hand, plant: str, motion: int) -> None:
    hand = make_hand(plant=plant)
    hand.start(4, motion)
    assert hand.state.motion_generator_mode == motion
    start = hand.state.q
    for _ in range(200):
        hand.torque((0.0,) * 7)
    assert np.allclose(hand.state.q, start, rtol=0, atol=2e-3)  # Weightless, it stays.
    for k in range(1, 101):
        hand.torque((0.06 * k, 0, 0, 0, 0, 0, 0))
    assert hand.state.faults == ()
    assert hand.state.tau_c[0] == pytest.approx(6.0)
    assert hand.state.q[0] > start[0] + 1e-4
    assert np.array_equal(hand.state.q_c, hand.state.q)


@PLANTS
def test_a_torque_loop_of_springs_holds_the_tool_where_it_is_told(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    hand.start(4, 0)
    goal = hand.state.T_base_tool.position + (0.0, 0.0, 0.03)
    tau = np.zeros(7)
    for _ in range(2500):
        state = hand.state
        J = hand.model.jacobian(state.q)
        wanted = J[:3].T @ (200.0 * (goal - state.T_base_tool.position)) - 4.0 * state.dq
        tau += np.clip(wanted - tau, -0.5, 0.5)
        hand.torque(tau)
    assert hand.state.faults == ()
    assert np.allclose(hand.state.T_base_tool.position, goal, rtol=0, atol=5e-3)
    assert hand.ask(rci.StopMove()) == 0
    assert not hand.state.dq_c.any()


@PLANTS
@pytest.mark.parametrize(("controller", "motion"), [(2, 1), (3, 2), (4, 0)])
def test_a_yielding_arm_stops_from_where_it_is_inside_its_limits(make_hand, plant, controller, motion) -> None:
    hand = make_hand(plant=plant)
    assert hand.ask(rci.SetJointImpedance((100.0,) * 7)) == 0
    assert hand.ask(rci.SetCartesianImpedance((100.0,) * 6)) == 0
    hand.start(controller, motion)
    q_c, T = hand.state.q_c, hand.state.T_base_tool_c.matrix
    hand.cycle.plant.push((0.0, 10.0, 0.0, 0.0, 0.0, 0.0))
    for _ in range(40):
        hand.command(q_c, T_base_tool_c=tuple(T.ravel()))
    before = hand.state
    assert np.abs(before.dq).max() > 0.1
    hand.cycle.plant.push((0.0,) * 6)
    hand.ask(rci.SetMotorPower(0))
    hand.states = hand.states[hand.states.index(before) + 1 :]
    dq, ddq, _ = hand.differences()
    assert np.abs(hand.states[0].q_c - before.q - 1e-3 * before.dq).max() < 1e-4
    assert np.abs(dq[0] - before.dq).max() < 0.1
    assert (np.abs(ddq) < 2.0 * hand.model.limits.joint.acceleration).all()  # It was thrown harder than that.
    assert hand.state.robot_mode is RobotMode.OTHER
    assert not hand.state.dq_c.any()


def test_after_the_last_torque_the_arm_is_brought_to_rest(make_hand) -> None:
    hand = make_hand()
    hand.start(4, 0)
    for k in range(1, 50):
        hand.torque((0.1 * k, 0, 0, 0, 0, 0, 0), finished=k == 49)
    hand.step(500)
    assert not hand.state.dq_c.any()
    assert hand.state.faults == ()


def test_lost_torques_keep_the_last_one(make_hand) -> None:
    hand = make_hand()
    hand.start(4, 0)
    for k in range(1, 20):
        hand.torque((0.1 * k, 0, 0, 0, 0, 0, 0))
    assert hand.step(5).tau_c[0] == pytest.approx(1.9)
    assert hand.step(15).faults == (Fault.INSTABILITY_DETECTION,)
