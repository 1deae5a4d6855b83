"""What a client may command: velocities of joints and tool, goals, torques beside a motion; and where it may begin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from rcilab.conformance.limit_violation import LimitViolation
from rcilab.core.spatial import rotation_between
from rcilab.model.robot_model import load_model
from rcilab.sim.actuator import ControlLaw
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.filters import low_pass_gain
from rcilab.sim.generators.motion_limits import CommandKind, MotionMode
from rcilab.sim.generators.start import StartTolerance
from rcilab.sim.plants import build_plant
from rcilab.sim.violations import ArmCondition, Violations
from rcilab.sim.virtual_arm import VirtualArm

MODEL = load_model("xMatePro7")
HOME = tuple(MODEL.home.tolist())
START = MODEL.forward(MODEL.home)
PSI = MODEL.arm_angle(MODEL.home)
STRICT = StartTolerance((1e-6,) * 7, translation=1e-6, rotation=1e-6, arm_angle=1e-6)
ZERO = (0.0,) * 7


def following(
    kind: CommandKind,
    law: ControlLaw = ControlLaw.POSITION,
    *,
    start: StartTolerance | None = None,
    goal_velocity: Sequence[float] = (),
    **parameters: float,
) -> VirtualArm:
    """Returns an arm that follows commands of this kind from the next cycle on."""
    arm = VirtualArm(MODEL, build_plant("ideal", MODEL), prefill=0, lost_limit=20)
    arm.configure(replace(arm.parameters, **parameters))  # type: ignore[arg-type]
    arm.resting_law = ControlLaw.POSITION
    arm.step()
    arm.prepare_motion(MotionMode(law, kind, goal_velocity=tuple(goal_velocity)))
    arm.begin_motion(MODEL.limits, start=start)
    arm.is_monitored = law is ControlLaw.POSITION
    return arm


def swell(k: int, cycles: int = 400) -> float:
    """Returns a smooth rise from 0 to 1 and back, over a number of cycles."""
    return (1.0 - math.cos(2.0 * math.pi * k / cycles)) / 2.0


def conditions(violations: Violations) -> set[object]:
    return {v.condition.id if isinstance(v, LimitViolation) else v.condition for v in violations}


def moved(joint: int, angle: float) -> tuple[float, ...]:
    return (*HOME[: joint - 1], HOME[joint - 1] + angle, *HOME[joint:])


def speed_of(joint: int, speed: float) -> tuple[float, ...]:
    return (*ZERO[: joint - 1], speed, *ZERO[joint:])


def pose_at(offset: float) -> tuple[float, ...]:
    matrix = START.matrix.copy()
    matrix[1, 3] += offset
    return tuple(matrix.ravel().tolist())


# Joint velocities


def test_the_integral_of_joint_velocities_is_the_reference() -> None:
    arm = following(CommandKind.JOINT_VELOCITIES)
    for k in range(400):
        assert arm.step(ArmCommand(k, dq=speed_of(2, 0.3 * swell(k)))) == ((), ())
        assert arm.commanded.dq[1] == pytest.approx(0.3 * swell(k), abs=1e-9)
    assert arm.commanded.q == pytest.approx(moved(2, 0.3 * 0.2), abs=1e-9)


def test_a_step_of_joint_velocity_is_a_violation_of_the_acceleration() -> None:
    arm = following(CommandKind.JOINT_VELOCITIES)
    arm.step(ArmCommand(0, dq=ZERO))
    violations = arm.step(ArmCommand(1, dq=speed_of(3, 0.5))).command_violations
    assert conditions(violations) == {"joint.acceleration", "joint.jerk"}


@pytest.mark.parametrize(("kind", "field"), [(CommandKind.JOINT_VELOCITIES, "dq"), (CommandKind.TWISTS, "twist")])
def test_velocities_that_are_missing_continue_with_the_same_acceleration(kind, field) -> None:
    arm = following(kind)
    arm.is_monitored = False
    n = 7 if field == "dq" else 6
    speeds = []
    for k in range(100):
        speed = 1e-5 * k * (k + 1)  # [rad/s] or [m/s]
        lost = 60 <= k < 65
        result = arm.step(None if lost else ArmCommand(k, **{field: (speed, *(0.0,) * (n - 1))}))
        assert result.command_violations == ()
        if not 60 <= k < 66:
            continue
        speeds.append(arm.commanded.dq[0] if field == "dq" else arm.tool_c.twist[0])
    steps = np.diff(speeds[:5])
    assert steps == pytest.approx(steps[0], rel=1e-3)  # Not held, though that is what this arm does with angles.
    assert steps[0] == pytest.approx(1e-5 * 2 * 59, rel=2e-2)
    assert arm.playout.lost == 5


@pytest.mark.parametrize("kind", [CommandKind.JOINT_VELOCITIES, CommandKind.TWISTS])
def test_velocities_pass_their_filter(kind: CommandKind) -> None:
    arm = following(kind, velocity_filter=10.0, twist_filter=10.0)
    gain, expected = low_pass_gain(10.0), 0.0
    for k in range(50):
        speed = 1e-5 * k * k
        expected += gain * (speed - expected)
        command = ArmCommand(k, dq=speed_of(1, speed), twist=(speed, *(0.0,) * 5))
        assert arm.step(command).command_violations == ()
    found = arm.commanded.dq[0] if kind is CommandKind.JOINT_VELOCITIES else arm.tool_c.twist[0]
    assert found == pytest.approx(expected, rel=1e-2)
    assert expected < 0.8 * speed


def test_twenty_lost_velocities_end_the_motion() -> None:
    arm = following(CommandKind.JOINT_VELOCITIES)
    arm.step(ArmCommand(0, dq=ZERO))
    results = [conditions(arm.step().command_violations) for _ in range(20)]
    assert results == [set()] * 19 + [{ArmCondition.COMMANDS_ARRIVE}]


def test_a_velocity_that_is_not_finite_is_a_condition_of_the_arm() -> None:
    arm = following(CommandKind.JOINT_VELOCITIES)
    result = arm.step(ArmCommand(0, dq=speed_of(1, math.nan)))
    assert conditions(result.command_violations) == {ArmCondition.FINITE_VELOCITIES}


# Twists


def test_the_integral_of_twists_is_the_path_of_the_tool_and_their_values_are_its_velocity() -> None:
    arm = following(CommandKind.TWISTS)
    twist = np.array([0.05, -0.02, 0.03, 0.0, 0.1, 0.2])
    for k in range(400):
        assert arm.step(ArmCommand(k, twist=tuple(swell(k) * twist))) == ((), ())
        assert arm.tool_c.twist == pytest.approx(swell(k) * twist, abs=1e-3)  # Jacobian here, difference there.
    (rotation, position), end = START.parts, MODEL.forward(arm.commanded.q)
    assert end.parts[1] == pytest.approx(np.array(position) + 0.2 * twist[:3], abs=1e-8)
    assert rotation_between(rotation, end.parts[0]) == pytest.approx(0.2 * twist[3:], abs=1e-8)
    assert MODEL.arm_angle(arm.commanded.q) == pytest.approx(PSI, abs=1e-8)


def test_twists_may_come_with_an_arm_angle() -> None:
    arm = following(CommandKind.TWISTS)
    for k in range(400):
        psi = PSI + 0.1 * (k - 400 / (2 * math.pi) * math.sin(2 * math.pi * k / 400)) / 400
        assert arm.step(ArmCommand(k, twist=(0.0,) * 6, has_psi=True, psi=psi)) == ((), ())
    assert MODEL.arm_angle(arm.commanded.q) == pytest.approx(PSI + 0.1, abs=1e-4)
    assert MODEL.forward(arm.commanded.q).is_close(START, 1e-9)


def test_a_step_of_the_tools_velocity_is_a_violation_of_its_acceleration() -> None:
    arm = following(CommandKind.TWISTS)
    arm.step(ArmCommand(0, twist=(0.0,) * 6))
    violations = arm.step(ArmCommand(1, twist=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0))).command_violations
    assert conditions(violations) == {"cartesian.acceleration.translation", "cartesian.jerk.translation"}


@pytest.mark.parametrize("number", [math.nan, math.inf, 1e308])
def test_a_twist_without_a_pose_is_not_followed(number: float) -> None:
    arm = following(CommandKind.TWISTS)
    assert arm.step(ArmCommand(0, twist=(0.0, 0.0, 0.0, number, 0.0, number))).command_violations
    assert arm.commanded.q == pytest.approx(HOME, abs=0.0)


@pytest.mark.parametrize("kind", [CommandKind.POSES, CommandKind.TWISTS])
@pytest.mark.parametrize("psi", [math.nan, math.inf, 1e308, 4.0])
def test_an_arm_angle_beyond_a_turn_is_a_violation_also_after_lost_commands(kind: CommandKind, psi: float) -> None:
    arm = following(kind)
    arm.step(ArmCommand(0, (), pose_at(0.0), twist=(0.0,) * 6))
    command = ArmCommand(4, (), pose_at(0.0), has_psi=True, psi=psi, twist=(0.0,) * 6)
    assert conditions(arm.step(command).command_violations) == {ArmCondition.ARM_ANGLE_RANGE}


# Goals


def test_the_arm_moves_to_a_goal_within_its_velocities_and_limits() -> None:
    arm = following(CommandKind.JOINT_GOALS, goal_velocity=(0.3,) * 7)
    goal = tuple(MODEL.home + 0.2)
    results = [arm.step(ArmCommand(0, goal)), *(arm.step() for _ in range(1500))]
    assert set(results) == {((), ())}
    assert arm.commanded.q == pytest.approx(goal, abs=1e-9)
    assert arm.commanded.is_stationary
    assert (arm.playout.lost, arm.playout.success_rate, arm.is_following) == (0, 1.0, True)


def test_a_goal_may_change_at_any_time_and_needs_no_start_at_the_arm() -> None:
    arm = following(CommandKind.JOINT_GOALS, start=STRICT, goal_velocity=(0.3,) * 7)
    speeds = []
    for k in range(1000):  # A goal every 50 cycles, with the number of the state that the client has read.
        sign = 1.0 if k < 300 else -1.0
        command = ArmCommand(k, moved(1, 0.25 * sign)) if k % 50 == 0 else None
        assert arm.step(command) == ((), ())
        speeds.append(arm.commanded.dq[0])
        assert not arm.playout.is_starved
    assert (max(speeds), min(speeds)) == pytest.approx((0.3, -0.3), rel=1e-6)
    assert arm.playout.lost == 0


def test_the_end_of_goals_stops_the_arm_where_it_is_whatever_the_last_command_holds() -> None:
    arm = following(CommandKind.JOINT_GOALS, goal_velocity=(0.3,) * 7)
    arm.step(ArmCommand(0, moved(1, 0.5)))
    for _ in range(400):
        arm.step()
    before = arm.commanded.q[0]
    assert arm.step(ArmCommand(401, ZERO, finished=True)) == ((), ())
    for _ in range(300):
        assert arm.step() == ((), ())
    assert arm.commanded.is_stationary
    assert 0.0 < arm.commanded.q[0] - before < 0.02


def test_a_goal_outside_the_range_is_a_violation_before_anything_moves() -> None:
    arm = following(CommandKind.JOINT_GOALS, goal_velocity=(0.3,) * 7)
    violations = arm.step(ArmCommand(0, moved(2, 9.0))).command_violations
    assert conditions(violations) == {"joint.position"}
    assert arm.commanded.q == list(HOME)


# Torques beside a motion


def test_torques_drive_the_arm_and_the_motion_beside_them_is_the_reference() -> None:
    arm = following(CommandKind.JOINT_VELOCITIES, ControlLaw.TORQUE)
    for k in range(400):
        command = ArmCommand(k, dq=speed_of(2, 0.1 * swell(k)), tau=speed_of(7, 0.05 * swell(k)))
        assert arm.step(command) == ((), ())
        assert arm.signals.tau_c == list(command.tau)
    assert arm.commanded.q == pytest.approx(moved(2, 0.02), abs=1e-9)
    measured = arm.measured_state.measured.q - MODEL.home
    assert abs(measured[1]) < 1e-3
    assert measured[6] > 1e-3


@pytest.mark.parametrize(
    ("dq", "tau", "expected"),
    [
        (speed_of(1, 1.0), ZERO, {"joint.acceleration", "joint.jerk"}),
        (ZERO, speed_of(1, 80.0), {"torque.rate"}),
        (speed_of(1, 1.0), speed_of(1, 80.0), {"joint.acceleration", "joint.jerk", "torque.rate"}),
    ],
)
def test_both_are_checked_and_the_arm_stops_from_where_it_is(dq, tau, expected) -> None:
    arm = following(CommandKind.JOINT_VELOCITIES, ControlLaw.TORQUE)
    for k in range(100):
        arm.step(ArmCommand(k, dq=ZERO, tau=speed_of(7, 0.001 * k)))
    q = arm.measured_state.measured.q[6]
    assert conditions(arm.step(ArmCommand(100, dq=dq, tau=tau)).command_violations) == expected
    assert not arm.is_following
    assert arm.commanded.q[6] == pytest.approx(q, abs=5e-3)  # Moved on in that cycle.
    assert arm.commanded.q[6] != HOME[6]


def test_without_torques_their_last_ones_are_held_and_the_motion_is_bridged() -> None:
    arm = following(CommandKind.JOINT_VELOCITIES, ControlLaw.TORQUE)
    for k in range(50):
        arm.step(ArmCommand(k, dq=speed_of(2, 1e-4 * k), tau=speed_of(7, 0.001 * k)))
    arm.step()
    assert arm.signals.tau_c == pytest.approx(speed_of(7, 0.049))
    assert arm.commanded.dq[1] == pytest.approx(1e-4 * 50, abs=1e-9)


@pytest.mark.parametrize("torque", [1e308, 1e9, 100.0])
def test_a_torque_beyond_its_limits_is_not_approached_in_the_cycles_before_it(torque: float) -> None:
    arm = following(CommandKind.TORQUES, ControlLaw.TORQUE)
    for k in range(10):
        arm.step(ArmCommand(k, tau=speed_of(7, 0.1 * k)))
    violations = arm.step(ArmCommand(12, tau=speed_of(7, torque))).command_violations
    assert "torque.rate" in conditions(violations)
    assert arm.signals.tau_c is None
    assert abs(arm.measured_state.measured.dq[6]) < 10.0


# Start


@pytest.mark.parametrize("offset", [1.1e-6, 4e-6, 1e-3, 0.5])
@pytest.mark.parametrize("kind", [CommandKind.JOINT_ANGLES, CommandKind.POSES])
def test_a_start_outside_the_makers_tolerance_is_the_only_violation(kind, offset) -> None:
    arm = following(kind, start=STRICT)
    command = ArmCommand(0, moved(2, offset), pose_at(offset))
    violations = arm.step(command).command_violations
    assert [v.condition for v in violations] == [ArmCondition.START_TOLERANCE]
    assert not arm.is_following


@pytest.mark.parametrize("kind", [CommandKind.POSES, CommandKind.TWISTS])
def test_an_arm_angle_outside_the_makers_tolerance_has_its_own_condition(kind) -> None:
    arm = following(kind, start=STRICT)
    command = ArmCommand(0, (), pose_at(0.0), has_psi=True, psi=PSI + 1e-3, twist=(0.0,) * 6)
    violations = arm.step(command).command_violations
    assert [v.condition for v in violations] == [ArmCondition.START_ARM_ANGLE]


@pytest.mark.parametrize("kind", [CommandKind.JOINT_ANGLES, CommandKind.POSES])
def test_a_start_inside_the_makers_tolerance_moves_on(kind) -> None:
    arm = following(kind, start=STRICT)
    for k in range(20):
        assert arm.step(ArmCommand(k, moved(2, 0.9e-6), pose_at(0.9e-6))) == ((), ())


def test_without_one_a_jump_violates_limits_and_is_named_first() -> None:
    arm = following(CommandKind.JOINT_ANGLES)
    violations = arm.step(ArmCommand(0, moved(2, 0.5))).command_violations
    assert violations[0].condition is ArmCondition.START_TOLERANCE
    assert "joint.velocity" in conditions(violations)
