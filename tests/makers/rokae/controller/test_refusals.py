"""The line that the controller's terminal has for a refused request: what stopped the arm, by its own name."""

from __future__ import annotations

import re

import numpy as np
import pytest

from rcilab.core.spatial import Pose
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.rokae.controller.state_machine import TABLE, Phase
from rcilab.makers.rokae.robots import ROBOTS


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
    assert refusal(hand, rci.SetMotorPower(2)).startswith("refused SetMotorPower (invalid argument): power 2")
    assert refusal(hand, load).endswith("the arm is guided by hand")


FRAME = Pose().as_row_major()
VALID: tuple[rci.Request, ...] = (
    rci.Connect(5000),
    rci.SetMotorPower(1),
    rci.StartMove(0, 1),
    rci.StartMove(1, 2),
    rci.StopMove(),
    rci.SetCartesianLimit((1.0,) * 3, FRAME),
    rci.SetJointLimit((1.0,) * 7, (-1.0,) * 7),
    rci.SetCollisionBehavior((10.0,) * 7),
    rci.SetJointImpedance((100.0,) * 7),
    rci.SetCartesianImpedance((100.0,) * 6),
    rci.SetCoor(FRAME),
    rci.SetLoad(1.0, (0.0,) * 3, (0.0,) * 9),
    rci.SetCartImpDesiredTau((1.0,) * 6),
    rci.SetFilters(10.0, 20.0, 30.0),
    rci.SetTorqueFilterCutOffFrequency(10.0),
    rci.AutomaticErrorRecovery(),
    rci.SetFcCoor(FRAME, 1),
    rci.EnableVirtualGuide(True),
    rci.SetDO(3, True),
    rci.StartDrag(1, 2),
    rci.StopDrag(),
    rci.RebootRobot(),
)
INVALID: tuple[rci.Request, ...] = (
    rci.Connect(9),
    rci.SetMotorPower(7),
    rci.StartMove(7, 1),
    rci.StartMove(0, 9),
    rci.StartMove(0, 2),
    rci.SetCartesianLimit((-1.0,) * 3, FRAME),
    rci.SetJointLimit((9.0,) * 7, (-1.0,) * 7),
    rci.SetCollisionBehavior((1e3,) * 7),
    rci.SetJointImpedance((-1.0,) * 7),
    rci.SetCartesianImpedance((float("nan"),) * 6),
    rci.SetCoor((0.0,) * 16),
    rci.SetLoad(99.0, (0.0,) * 3, (0.0,) * 9),
    rci.SetCartImpDesiredTau((1e3,) * 6),
    rci.SetFilters(0.0, 20.0, 30.0),
    rci.SetTorqueFilterCutOffFrequency(2e3),
    rci.SetFcCoor(FRAME, 9),
    rci.SetDO(9, True),
    rci.GetDIState(9),
    rci.StartDrag(9, 2),
    rci.StartDrag(1, 9),
)
TESTED = {request.code for request in VALID}
REFUSING = {code for (_, code), cell in TABLE.items() if isinstance(code, rci.CommandCode) and cell.status}
REASON = re.compile(r"refused [A-Z]\w+ \([a-z ]+\): \w[^\n]* [^\n]*\w\S*")


def in_phase(hand, phase: Phase) -> RciController:
    """Leads a controller into a phase."""
    cycle = hand.cycle
    if phase is Phase.OFF:
        return cycle
    if phase is Phase.USER_STOPPED:
        cycle.press_safety_stop(rci.SafetyStop.ESTOP)
        return cycle
    if phase is Phase.CUT_OFF:
        hand.ask(rci.SetJointLimit(tuple(hand.model.home + 0.1), tuple(hand.model.home - 0.1)))
        hand.start()
        hand.play(hand.swing(1, 1.5, 0.4))
        hand.rest()
        return cycle
    hand.ask(rci.SetMotorPower(1))
    if phase is Phase.GUIDING:
        hand.ask(rci.StartDrag(1, 2))
    elif phase is not Phase.IDLE:
        cycle.handle(rci.StartMove(0, 1))
        if phase is not Phase.STARTING:
            hand.step(5)
        if phase is Phase.STOPPING:
            hand.play(hand.swing(1, 1.0, 0.4)[:200])
            cycle.handle(rci.StopMove())
        if phase in (Phase.REFLEX, Phase.RECOVERING):
            hand.command(hand.state.q_c + 0.1)
            hand.rest()
        if phase is Phase.RECOVERING:
            cycle.handle(rci.AutomaticErrorRecovery())
    return cycle


@pytest.mark.parametrize("phase", Phase, ids=lambda phase: phase.name)
def test_every_refusal_in_every_phase_has_a_reason_that_names_something(make_hand, phase: Phase) -> None:
    assert REFUSING <= TESTED
    for request in (*VALID, *INVALID):
        cycle = in_phase(make_hand(), phase)
        assert cycle.phase is phase
        reply = cycle.handle(request)
        status = getattr(reply.response, "status", 0)
        assert bool(status) == bool(reply.refusal), (request, status)
        if status:
            assert REASON.fullmatch(reply.refusal), reply.refusal
            assert reply.refusal.startswith(f"refused {type(request).__name__} (")
            assert not re.search(r"None|: the robot is idle|a value does not exist|<", reply.refusal), reply.refusal


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("mode", [1, 3], ids=["position", "impedance"])
def test_a_singular_start_names_the_joint_on_every_arm(make_hand, name: str, mode: int) -> None:
    hand = make_hand(name)
    hand.cycle.reset(np.zeros(hand.model.n))
    hand.ask(rci.SetMotorPower(1))
    said = refusal(hand, rci.StartMove(mode, 2))
    assert re.fullmatch(r"refused StartMove \(singular start pose\): .*joint \d is at 0\.00 deg", said)
