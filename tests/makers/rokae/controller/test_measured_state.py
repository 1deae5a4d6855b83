"""What the sensors say of a moving arm, and what they make of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rcilab.core.arrays import readonly_copy
from rcilab.core.state import RobotState
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel
from rcilab.sim.api import Push
from rcilab.sim.force_profile import ForceProfile
from rcilab.sim.ideal_plant import IdealPlant
from rcilab.sim.plant import Measurement, Setpoint
from rcilab.sim.virtual_arm import VirtualArm
from tests.makers.rokae.controller.conftest import Hand

F = Fault


class SlippingPlant(IdealPlant):
    """An ideal arm whose sensors read something else."""

    q_off = np.zeros(7)
    dq_off = np.zeros(7)

    def step(self, setpoint: Setpoint) -> Measurement:
        measured = super().step(setpoint)
        if not self.q_off.any() and not self.dq_off.any():
            return measured
        return Measurement(
            readonly_copy(measured.q + self.q_off), readonly_copy(measured.dq + self.dq_off), measured.tau
        )


def slip(joint: int, speed: float) -> Callable[[Hand, SlippingPlant], None]:
    def act(hand: Hand, plant: SlippingPlant) -> None:
        plant.dq_off = np.zeros(7)
        plant.dq_off[joint - 1] = speed

    return act


def creep(joint: int, speed: float) -> Callable[[Hand, SlippingPlant], None]:
    def act(hand: Hand, plant: SlippingPlant) -> None:
        for k in range(400):
            slip(joint, speed * k / 400.0)(hand, plant)
            if hand.command(hand.state.q_c, T_base_tool_c=hand.state.T_base_tool_c.as_row_major()).faults:
                return

    return act


def displace(hand: Hand, plant: SlippingPlant) -> None:
    plant.q_off = np.full(7, 0.13)


def swivel(hand: Hand, plant: SlippingPlant) -> None:
    plant.q_off = np.array((0, 0, 0.02, 0, 0, 0, 0))


JOINT, CARTESIAN = (0, 1), (1, 2)
MEASURED = [
    (CARTESIAN, displace, F.ACTUAL_JOINT_POSITION_LIMITS_VIOLATION),
    (CARTESIAN, displace, F.ACTUAL_CARTESIAN_POSITION_LIMITS_VIOLATION),
    (CARTESIAN, swivel, F.ACTUAL_CARTESIAN_MOTION_GENERATOR_ELBOW_LIMIT_VIOLATION),
    (JOINT, creep(7, 2.95), F.ACTUAL_JOINT_VELOCITY_LIMITS_VIOLATION),
    (CARTESIAN, creep(1, 2.0), F.ACTUAL_CARTESIAN_VELOCITY_LIMITS_VIOLATION),
    (CARTESIAN, slip(3, 0.6), F.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION),
    (CARTESIAN, slip(1, 0.4), F.ACTUAL_CARTESIAN_ACCELERATION_LIMITS_VIOLATION),
]


@pytest.mark.parametrize(("mode", "act", "fault"), MEASURED, ids=lambda value: getattr(value, "name", ""))
def test_what_the_sensors_say_is_judged_in_that_cycle(model: RobotModel, mode, act, fault: Fault) -> None:
    hand = Hand(model)
    plant = SlippingPlant(model)
    hand.cycle = RciController(VirtualArm(model, plant, prefill=0), mode_delay=3)
    hand.states = [hand.cycle.state]
    hand.ask(rci.SetJointLimit(tuple(model.home + 0.1), tuple(model.home - 0.1)))
    hand.ask(hand.box(0.04))
    hand.start(*mode)
    q, T = hand.state.q_c, hand.state.T_base_tool_c.as_row_major()
    for _ in range(5):
        hand.command(q, T_base_tool_c=T)
    before = len(hand.states)
    act(hand, plant)
    for _ in range(8):
        if hand.state.faults:
            break
        hand.command(q, T_base_tool_c=T)
    assert fault in hand.state.faults, (hand.state.faults, hand.cycle.reason)
    assert "measured" in hand.cycle.reason
    assert len(hand.states) > before


def test_a_collision_is_named_by_the_joint_that_is_farthest_beyond_its_threshold(model: RobotModel) -> None:
    watch = Hand(model).cycle.arm.measured_state
    watch.tau_ext = readonly_copy(np.array([0.0, 90.0, 0.0, 0.0, 0.0, -79.4, 0.0]))
    collision = watch.find_collision((75.0, 75.0, 45.0, 45.0, 30.0, 30.0, 20.0))
    assert collision == "joint 6: external torque 79.4 N m is above its threshold 30 N m"
    assert watch.find_collision((0.0, *[100.0] * 6)) is None


def lean(hand: Hand, profile: ForceProfile, cycles: int, hold: Callable[[], RobotState]) -> None:
    """Holds the arm while a force comes and goes."""
    for _ in range(cycles):
        hand.cycle.plant.push(profile.wrench)
        if hold().faults:
            return
        profile.step()


@pytest.mark.parametrize("name", ["xMatePro7", "xMate3"])
@pytest.mark.parametrize("mode", [JOINT, CARTESIAN], ids=["joint", "Cartesian"])
@pytest.mark.parametrize("force", [(60.0, 0.0, 0.0), (0.0, 60.0, 0.0), (0.0, 0.0, -60.0)])
def test_who_leans_on_a_stiff_arm_ends_in_a_collision_or_is_held(make_hand, name, mode, force) -> None:
    hand, profile = make_hand(name, plant="mujoco"), ForceProfile()
    hand.start(*mode)
    q, T = hand.state.q_c, hand.state.T_base_tool_c.as_row_major()
    hold = lambda: hand.command(q, T_base_tool_c=T)  # noqa: E731
    profile.begin(Push((*force, 0.0, 0.0, 0.0)))
    lean(hand, profile, 100, hold)
    profile.release()
    lean(hand, profile, 100, hold)
    assert hand.state.faults == ()
    hand.ask(rci.StopMove())
    hand.ask(rci.SetCollisionBehavior((15.0,) * 7))
    hand.start(*mode)
    profile.begin(Push((*force, 0.0, 0.0, 0.0)))
    lean(hand, profile, 100, hold)
    assert hand.state.faults == (F.COLLISION,)


def test_a_blow_is_too_hard_an_acceleration_before_it_is_a_collision(make_hand) -> None:
    hand, profile = make_hand(plant="mujoco"), ForceProfile()
    hand.start()
    q = hand.state.q_c
    profile.begin(Push((150.0, 0.0, 0.0, 0.0, 0.0, 0.0), rise_time=0.0))
    lean(hand, profile, 100, lambda: hand.command(q))
    assert hand.state.faults == (F.ACTUAL_JOINT_ACCELERATION_LIMITS_VIOLATION,)
