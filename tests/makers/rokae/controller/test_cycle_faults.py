"""Every fault at the cycle: its condition, its bit in that very cycle, one stop, recovery, and the next motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.core.state import RobotMode, RobotState
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller import fault_stop
from rcilab.makers.rokae.controller.state_machine import Phase
from rcilab.makers.rokae.faults import Fault
from rcilab.motion.joint import plan_joint
from rcilab.sim.streamed_motion import LATE_TOLERANCE, LOST_LIMIT
from tests.makers.rokae.controller.conftest import Hand

F = Fault
Provocation = Callable[[Hand], RobotState]


def moved(hand: Hand, offset: tuple[float, float, float], **fields: object) -> RobotState:
    T = hand.state.T_base_tool_c.matrix
    T[:3, 3] += offset
    return hand.pose(T, **fields)


def accelerate(hand: Hand, axis: int, acceleration: float, jerk: float) -> RobotState:
    """Moves the commanded tool along one axis with an acceleration that grows at a steady jerk."""
    T = hand.state.T_base_tool_c.matrix
    a = v = 0.0
    for _ in range(2000):
        a = min(a + jerk * 1e-3, acceleration)
        v += a * 1e-3
        T[axis, 3] += v * 1e-3
        if hand.pose(T).faults:
            break
    return hand.state


def joint_position(hand: Hand) -> RobotState:
    hand.ask(rci.SetJointLimit(tuple(hand.model.home + 0.1), tuple(hand.model.home - 0.1)))
    hand.start()
    return hand.play(hand.swing(5, 0.2, 1.2))


def tool_position(hand: Hand) -> RobotState:
    hand.ask(hand.box(0.04))
    hand.start(1, 2)
    return accelerate(hand, 1, 0.2, 2.0)


def tool_position_by_joints(hand: Hand) -> RobotState:
    hand.ask(hand.box(0.04))
    hand.start()
    return hand.play(hand.swing(1, 0.2, 0.8))


def elbow(hand: Hand) -> RobotState:
    hand.start(1, 2)
    return hand.pose(hand.state.T_base_tool_c, 0.5)


def elbow_beyond_a_turn(hand: Hand) -> RobotState:
    hand.start(1, 2)
    return hand.pose(hand.state.T_base_tool_c, 3.2)


def joint_velocity(hand: Hand) -> RobotState:
    hand.start()
    return hand.play(hand.swing(1, 2.5, 0.6))


def tool_velocity(hand: Hand) -> RobotState:
    hand.start(1, 2)
    start, angle, v = hand.state.T_base_tool_c.matrix, 0.0, 0.0
    for k in range(1, 1000):  # About its own axis, which joint 7 alone can do.
        v += 1e-3 * min(6.0, 0.1 * k)
        angle += 1e-3 * v
        if hand.pose(Pose.from_matrix(start) @ Pose.from_rpy((0, 0, 0), (0, 0, angle))).faults:
            break
    return hand.state


def joint_acceleration(hand: Hand) -> RobotState:
    hand.start()
    return hand.play(hand.swing(2, 2.0, 0.4))


def tool_acceleration(hand: Hand) -> RobotState:
    hand.start(1, 2)
    hand.pose(hand.state.T_base_tool_c)
    return moved(hand, (0.0, 1.1e-5, 0.0))  # 11 m/s^2, 11000 m/s^3.


def jerk(hand: Hand) -> RobotState:
    hand.start()
    q = hand.state.q_c.copy()
    hand.command(q)
    q[0] += 6e-6
    return hand.command(q)


def singular(hand: Hand) -> RobotState:
    hand.start(1, 2)
    return accelerate(hand, 2, 0.15, 2.0)


def no_frame(hand: Hand) -> RobotState:
    hand.start(1, 2)
    T = hand.state.T_base_tool_c.matrix
    T[0, 0] += 1e-3
    return hand.pose(T)


def no_number(hand: Hand) -> RobotState:
    hand.start(1, 2)
    return moved(hand, (np.nan, 0, 0))


def torque_rate(hand: Hand) -> RobotState:
    hand.start(4, 0)
    return hand.torque((0, 0, 1.6, 0, 0, 0, 0))


def torque_range(hand: Hand) -> RobotState:
    hand.ask(rci.SetFilters(1000.0, 1000.0, 1000.0))
    hand.start(4, 0)
    M = hand.model.rigid_body.mass_matrix(hand.model.home)
    for k in range(1, 100):
        if hand.torque(1.4 * k * M[1] / M[1, 1]).faults:  # Joint 2 alone is to move.
            break
    return hand.state


def no_torque(hand: Hand) -> RobotState:
    hand.start(4, 0)
    return hand.torque((np.nan,) * 7)


def lost(hand: Hand) -> RobotState:
    hand.start()
    hand.play(hand.swing(1, 0.5, 0.3))
    return hand.step(LATE_TOLERANCE + LOST_LIMIT)


def collision(hand: Hand) -> RobotState:
    hand.ask(rci.SetCollisionBehavior((8.0,) * 7))
    hand.start()
    hand.cycle.plant.push((0.0, 0.0, -20.0, 0.0, 0.0, 0.0))
    for _ in range(50):
        if hand.command(hand.state.q_c).faults:
            break
    hand.cycle.plant.push((0.0,) * 6)
    return hand.state


COMMANDED = [
    (joint_position, F.COMMAND_JOINT_POSITION_LIMITS_VIOLATION),
    (tool_position, F.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION),
    (tool_position_by_joints, F.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION),
    (elbow, F.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION),
    (elbow_beyond_a_turn, F.COMMAND_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION),
    (joint_velocity, F.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION),
    (tool_velocity, F.COMMAND_CARTESIAN_VELOCITY_LIMITS_VIOLATION),
    (joint_acceleration, F.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION),
    (tool_acceleration, F.COMMAND_CARTESIAN_ACCELERATION_LIMITS_VIOLATION),
    (jerk, F.COMMAND_JOINT_ACCELERATION_DISCONTINUITY),
    (collision, F.COLLISION),
    (no_frame, F.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME),
    (no_number, F.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME),
    (torque_rate, F.COMMAND_TORQUE_DISCONTINUITY),
    (torque_range, F.COMMAND_TORQUE_RANGE_VIOLATION),
    (no_torque, F.COMMAND_TORQUE_RANGE_VIOLATION),
    (lost, F.INSTABILITY_DETECTION),
]


def recovers_and_moves_again(hand: Hand) -> None:
    hand.step(200)
    assert hand.ask(rci.StopMove()) == 0
    hand.ask(rci.SetCollisionBehavior((75.0, 75.0, 60.0, 45.0, 30.0, 30.0, 20.0)))
    assert hand.ask(rci.AutomaticErrorRecovery()) == 0
    assert hand.step().faults == ()
    hand.start()
    goal = hand.state.q_c + 0.3 * (hand.model.home - hand.state.q_c)
    hand.play(plan_joint(hand.model, hand.state.q_c, goal, speed=0.3).q)
    assert hand.state.faults == (), hand.cycle.reason


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize(("provoke", "fault"), COMMANDED, ids=lambda value: getattr(value, "__name__", ""))
def test_a_broken_condition_is_its_bit_in_that_cycle_one_stop_and_a_recovery(make_hand, plant, provoke, fault) -> None:
    hand = make_hand(plant=plant)
    provoke(hand)
    first = next(state for state in hand.states if state.faults)
    assert fault in first.faults, (first.faults, hand.cycle.reason)
    is_limit = F.COMMAND_JOINT_POSITION_LIMITS_VIOLATION in first.faults
    assert hand.cycle.phase is (Phase.CUT_OFF if is_limit else Phase.REFLEX)
    assert hand.cycle.reason
    assert first.robot_mode is RobotMode.REFLEX
    if fault_stop.FAULT_STOP[fault].offender is fault_stop.FaultSource.COMMAND and provoke not in (torque_range,):
        hand.rest()
        if provoke not in (torque_rate, no_torque):
            hand.assert_smooth()
    recovers_and_moves_again(hand)


def test_a_line_through_a_singularity_ends_before_it(make_hand) -> None:
    hand = make_hand()
    singular(hand)
    assert hand.state.faults
    assert {*hand.state.faults} <= {
        F.CARTESIAN_POSITION_MOTION_GENERATOR_INVALID_FRAME,
        F.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,
        F.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION,
        F.COMMAND_JOINT_ACCELERATION_DISCONTINUITY,
    }
    hand.rest()
    hand.assert_smooth()


@pytest.mark.parametrize("name", ["xMatePro7", "xMate3"])
@pytest.mark.parametrize("mode", [1, 3])
def test_a_cartesian_motion_does_not_start_at_a_singularity(make_hand, name: str, mode: int) -> None:
    hand = make_hand(name)
    hand.cycle.reset(np.zeros(hand.model.n))
    hand.ask(rci.SetMotorPower(1))
    assert hand.ask(rci.StartMove(mode, 2)) is rci.StartStatus.SINGULAR_START_POSE
    assert hand.ask(rci.StartMove(0, 1)) is rci.StartStatus.SUCCESS


@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
@pytest.mark.parametrize(
    ("axis", "sign", "is_allowed"),
    [(2, -1, True), (2, 1, False), (1, 1, False), (1, -1, False)],
    ids=["inwards", "outwards", "past another face", "past the face opposite to it"],
)
def test_a_tool_that_starts_outside_its_box_may_only_move_in(
    make_hand, plant: str, axis: int, sign: int, is_allowed: bool
) -> None:
    hand = make_hand(plant=plant)
    x, y, z = hand.state.T_base_tool.position.tolist()
    below = (1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z - 0.06, 0, 0, 0, 1)  # The tool starts 5 cm beyond the +z face.
    hand.ask(rci.SetCartesianLimit((0.02, 0.02, 0.02), below, True))
    hand.start(1, 2)
    T, v = hand.state.T_base_tool_c.matrix, 0.0
    for k in range(1000):
        v += 0.05 * 1e-3 * (min(k, 100) / 100.0)
        T[axis, 3] += sign * v * 1e-3
        if hand.pose(T).faults:
            break
    allowed = [] if is_allowed else [Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION]
    assert list(hand.state.faults) == allowed


def test_a_tool_that_came_in_stays_in(make_hand) -> None:
    hand = make_hand()
    x, y, z = hand.state.T_base_tool.position.tolist()
    below = (1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z - 0.02, 0, 0, 0, 1)  # The tool starts 1 cm beyond the +z face.
    hand.ask(rci.SetCartesianLimit((0.02, 0.02, 0.02), below, True))
    hand.start(1, 2)
    T = hand.state.T_base_tool_c.matrix
    start = T[2, 3]
    for k in range(1, 1201):  # 2 cm down, and back up to where it began.
        T[2, 3] = start - 0.01 * (1.0 - np.cos(2.0 * np.pi * k / 1200.0))
        if hand.pose(T).faults:
            break
    assert list(hand.state.faults) == [Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION]
    assert hand.state.T_base_tool_c.matrix[2, 3] - (start - 0.01) < 1e-3  # At the face, on its way out.


def test_an_inactive_box_bounds_nothing(make_hand) -> None:
    hand = make_hand()
    request = hand.box(0.04)
    hand.ask(rci.SetCartesianLimit(request.size, request.frame, False))
    hand.start()
    assert hand.play(hand.swing(1, 0.3, 0.8)).faults == ()


def test_the_table_of_fault_stops_holds_every_fault() -> None:
    assert list(fault_stop.FAULT_STOP) == list(Fault)
    text = fault_stop.as_text()
    assert all(fault.manual_name in text for fault in Fault)
