"""The virtual arm on its own: commands in, violations out, no maker's packets or faults."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.model.robot_model import load_model
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.arm_parameters import ArmParameters
from rcilab.sim.generators.motion_limits import CommandKind, MotionMode
from rcilab.sim.plants import build_plant
from rcilab.sim.streamed_motion import LATE_TOLERANCE
from rcilab.sim.violations import ArmCondition, ArmViolation, describe_violations
from rcilab.sim.virtual_arm import VirtualArm

MODEL = load_model("xMatePro7")
HOME = tuple(MODEL.home.tolist())


def parameters() -> ArmParameters:
    joint, cartesian = MODEL.limits.joint, MODEL.limits.cartesian
    return ArmParameters(
        joint_lower=tuple(joint.lower.tolist()),
        joint_upper=tuple(joint.upper.tolist()),
        collision_thresholds=tuple(joint.collision_threshold.tolist()),
        joint_stiffness=tuple(joint.stiffness.tolist()),
        cartesian_stiffness=(cartesian.translation_stiffness,) * 3 + (cartesian.rotation_stiffness,) * 3,
    )


@pytest.fixture(params=["ideal", "mujoco"])
def arm(request) -> VirtualArm:
    """Under power, following joint angles from the next cycle on."""
    arm = VirtualArm(MODEL, build_plant(request.param, MODEL), parameters(), prefill=0, lost_limit=10)
    arm.resting_law = ControlLaw.POSITION
    arm.step()
    arm.prepare_motion(MotionMode(ControlLaw.POSITION, CommandKind.JOINT_ANGLES))
    arm.begin_motion(MODEL.limits)
    arm.is_monitored = True
    return arm


@pytest.mark.parametrize(("prefill", "warned"), [(10, []), (50, ["50 ms"])])
def test_a_long_delay_of_torques_is_a_warning(prefill: int, warned: list[str]) -> None:
    arm = VirtualArm(MODEL, build_plant("ideal", MODEL), parameters(), torque_prefill=prefill)
    arm.prepare_motion(MotionMode(ControlLaw.TORQUE, CommandKind.TORQUES))
    arm.begin_motion(MODEL.limits)
    assert [warning[12:17] for warning in arm.warnings] == warned


def moved(joint: int, angle: float) -> tuple[float, ...]:
    return (*HOME[: joint - 1], HOME[joint - 1] + angle, *HOME[joint:])


def test_commands_are_followed_one_a_cycle(arm: VirtualArm) -> None:
    for k in range(200):
        angle = 0.01 * (1.0 - np.cos(np.pi * k / 200.0)) / 2.0
        assert arm.step(ArmCommand(k, moved(2, angle))) == ((), ())
        assert arm.signals.commanded.q == pytest.approx(moved(2, angle), abs=1e-12)
    assert arm.measured_state.measured.q == pytest.approx(moved(2, 0.01), abs=1e-3)


def test_a_jump_is_a_violation_that_is_not_followed_and_the_arm_stops_and_brakes(arm: VirtualArm) -> None:
    arm.step(ArmCommand(0, HOME))
    result = arm.step(ArmCommand(1, moved(3, 0.1)))
    assert result.measured_violations == ()
    ids = {v.condition.id for v in result.command_violations if isinstance(v, LimitViolation)}
    assert "joint.velocity" in ids
    assert "joint 3" in describe_violations(result.command_violations)
    assert arm.commanded.q == pytest.approx(HOME, abs=1e-9)
    assert not arm.is_following
    for _ in range(400):
        assert arm.step() == ((), ())
    assert arm.is_standstill
    assert arm.can_engage_brakes


def test_an_angle_that_is_not_finite_is_a_condition_of_the_arm(arm: VirtualArm) -> None:
    arm.step(ArmCommand(0, HOME))
    (violation,) = arm.step(ArmCommand(1, moved(1, float("nan")))).command_violations
    assert isinstance(violation, ArmViolation)
    assert violation.condition is ArmCondition.FINITE_ANGLES


def test_commands_that_do_not_come_end_the_motion(arm: VirtualArm) -> None:
    arm.step(ArmCommand(0, HOME))
    results = [arm.step().command_violations for _ in range(LATE_TOLERANCE + 10)]
    assert results[:-1] == [()] * (LATE_TOLERANCE + 9)
    assert [violation.condition for violation in results[-1]] == [ArmCondition.COMMANDS_ARRIVE]
    assert not arm.receive(ArmCommand(1, HOME))


def test_a_push_beyond_the_threshold_is_a_measured_violation(arm: VirtualArm) -> None:
    arm.step(ArmCommand(0, HOME))
    for k in range(1, 400):
        arm.plant.push((0.0, 0.0, -1.0 * k, 0.0, 0.0, 0.0))
        result = arm.step(ArmCommand(k, HOME))
        if result.measured_violations:
            break
    assert ArmCondition.NO_COLLISION in {violation.condition for violation in result.measured_violations}
    assert result.command_violations == ()


def test_a_motion_is_checked_against_the_limits_it_begins_with(arm: VirtualArm) -> None:
    unchecked = np.full(MODEL.n, np.inf)
    joint = replace(MODEL.limits.joint, acceleration=unchecked, jerk=unchecked)
    arm.is_monitored = False  # The measured acceleration is not what this is about.
    arm.begin_motion(replace(MODEL.limits, joint=joint))
    for k in range(20):  # From standstill to 0.5 rad/s in one cycle.
        assert arm.step(ArmCommand(k, moved(1, 5e-4 * k))) == ((), ())
    assert arm.step(ArmCommand(20, moved(1, 0.1))).command_violations  # The velocity is still checked.
