"""Hand guiding, the walls of the virtual guide, digital signals, and the two safety inputs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import rotation_between
from rcilab.core.state import RobotMode
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.state_machine import Event, Phase
from rcilab.makers.rokae.faults import Fault

PLANTS = pytest.mark.parametrize("plant", ["ideal", "mujoco"])
JOINT, CARTESIAN = rci.DragSpace
TRANSLATION, ROTATION, FREE = rci.DragType


def turned(before: np.ndarray, after: np.ndarray) -> float:
    return math.hypot(*rotation_between(tuple(before[:3, :3].ravel()), tuple(after[:3, :3].ravel())))


def drag(hand, space: int, kind: int, wrench: tuple[float, ...], cycles: int = 500) -> tuple[np.ndarray, np.ndarray]:
    """Tool poses before and after something has dragged for a while."""
    assert hand.ask(rci.SetMotorPower(1)) == 0
    assert hand.ask(rci.StartDrag(space, kind)) is rci.SettingStatus.SUCCESS
    before = hand.state.T_base_tool.matrix
    hand.cycle.plant.push(wrench)
    hand.step(cycles)
    assert hand.state.robot_mode is RobotMode.GUIDING
    return before, hand.state.T_base_tool.matrix


def test_dragging_is_a_mode_of_its_own(hand) -> None:
    hand.ask(rci.SetMotorPower(1))
    assert hand.ask(rci.StartDrag(2, 0)) is rci.SettingStatus.INVALID_ARGUMENT
    assert hand.ask(rci.StartDrag(0, 2)) is rci.SettingStatus.SUCCESS
    assert hand.step().robot_mode is RobotMode.GUIDING
    assert hand.ask(rci.StartMove(0, 1)) is rci.StartStatus.NOT_POSSIBLE
    assert hand.ask(rci.StopDrag()) is rci.SettingStatus.SUCCESS
    assert hand.state.robot_mode is RobotMode.IDLE


@PLANTS
def test_a_guided_arm_stays_where_it_is_while_nobody_touches_it(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    before, after = drag(hand, JOINT, FREE, (0.0,) * 6)
    assert np.allclose(before, after, rtol=0, atol=2e-3)


@PLANTS
@pytest.mark.parametrize("space", [JOINT, CARTESIAN])
def test_a_free_arm_goes_where_it_is_pulled_and_the_state_follows(make_hand, plant: str, space: int) -> None:
    hand = make_hand(plant=plant)
    before, after = drag(hand, space, FREE, (0.0, 6.0, 0.0, 0.0, 0.0, 0.0))
    assert after[1, 3] - before[1, 3] > 0.03
    assert np.array_equal(hand.state.q_c, hand.state.q)
    assert np.array_equal(hand.state.T_base_tool, hand.state.T_base_tool_c)
    assert hand.state.dq_c.any()


@PLANTS
def test_a_translation_drag_keeps_the_orientation(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    before, after = drag(hand, CARTESIAN, TRANSLATION, (0.0, 5.0, 5.0, 0.3, 0.0, 0.3))
    assert np.linalg.norm(after[:3, 3] - before[:3, 3]) > 0.03
    assert turned(before, after) < 0.02


@PLANTS
def test_a_rotation_drag_keeps_the_position(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    before, after = drag(hand, CARTESIAN, ROTATION, (2.0, 0.0, 2.0, 0.0, 1.0, 0.0), cycles=1200)
    assert turned(before, after) > 0.05
    assert np.linalg.norm(after[:3, 3] - before[:3, 3]) < 0.01


@PLANTS
def test_stop_drag_is_answered_when_the_arm_rests_where_it_was_led(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    drag(hand, JOINT, FREE, (0.0, 8.0, 0.0, 0.0, 0.0, 0.0), cycles=400)
    hand.cycle.plant.push((0.0,) * 6)
    led, speed = hand.state.q, hand.state.dq
    assert np.abs(speed).max() > 0.05
    assert hand.ask(rci.StopDrag()) is rci.SettingStatus.SUCCESS
    assert hand.state.robot_mode is RobotMode.IDLE
    assert not hand.state.dq_c.any()
    assert np.abs(hand.state.q_c - led).max() < 0.2
    assert (np.sign(hand.state.q_c - led)[np.abs(speed) > 0.05] == np.sign(speed)[np.abs(speed) > 0.05]).all()
    hand.start()


def test_drags_that_do_not_exist_are_an_invalid_argument(hand) -> None:
    hand.ask(rci.SetMotorPower(1))
    for space, kind in ((2, 0), (0, 3), (255, 255)):
        assert hand.ask(rci.StartDrag(space, kind)) is rci.SettingStatus.INVALID_ARGUMENT
    assert hand.cycle.phase is Phase.IDLE
    assert hand.ask(rci.StopDrag()) is rci.SettingStatus.SUCCESS


def test_a_client_that_vanishes_while_guiding_leaves_one_controlled_stop(make_hand) -> None:
    hand = make_hand()
    drag(hand, JOINT, FREE, (0.0, 8.0, 0.0, 0.0, 0.0, 0.0))
    hand.cycle.plant.push((0.0,) * 6)
    hand.cycle.on_event(Event.CLIENT_LOST)
    hand.step(500)
    assert not hand.state.dq.any()
    assert hand.state.robot_mode is RobotMode.IDLE


@PLANTS
def test_walls_keep_a_guided_tool_in_its_box(make_hand, plant: str) -> None:
    hand = make_hand(plant=plant)
    assert hand.ask(hand.box(0.1)) == 0
    assert hand.ask(rci.EnableVirtualGuide(True)) is rci.GuideStatus.SUCCESS
    before, after = drag(hand, JOINT, FREE, (0.0, 9.0, 0.0, 0.0, 0.0, 0.0), cycles=3000)
    assert 0.045 < after[1, 3] - before[1, 3] < 0.06  # Half the box, and 9 N on 3000 N/m.
    assert hand.state.faults == ()


@PLANTS
@pytest.mark.parametrize("guide", [True, False])
def test_in_impedance_walls_push_back_instead_of_a_fault_when_the_guide_is_on(make_hand, plant, guide) -> None:
    hand = make_hand(plant=plant)
    assert hand.ask(hand.box(0.04)) == 0
    assert hand.ask(rci.EnableVirtualGuide(guide)) == 0
    assert hand.ask(rci.SetCartesianImpedance((3000.0, 300.0, 3000.0, 100.0, 100.0, 100.0))) == 0
    hand.start(3, 2)
    T = hand.state.T_base_tool_c.matrix
    y = T[1, 3]
    for k in range(1, 3001):
        u = min(1.0, k / 1500.0)
        T[1, 3] = y + 0.08 * u**4 * (35.0 - 84.0 * u + 70.0 * u * u - 20.0 * u**3)
        if hand.pose(T).faults:
            break
    if guide:
        assert hand.state.faults == ()
        off = hand.state.T_base_tool.matrix[1, 3] - y
        assert 0.045 < off < 0.055  # Two springs of 300 N/m, one from 0.08, one from 0.02.
    else:
        assert hand.state.faults == (Fault.COMMAND_CARTESIAN_POSITION_LIMITS_VIOLATION,)


@pytest.mark.parametrize("kind", [rci.SafetyStop.ESTOP, rci.SafetyStop.GSTOP])
def test_both_safety_inputs_stop_a_moving_arm_and_say_which(hand, kind) -> None:
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    hand.cycle.press_safety_stop(kind)
    assert hand.step().faults == (Fault.INSTABILITY_DETECTION,)
    assert ("gate" in hand.cycle.reason) is (kind is rci.SafetyStop.GSTOP)
    assert hand.ask(rci.StopMove()) == 0
    hand.assert_smooth()
    assert hand.ask(rci.GetSafetyStopState()) == rci.SafetyStopResponse(kind)
    assert hand.ask(rci.AutomaticErrorRecovery()) is rci.RecoveryStatus.USER_STOP
    assert hand.ask(rci.StartMove(0, 1)) is rci.StartStatus.USER_STOP
    hand.cycle.press_safety_stop(rci.SafetyStop.NONE)
    hand.start()
    assert hand.state.faults == ()


def test_inputs_are_set_from_outside_and_survive_a_reboot(hand) -> None:
    hand.cycle.set_input(3, True)
    assert hand.ask(rci.RebootRobot()) == 0
    levels = [hand.cycle.handle(rci.GetDIState(signal)).response.level for signal in range(6)]
    assert levels == [False, False, False, True, False, False]
    with pytest.raises(InvalidValueError, match="digital input"):
        hand.cycle.set_input(6, True)


def test_with_loop_back_outputs_are_inputs(hand) -> None:
    hand.ask(rci.SetDO(1, True))
    hand.cycle.loop_back = True
    hand.ask(rci.SetDO(4, True))
    levels = [hand.cycle.handle(rci.GetDIState(signal)).response.level for signal in range(6)]
    assert levels == [False, True, False, False, True, False]
    hand.cycle.loop_back = False
    hand.ask(rci.SetDO(4, False))
    assert hand.cycle.handle(rci.GetDIState(4)).response.level
