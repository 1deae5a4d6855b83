"""The millisecond: conditions, faults, stops, lost commands, and what the state says meanwhile."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.state_machine import Event, Phase
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel
from rcilab.motion.joint import plan_joint

F = Fault


def test_it_wakes_up_powered_off_at_home(hand, model: RobotModel) -> None:
    state = hand.step()
    assert np.array_equal(state.q, model.home)
    assert np.array_equal(state.q_c, model.home)
    assert state.robot_mode is RobotMode.OTHER
    assert hand.cycle.handle(rci.GetMotorState()).response == rci.MotorStateResponse(0)
    assert hand.ask(rci.StartMove(0, 1)) is rci.StartStatus.NOT_POSSIBLE


def test_every_cycle_has_its_own_number(hand) -> None:
    hand.step(5)
    assert [state.message_id for state in hand.states] == list(range(6))


def test_the_modes_appear_after_the_delay_and_not_before(hand) -> None:
    hand.ask(rci.SetMotorPower(1))
    hand.ask(rci.StartMove(0, 1))
    shown = [hand.step().motion_generator_mode for _ in range(4)]
    assert shown == [0, 0, 1, 1]
    assert hand.state.controller_mode is ControllerMode.JOINT_POSITION
    assert hand.state.robot_mode is RobotMode.MOVE


@pytest.mark.parametrize("name", ["xMatePro3", "xMatePro7", "xMate3", "xMate7"])
@pytest.mark.parametrize("law", ["jerk_limited", "s_profile"])
def test_a_planned_motion_at_full_speed_arrives_exactly_and_without_a_fault(make_hand, name: str, law: str) -> None:
    hand = make_hand(name)
    hand.start()
    motion = plan_joint(hand.model, hand.model.home, hand.model.home + 0.3, speed=1.0, law=law)
    hand.play(motion.q)
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert not any(state.faults for state in hand.states)
    assert np.array_equal(hand.state.q, motion.goal)
    assert np.array_equal(hand.state.q_c, motion.goal)
    assert hand.cycle.phase is Phase.IDLE
    assert all(state.success_rate == 1.0 for state in hand.states)


def test_idle_modes_are_shown_before_stop_move_is_answered(hand) -> None:
    hand.start()
    reply = hand.cycle.handle(rci.StopMove())
    assert reply.when.name == "AT_REST"
    state = hand.step()
    assert (state.motion_generator_mode, state.controller_mode, state.robot_mode) == (0, 5, 1)
    assert hand.cycle.is_settled


def jump(hand, joint: int, size: float) -> np.ndarray:
    q = hand.state.q_c.copy()
    q[joint - 1] += size
    return q


@pytest.mark.parametrize("joint", range(1, 8))
def test_a_command_that_jumps_is_a_discontinuity(hand, joint: int) -> None:
    hand.start()
    hand.command(hand.state.q_c)
    q_before = hand.state.q_c
    state = hand.command(jump(hand, joint, 8e-6))  # 8000 rad/s^3 with 8 rad/s^2.
    expected = {F.COMMAND_JOINT_ACCELERATION_DISCONTINUITY}
    if joint == 2:
        expected.add(F.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION)
    assert set(state.faults) == expected
    assert np.array_equal(state.q_c, q_before)
    assert state.robot_mode is RobotMode.REFLEX


def test_too_fast_is_a_velocity_fault_in_the_cycle_of_the_violation(hand) -> None:
    hand.start()
    hand.play(hand.swing(1, 2.5, 0.6))
    speeds = np.array([state.dq_c[0] for state in hand.states])
    first = next(k for k, state in enumerate(hand.states) if state.faults)
    assert hand.states[first].faults == (F.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION,)
    assert speeds[first - 1] < 2.175
    assert speeds[first - 1] + 0.02 > 2.175
    assert hand.states[first].message_id == hand.states[first - 1].message_id + 1


def test_too_much_acceleration_is_its_fault(hand) -> None:
    hand.start()
    hand.play(hand.swing(2, 2.0, 0.4))  # pi * 2.0 / 2 / 0.4 = 7.9 rad/s^2, joint 2 may do 7.5.
    assert next(state.faults for state in hand.states if state.faults) == (
        F.COMMAND_JOINT_ACCELERATION_LIMITS_VIOLATION,
    )


def test_a_jump_of_the_acceleration_is_a_discontinuity(hand) -> None:
    hand.start()
    q = hand.state.q_c.copy()
    for k in range(1, 30):
        q[0] += 1e-6 * k * 6.0  # 6 rad/s^2 from one cycle to the next: 6000 rad/s^3.
        if hand.command(q).faults:
            break
    assert hand.state.faults == (F.COMMAND_JOINT_ACCELERATION_DISCONTINUITY,)
    assert hand.cycle.playout.is_playing


def test_leaving_the_joint_range_is_a_position_fault(hand) -> None:
    upper = tuple(hand.model.home + 0.1)
    assert hand.ask(rci.SetJointLimit(upper, tuple(hand.model.home - 0.1))) is rci.SettingStatus.SUCCESS
    hand.start()
    hand.play(hand.swing(5, 1.0, 0.4))
    first = next(state for state in hand.states if state.faults)
    assert first.faults == (F.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,)
    assert 0.099 < first.q_c[4] - hand.model.home[4] < 0.101
    hand.rest()
    hand.assert_smooth()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300])
def test_a_command_that_is_no_number_is_a_fault_and_not_followed(hand, bad: float) -> None:
    hand.start()
    hand.play(hand.swing(1, 1.0, 0.2))
    state = hand.command([*hand.state.q_c[:6], bad])
    assert F.COMMAND_JOINT_POSITION_LIMITS_VIOLATION in state.faults
    hand.rest()
    beyond_every_range = math.isfinite(bad)  # That takes motor power, and nonsense does not.
    assert hand.ask(rci.GetMotorState()) == rci.MotorStateResponse(int(not beyond_every_range))
    assert all(np.isfinite(state.q_c).all() and np.isfinite(state.q).all() for state in hand.states)
    hand.assert_smooth()


def test_the_garbage_in_the_seventh_place_of_a_6_axis_arm_is_ignored(make_hand) -> None:
    hand = make_hand("xMate7")
    hand.start()
    for _ in range(20):
        datagram = rci.encode_command(rci.CommandPacket(hand.state.message_id, (*hand.state.q_c, math.nan)))
        hand.cycle.receive(rci.decode_command(datagram, 6))
        hand.step()
    assert hand.state.faults == ()


@pytest.mark.parametrize("joint", range(1, 8))
def test_after_a_fault_the_arm_stops_once_inside_its_limits_and_the_bit_stays(hand, joint: int) -> None:
    hand.start()
    hand.play(hand.swing(joint, 1.5, 0.5))
    fault = hand.command(jump(hand, joint, 0.01)).faults
    assert fault
    hand.rest()
    hand.assert_smooth()
    dq, _, _ = hand.differences()
    speed = dq[:, joint - 1]
    assert (speed > -1e-9).all()  # No turning back, no second start.
    assert hand.state.faults == fault
    assert hand.state.robot_mode is RobotMode.REFLEX
    assert (hand.state.controller_mode, hand.state.motion_generator_mode) == (5, 0)


def test_what_is_still_queued_when_a_fault_strikes_is_forgotten(hand) -> None:
    hand.start()
    rows = hand.swing(1, 1.0, 0.2)
    hand.play(rows[:-20])
    hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(jump(hand, 1, 1.0))))
    for row in rows[-20:]:
        hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
    assert hand.step().faults
    assert len(hand.cycle.playout) == 0
    hand.rest()
    hand.assert_smooth()


def test_stop_move_in_mid_motion_is_one_controlled_stop(hand) -> None:
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert not hand.state.dq_c.any()
    assert not any(state.faults for state in hand.states)
    hand.assert_smooth()


def test_a_client_that_vanishes_in_mid_motion_leaves_one_controlled_stop(hand) -> None:
    hand.start()
    rows = hand.swing(1, 1.5, 0.4)
    hand.play(rows[:-30])
    for row in rows[-30:]:  # These are in the queue when the connection ends; nobody watches over them any more.
        hand.cycle.receive(rci.CommandPacket(0, tuple(row)))
    hand.cycle.on_event(Event.CLIENT_LOST)
    before = hand.state.q_c[0]
    hand.rest()
    hand.assert_smooth()
    assert hand.state.robot_mode is RobotMode.IDLE
    assert hand.state.q_c[0] - before < 0.2
    hand.cycle.receive(rci.CommandPacket(0, tuple(rows[-1])))
    assert hand.cycle.ignored == 1


@pytest.mark.parametrize(
    ("controller", "motion"), [(0, 0), (0, 2), (1, 0), (1, 1), (2, 0), (2, 2), (3, 0), (3, 1), (4, 2)]
)
def test_pairs_of_modes_that_make_no_sense_are_refused(hand, controller: int, motion: int) -> None:
    hand.ask(rci.SetMotorPower(1))
    assert hand.ask(rci.StartMove(controller, motion)) is rci.StartStatus.NOT_POSSIBLE
    assert hand.cycle.phase is Phase.IDLE


@pytest.mark.parametrize(("controller", "motion"), [(5, 1), (255, 0), (0, 3), (0, 255)])
def test_modes_that_do_not_exist_are_an_invalid_argument(hand, controller: int, motion: int) -> None:
    hand.ask(rci.SetMotorPower(1))
    assert hand.ask(rci.StartMove(controller, motion)) is rci.StartStatus.INVALID_ARGUMENT


def test_the_tool_changes_the_reported_pose_and_the_load_the_reported_torque(hand, model: RobotModel) -> None:
    before = hand.step()
    pose = (1.0, 0, 0, 0.0, 0, 1, 0, 0.0, 0, 0, 1, 0.2, 0, 0, 0, 1)
    assert hand.ask(rci.SetCoor(pose)) is rci.SettingStatus.SUCCESS
    assert hand.ask(rci.SetLoad(2.0, (0, 0, 0.1), (0.0,) * 9)) is rci.SettingStatus.SUCCESS
    state = hand.step(200)
    tip = before.T_base_tool @ np.array([0, 0, 0.2])
    assert np.allclose(state.T_base_tool.position, tip, rtol=0, atol=1e-12)
    assert np.array_equal(state.T_base_tool, state.T_base_tool_c)
    assert np.abs(state.tau - before.tau).max() > 1.0
    assert np.array_equal(state.tau_filtered, state.tau)


def test_setters_are_not_possible_while_a_motion_is_under_way(hand) -> None:
    hand.start()
    assert hand.ask(rci.SetJointImpedance((10.0,) * 7)) is rci.SettingStatus.NOT_POSSIBLE
    assert hand.ask(rci.SetDO(1, True)) is rci.SettingStatus.SUCCESS
    assert hand.cycle.settings.outputs == (False, True, False, False, False, False)


def test_a_reboot_forgets_settings_and_ends_the_connection(hand) -> None:
    hand.ask(rci.SetFilters(1.0, 2.0, 3.0))
    reply = hand.cycle.handle(rci.RebootRobot())
    assert reply.ends_connection
    assert hand.cycle.settings.joint_filter == 1000.0
    assert hand.step().robot_mode is RobotMode.OTHER


def test_digital_inputs_beyond_the_sixth_do_not_exist(hand) -> None:
    assert hand.cycle.handle(rci.GetDIState(5)).response == rci.DigitalInputResponse(rci.SettingStatus.SUCCESS, False)
    assert hand.cycle.handle(rci.GetDIState(6)).response.status is rci.SettingStatus.INVALID_ARGUMENT


def test_two_identical_runs_are_equal_to_the_last_bit(make_hand) -> None:
    records = []
    for _ in range(2):
        hand = make_hand()
        hand.start()
        hand.play(plan_joint(hand.model, hand.model.home, hand.model.home - 0.2, speed=0.9).q)
        hand.ask(rci.StopMove())
        records.append([rci.encode_state(state) for state in hand.states])
    assert records[0] == records[1]


def test_modes_are_hidden_when_a_started_motion_is_called_off(hand) -> None:
    hand.ask(rci.SetMotorPower(1))
    hand.ask(rci.StartMove(0, 1))
    hand.step()
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    hand.step(10)
    assert hand.state.motion_generator_mode is MotionGeneratorMode.IDLE
    assert hand.cycle.phase is Phase.IDLE
