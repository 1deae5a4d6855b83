"""The line that the controller's terminal has for a refused request: what stopped the arm, by its own name."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.makers.rokae import wire as rci


def refusal(hand, request: rci.Request) -> str:
    return hand.cycle.handle(request).refusal


@pytest.mark.parametrize(
    ("button", "named"),
    [(rci.SafetyStop.ESTOP, "an emergency stop is pressed"), (rci.SafetyStop.GSTOP, "the safety gate is open")],
)
def test_under_a_safety_stop_the_button_is_named(make_hand, button, named) -> None:
    hand = make_hand()
    hand.ask(rci.SetMotorPower(1))
    hand.cycle.press_safety_stop(button)
    assert refusal(hand, rci.StartMove(0, 1)) == f"refused StartMove (user stop): {named}"
    assert refusal(hand, rci.SetMotorPower(1)) == f"refused SetMotorPower (not possible): {named}"
    assert refusal(hand, rci.SetCoor(Pose().as_row_major())) == f"refused SetCoor (not possible): {named}"
    assert refusal(hand, rci.AutomaticErrorRecovery()) == f"refused AutomaticErrorRecovery (user stop): {named}"


def test_after_a_fault_it_is_named(make_hand) -> None:
    hand = make_hand()
    hand.start()
    hand.command(hand.state.q_c + 0.1)
    hand.rest()
    named = "refused StartMove (reflex): the arm was stopped by kCommandJointVelocityLimitsViolation, "
    assert refusal(hand, rci.StartMove(0, 1)).startswith(named)


def test_beyond_a_joint_s_range_the_joint_and_the_lost_power_are_named(make_hand) -> None:
    hand = make_hand()
    hand.ask(rci.SetJointLimit(tuple(hand.model.home + 0.1), tuple(hand.model.home - 0.1)))
    hand.start()
    hand.play(hand.swing(1, 1.5, 0.4))
    hand.rest()
    power = "the motors were switched off by kCommandJointPositionLimitsViolation"
    assert power in refusal(hand, rci.SetMotorPower(1))
    reached = f"joint 1 is at {np.degrees(hand.state.q[0]):.2f} deg, beyond -5.73 to 5.73 deg"
    assert reached in refusal(hand, rci.AutomaticErrorRecovery())


def test_outside_the_safety_box_the_distance_is_named(make_hand) -> None:
    hand = make_hand()
    hand.ask(hand.box(0.1))
    hand.start(1, 2)
    hand.shift((0.0, 0.12, 0.0), 0.4)
    hand.rest()
    said = refusal(hand, rci.AutomaticErrorRecovery())
    assert "(manual recovery needed): the tool is " in said
    assert "mm outside the safety box" in said


def test_other_refusals_say_what_the_robot_does(make_hand) -> None:
    hand = make_hand()
    assert refusal(hand, rci.StartMove(0, 1)).endswith("the motors are off")
    hand.start()
    load = rci.SetLoad(1.0, (0.0,) * 3, (0.0,) * 9)
    assert refusal(hand, load).endswith("a motion is in progress")
    hand.play(hand.swing(1, 1.0, 0.4))
    hand.cycle.handle(rci.SetMotorPower(0))
    assert refusal(hand, load).endswith("the arm still moves")
    hand.rest()
    hand.ask(rci.SetMotorPower(1))
    hand.ask(rci.StartDrag(1, 2))
    assert refusal(hand, rci.SetMotorPower(2)).startswith("refused SetMotorPower (invalid argument): a value")
    assert refusal(hand, load).endswith("the arm is guided by hand")
