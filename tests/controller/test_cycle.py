"""The millisecond: conditions, faults, stops, lost commands, and what the state says meanwhile."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.controller.cycle import ControlCycle
from rcilab.controller.plant import Drive, IdealPlant, Measurement, Setpoint
from rcilab.controller.state_machine import Event, Phase
from rcilab.faults import Fault
from rcilab.model import RobotModel, load_model
from rcilab.motion.joint import plan_joint
from rcilab.protocols import rci
from rcilab.state import ControllerMode, MotionGeneratorMode, RobotMode

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
def test_a_first_command_elsewhere_than_the_arm_is_a_discontinuity(hand, joint: int) -> None:
    hand.start()
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


def test_stop_move_is_answered_with_success_after_a_fault_and_recovery_clears_it(hand) -> None:
    hand.start()
    fault = hand.command(jump(hand, 1, 1.0)).faults
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert hand.state.faults == fault
    assert hand.ask(rci.StartMove(0, 1)) is rci.StartStatus.REFLEX
    assert hand.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.SUCCESS
    assert hand.step().faults == ()
    assert hand.state.robot_mode is RobotMode.IDLE
    hand.start()


def test_recovery_shows_its_own_robot_mode_for_a_while(hand) -> None:
    hand.start()
    hand.command(jump(hand, 1, 1.0))
    hand.cycle.handle(rci.AutomaticErrorRecovery())
    assert hand.step().robot_mode is RobotMode.AUTOMATIC_ERROR_RECOVERY
    hand.step(100)
    assert hand.state.robot_mode is RobotMode.IDLE


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
    hand.cycle.happen(Event.CLIENT_LOST)
    before = hand.state.q_c[0]
    hand.rest()
    hand.assert_smooth()
    assert hand.state.robot_mode is RobotMode.IDLE
    assert hand.state.q_c[0] - before < 0.2
    hand.cycle.receive(rci.CommandPacket(0, tuple(rows[-1])))
    assert hand.cycle.ignored == 1


def test_queued_commands_are_played_before_stop_move_is_answered(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.05).q
    hand.play(rows)
    assert not np.array_equal(hand.state.q_c, rows[-1])
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    assert np.array_equal(hand.state.q_c, rows[-1])


@pytest.mark.parametrize("limit", [10, 20])
def test_n_lost_cycles_in_a_row_are_an_instability_and_one_stop(make_hand, limit: int) -> None:
    hand = make_hand(lost_limit=limit)
    hand.start()
    hand.play(hand.swing(1, 1.0, 0.4))
    assert hand.step(limit - 1).faults == ()
    assert hand.step().faults == (F.INSTABILITY_DETECTION,)
    assert hand.state.success_rate == pytest.approx(400 / (400 + limit))
    hand.rest()
    hand.assert_smooth()


def test_lost_cycles_are_bridged_with_the_acceleration_of_the_last_ones(hand) -> None:
    hand.start()
    hand.play(hand.swing(1, 1.0, 0.4)[:200])
    ddq = hand.state.ddq_c[0]
    state = hand.step(3)
    assert state.ddq_c[0] == pytest.approx(ddq, abs=1e-6)
    assert state.success_rate < 1.0


def test_a_pause_of_the_client_is_survived_by_the_prefill(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start()
    waiting: list[rci.CommandPacket] = []
    for k, row in enumerate(hand.swing(1, 2.0, 0.5)):
        waiting.append(rci.CommandPacket(hand.state.message_id, tuple(row)))
        if k % 50 not in (10, 11, 12, 13):  # Four cycles of nothing; then it answers all the states it has missed.
            for packet in waiting:
                hand.cycle.receive(packet)
            waiting.clear()
        hand.step()
    assert not any(state.faults for state in hand.states)
    assert hand.cycle.playout.lost == 0


def test_a_lost_datagram_is_bridged_when_the_next_ones_are_known(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start()
    for k, row in enumerate(hand.swing(1, 2.0, 0.5)):
        if k % 37 != 5:
            hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
        hand.step()
    assert not any(state.faults for state in hand.states)
    assert hand.cycle.playout.lost > 10
    assert hand.state.success_rate < 1.0


def test_a_burst_of_old_commands_is_played_as_the_motion_it_is(make_hand) -> None:
    hand = make_hand(prefill=4)
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.3).q
    first_id = hand.state.message_id
    for k, row in enumerate(rows[:91]):
        hand.cycle.receive(rci.CommandPacket(first_id - 1000 + k, tuple(row)))
    for row in rows[91:]:
        hand.cycle.receive(rci.CommandPacket(hand.state.message_id, tuple(row)))
        hand.step()
    hand.ask(rci.StopMove())
    assert not any(state.faults for state in hand.states)
    assert np.array_equal(hand.state.q_c, rows[-1])
    assert hand.state.success_rate == 1.0


def test_after_the_last_command_nothing_is_lost(hand) -> None:
    hand.start()
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.05).q
    hand.play(rows[:-1])
    hand.command(rows[-1], finished=True)
    assert hand.step(50).faults == ()
    assert hand.state.success_rate == 1.0
    assert np.array_equal(hand.state.q_c, rows[-1])


def test_joint_impedance_tracks_on_the_ideal_arm(hand) -> None:
    hand.start(controller_mode=2)
    assert hand.state.controller_mode is ControllerMode.JOINT_IMPEDANCE
    rows = plan_joint(hand.model, hand.model.home, hand.model.home + 0.05).q
    assert np.array_equal(hand.play(rows).q, rows[-1])


@pytest.mark.parametrize(("controller", "motion"), [(1, 2), (3, 2), (4, 0), (0, 2), (0, 0), (4, 1), (2, 2)])
def test_modes_that_are_not_there_are_refused_and_not_pretended(hand, controller: int, motion: int) -> None:
    hand.ask(rci.SetMotorPower(1))
    assert hand.ask(rci.StartMove(controller, motion)) is rci.StartStatus.NOT_POSSIBLE
    assert hand.cycle.phase is Phase.IDLE


@pytest.mark.parametrize(("controller", "motion"), [(5, 1), (255, 0), (0, 3), (0, 255)])
def test_modes_that_do_not_exist_are_an_invalid_argument(hand, controller: int, motion: int) -> None:
    hand.ask(rci.SetMotorPower(1))
    assert hand.ask(rci.StartMove(controller, motion)) is rci.StartStatus.INVALID_ARGUMENT


def test_power_off_in_mid_motion_is_one_controlled_stop_and_then_brakes(hand) -> None:
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    assert hand.ask(rci.SetMotorPower(0)) is rci.SettingStatus.SUCCESS
    hand.assert_smooth()
    assert not hand.state.dq_c.any()
    assert hand.state.robot_mode is RobotMode.OTHER
    assert hand.ask(rci.SetMotorPower(7)) is rci.SettingStatus.INVALID_ARGUMENT


def test_an_emergency_stop_in_mid_motion_tells_the_client_and_stops_the_arm(hand) -> None:
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    hand.cycle.press_safety_stop(rci.SafetyStop.ESTOP)
    assert hand.step().faults == (F.INSTABILITY_DETECTION,)
    assert hand.state.robot_mode is RobotMode.USER_STOPPED
    assert hand.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
    hand.assert_smooth()
    assert hand.ask(rci.GetSafetyStopState()) == rci.SafetyStopResponse(rci.SafetyStop.ESTOP)
    assert hand.ask(rci.SetMotorPower(1)) is rci.SettingStatus.NOT_POSSIBLE
    hand.cycle.press_safety_stop(rci.SafetyStop.NONE)
    assert hand.ask(rci.SetMotorPower(1)) is rci.SettingStatus.SUCCESS
    assert hand.step().faults == ()


def test_dragging_is_a_mode_of_its_own(hand) -> None:
    hand.ask(rci.SetMotorPower(1))
    assert hand.ask(rci.StartDrag(2, 0)) is rci.SettingStatus.INVALID_ARGUMENT
    assert hand.ask(rci.StartDrag(0, 2)) is rci.SettingStatus.SUCCESS
    assert hand.step().robot_mode is RobotMode.GUIDING
    assert hand.ask(rci.StartMove(0, 1)) is rci.StartStatus.NOT_POSSIBLE
    assert hand.ask(rci.StopDrag()) is rci.SettingStatus.SUCCESS
    assert hand.state.robot_mode is RobotMode.IDLE


def test_the_tool_changes_the_reported_pose_and_the_load_the_reported_torque(hand, model: RobotModel) -> None:
    before = hand.step()
    pose = (1.0, 0, 0, 0.0, 0, 1, 0, 0.0, 0, 0, 1, 0.2, 0, 0, 0, 1)
    assert hand.ask(rci.SetCoor(pose)) is rci.SettingStatus.SUCCESS
    assert hand.ask(rci.SetLoad(2.0, (0, 0, 0.1), (0.0,) * 9)) is rci.SettingStatus.SUCCESS
    state = hand.step(200)
    tip = before.T_base_tool @ np.array([0, 0, 0.2, 1.0])
    assert np.allclose(state.T_base_tool[:, 3], tip, rtol=0, atol=1e-12)
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
    assert hand.cycle.settings.joint_filter == 100.0
    assert hand.step().robot_mode is RobotMode.OTHER


def test_digital_inputs_beyond_the_sixth_do_not_exist(hand) -> None:
    assert hand.cycle.handle(rci.GetDIState(5)).response == rci.DigitalInputResponse(rci.SettingStatus.SUCCESS, False)
    assert hand.cycle.handle(rci.GetDIState(6)).response.status is rci.SettingStatus.INVALID_ARGUMENT


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
    assert np.array_equal(state.T_base_tool_c, model.forward(state.q_c).matrix)
    assert np.allclose(state.tool_velocity_c, model.jacobian(state.q_c) @ state.dq_c, rtol=0, atol=1e-12)
    assert np.allclose(
        state.tool_acceleration_c, (state.tool_velocity_c - before.tool_velocity_c) / h, rtol=0, atol=1e-9
    )
    moved = (state.T_base_tool_c[:3, 3] - before.T_base_tool_c[:3, 3]) / h
    assert np.allclose(state.tool_velocity_c[:3], moved, rtol=0, atol=5e-3)
    assert np.array_equal(state.tau, model.torque(state.q_c, state.dq_c, state.ddq_c).full)
    assert np.allclose(state.dtau_c, (state.tau_c - before.tau_c) / h, rtol=0, atol=1e-9)
    assert np.array_equal(state.theta, state.q)
    assert np.array_equal(state.motor_tau, state.tau)
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


class TouchyPlant(IdealPlant):
    """An ideal arm that somebody leans on."""

    tau_ext = 0.0

    def step(self, setpoint: Setpoint) -> Measurement:
        measured = super().step(setpoint)
        if not self.tau_ext:
            return measured
        tau_ext = np.full(7, self.tau_ext)
        return Measurement(measured.q, measured.dq, measured.tau, tau_ext, np.array([0, 0, -self.tau_ext, 0, 0, 0]))


def test_an_outside_torque_above_its_threshold_is_a_collision(model: RobotModel) -> None:
    plant = TouchyPlant(model)
    cycle = ControlCycle(model, plant, mode_delay=0, prefill=0)
    cycle.handle(rci.SetCollisionBehavior((12.0,) * 7))
    cycle.handle(rci.SetMotorPower(1))
    cycle.handle(rci.StartMove(0, 1))
    cycle.step()
    plant.tau_ext = 11.0
    assert cycle.step().faults == ()
    plant.tau_ext = 13.0
    state = cycle.step()
    assert state.faults == (F.COLLISION,)
    assert state.robot_mode is RobotMode.REFLEX
    assert state.tau_ext_in_base[2] == -13.0


class Torqueless(IdealPlant):
    """An ideal arm without hand guiding."""

    drives = frozenset({Drive.BRAKED, Drive.POSITION})


def test_a_plant_that_lacks_a_drive_makes_its_modes_impossible() -> None:
    model = load_model("xMate3")
    cycle = ControlCycle(model, Torqueless(model))
    cycle.handle(rci.SetMotorPower(1))
    assert cycle.handle(rci.StartMove(2, 1)).response == rci.StatusResponse(rci.StartStatus.NOT_POSSIBLE)
    assert cycle.handle(rci.StartDrag(0, 0)).response == rci.StatusResponse(rci.SettingStatus.NOT_POSSIBLE)
    assert cycle.handle(rci.StartMove(0, 1)).response == rci.StatusResponse(rci.StartStatus.SUCCESS)


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
