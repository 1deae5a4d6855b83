"""The way back after a fault: refusals, recoveries that are overtaken, motions that lead back."""

from __future__ import annotations

import re

import numpy as np

from rcilab.core.state import RobotMode
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.state_machine import Phase
from rcilab.makers.rokae.faults import Fault
from rcilab.motion.joint import plan_joint

F = Fault


def jump(hand, joint: int, size: float) -> np.ndarray:
    q = hand.state.q_c.copy()
    q[joint - 1] += size
    return q


def test_a_motion_from_beyond_a_bound_may_lead_back_and_not_farther_out(make_hand) -> None:
    hand = make_hand()
    hand.ask(rci.SetJointLimit(tuple(hand.model.home - 0.05), tuple(hand.model.home - 0.3)))
    hand.start()
    hand.play(plan_joint(hand.model, hand.model.home, hand.model.home - 0.1, speed=0.2).q)
    assert hand.state.faults == ()
    assert hand.ask(rci.StopMove()) == 0
    hand.start()
    hand.play(plan_joint(hand.model, hand.state.q_c, hand.model.home, speed=0.2).q)
    assert hand.state.faults == (F.COMMAND_JOINT_POSITION_LIMITS_VIOLATION,)


def test_recovery_is_refused_beyond_a_limit_and_while_something_presses(make_hand) -> None:
    hand = make_hand()
    hand.ask(rci.SetJointLimit(tuple(hand.model.home + 0.1), tuple(hand.model.home - 0.1)))
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    hand.rest()
    (warning,) = hand.cycle.arm.warnings
    assert re.fullmatch(
        r"joint 1 is at \d+\.\d\d deg, beyond -5.73 to 5.73 deg: power off and on, then move it back", warning
    )
    assert hand.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.MANUAL_RECOVERY_NEEDED
    assert hand.state.robot_mode is RobotMode.REFLEX
    assert hand.ask(rci.SetMotorPower(0)) == 0
    hand.start()

    hand = make_hand()
    hand.ask(rci.SetCollisionBehavior((8.0,) * 7))
    hand.start()
    hand.cycle.plant.push((0.0, 0.0, -20.0, 0.0, 0.0, 0.0))
    for _ in range(50):
        hand.command(hand.state.q_c)
    assert hand.state.faults == (F.COLLISION,)
    assert hand.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.REFLEX
    hand.cycle.plant.push((0.0,) * 6)
    hand.step(100)
    assert hand.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.SUCCESS


def test_a_recovery_that_is_overtaken_by_an_emergency_stop_says_so(make_hand) -> None:
    hand = make_hand()
    hand.start()
    hand.command(hand.state.q_c + 6e-3)
    assert hand.cycle.phase is Phase.REFLEX
    request = rci.AutomaticErrorRecovery()
    reply = hand.cycle.handle(request)
    hand.step(5)
    hand.cycle.press_safety_stop(rci.SafetyStop.GSTOP)
    hand.step()
    assert hand.cycle.is_settled
    answer = hand.cycle.conclude(request, reply)
    assert answer.response == rci.StatusResponse(rci.RecoveryStatus.USER_STOP)
    assert answer.refusal == "refused AutomaticErrorRecovery (user stop): the safety gate is open"


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
