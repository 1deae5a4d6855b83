from __future__ import annotations

from dataclasses import replace

import pytest

from rcilab.model.robot_model import load_model
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.contact_detector import ContactDetector, ContactThresholds, find_contacts
from rcilab.sim.generators.motion_limits import CommandKind, MotionMode
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

THRESHOLDS = ContactThresholds(
    contact_torque=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0),
    collision_torque=(10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0),
    contact_torque_accelerating=(5.0,) * 7,
    collision_torque_accelerating=(100.0,) * 7,
    contact_force=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
    collision_force=(10.0, 20.0, 30.0, 40.0, 50.0, 60.0),
    contact_force_accelerating=(5.0,) * 6,
    collision_force_accelerating=(100.0,) * 6,
)
NO_TORQUE, NO_FORCE = (0.0,) * 7, (0.0,) * 6


def only(values: tuple[float, ...], place: int, value: float) -> tuple[float, ...]:
    return (*values[:place], value, *values[place + 1 :])


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_each_joint_has_its_own_thresholds_for_both_directions(joint: int, sign: float) -> None:
    expected = tuple(number == joint for number in range(7))
    lower, upper = THRESHOLDS.contact_torque[joint], THRESHOLDS.collision_torque[joint]
    for torque, contact, collision in ((lower, False, False), (upper, True, False), (1.01 * upper, True, True)):
        tau = only(NO_TORQUE, joint, sign * torque)
        found = find_contacts(THRESHOLDS, tau, NO_FORCE, is_accelerating=False)
        assert found.joint_contact == (expected if contact else (False,) * 7)
        assert found.joint_collision == (expected if collision else (False,) * 7)
        assert not any(found.cartesian_contact + found.cartesian_collision)


@pytest.mark.parametrize("axis", range(6))
def test_each_axis_of_the_wrench_has_its_own_thresholds(axis: int) -> None:
    expected = tuple(number == axis for number in range(6))
    wrench = only(NO_FORCE, axis, -1.01 * THRESHOLDS.collision_force[axis])
    found = find_contacts(THRESHOLDS, NO_TORQUE, wrench, is_accelerating=False)
    assert (found.cartesian_contact, found.cartesian_collision) == (expected, expected)
    assert not any(found.joint_contact + found.joint_collision)


def test_other_thresholds_apply_while_the_arm_accelerates() -> None:
    tau, wrench = only(NO_TORQUE, 0, 99.0), only(NO_FORCE, 2, 6.0)
    found = find_contacts(THRESHOLDS, tau, wrench, is_accelerating=True)
    assert (found.joint_contact[0], found.joint_collision[0]) == (True, False)
    assert found.cartesian_contact == (False, False, True, False, False, False)
    found = find_contacts(THRESHOLDS, tau, wrench, is_accelerating=False)
    assert (found.joint_contact[0], found.joint_collision[0]) == (True, True)


def test_a_contact_disappears_and_a_collision_stays_until_the_reset() -> None:
    detector = ContactDetector(THRESHOLDS)
    detector.step(only(NO_TORQUE, 3, 45.0), only(NO_FORCE, 1, 25.0), is_accelerating=False)
    assert detector.shown == detector.present
    assert (detector.present.joint_collision[3], detector.present.cartesian_collision[1]) == (True, True)
    detector.step(NO_TORQUE, NO_FORCE, is_accelerating=False)
    assert not any(map(any, detector.present))
    assert (any(detector.shown.joint_contact), any(detector.shown.cartesian_contact)) == (False, False)
    assert (detector.shown.joint_collision[3], detector.shown.cartesian_collision[1]) == (True, True)
    detector.reset()
    assert not any(map(any, detector.shown))


def test_other_thresholds_apply_from_the_next_cycle_on() -> None:
    detector = ContactDetector(THRESHOLDS)
    detector.configure(replace(THRESHOLDS, collision_torque=(0.5,) * 7))
    detector.step(only(NO_TORQUE, 0, 0.6), NO_FORCE, is_accelerating=False)
    assert detector.present.joint_collision[0]


def test_a_motion_accelerates_only_where_its_velocity_changes() -> None:
    model = load_model("xMatePro7")
    arm = VirtualArm(model, build_plant("ideal", model), prefill=0)
    arm.resting_law = ControlLaw.POSITION
    arm.step()
    arm.prepare_motion(MotionMode(ControlLaw.POSITION, CommandKind.JOINT_VELOCITIES))
    arm.begin_motion(model.limits)
    phases = []
    for k in range(300):
        speed = 1e-3 * min(k, 100, 299 - k)
        arm.step(ArmCommand(k, dq=(0.0, speed, *(0.0,) * 5)))
        phases.append(arm.commanded.is_accelerating)
    assert phases[1:101] == [True] * 100
    assert phases[102:199] == [False] * 97  # Angles of 1 rad have the rounding of an acceleration of 1e-9 rad/s^2.
    assert phases[200:300] == [True] * 100
