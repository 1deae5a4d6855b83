"""Every mode, command and state of the table, and what a client sees in each."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rcilab.core.clock import CYCLE_TIME
from rcilab.makers.ufactory.bounds import JOINT_ACCELERATION
from rcilab.makers.ufactory.controller.modes import Answer, Command, Mode, State, answer, mode_table
from rcilab.makers.ufactory.wire.frame import STATUS_ERROR, STATUS_INVALID, STATUS_NOT_READY, STATUS_WARNING
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.motion import plan_joint
from rcilab.sim.arm_setup import ArmSetup
from rcilab.sim.controller_config import PlantKind
from tests.makers.ufactory.controller.conftest import ALL, Q6, Arm

AWAY = tuple(angle + 0.3 for angle in Q6)
NOTHING = (0.0,) * 4  # The unused seventh joint, and the unused arguments of servo commands.


def pose_aside(arm: Arm, step: float = 40.0) -> tuple[float, ...]:
    """Returns a pose that is so far from the tool, [mm]."""
    x, y, z, *rpy = arm.pose
    return (x, y + step, z, *rpy)


def send(arm: Arm, command: Command) -> int:
    """Returns the status of a motion command that moves the arm away."""
    match command:
        case Command.JOINTS:
            return arm.move_joints(AWAY)
        case Command.LINE:
            return arm.move_line(pose_aside(arm))
        case Command.CIRCLE:
            x, y, z, *rpy = arm.pose
            values = (x, y + 30.0, z, *rpy, x + 30.0, y, z, *rpy, 100.0, 1000.0, 0.0, 50.0)
            return arm.call(Function.MOVE_CIRCLE, "16f3B", *values, 0, 0, 0)[0]
        case Command.PAUSE:
            return arm.call(Function.SLEEP, "f", 0.2)[0]
        case Command.SERVO_JOINTS:
            return arm.call(Function.SERVO_JOINT, "10f", *Q6[:5], Q6[5] + 0.3, *NOTHING)[0]
        case Command.SERVO_POSE:
            return arm.call(Function.SERVO_CARTESIAN, "9f", *pose_aside(arm, 5.0), 0.0, 0.0, 0.0)[0]
        case Command.JOINT_VELOCITY:
            return arm.call(Function.JOINT_VELOCITY, "7fBf", *(0.2,) * 6, 0.0, 1, 0.0)[0]
        case Command.TOOL_VELOCITY:
            return arm.call(Function.CARTESIAN_VELOCITY, "6fBf", 0.0, 40.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0)[0]


STARTERS = {
    Mode.POSITION: Command.JOINTS,
    Mode.SERVO: Command.SERVO_JOINTS,
    Mode.JOINT_VELOCITY: Command.JOINT_VELOCITY,
    Mode.CARTESIAN_VELOCITY: Command.TOOL_VELOCITY,
    Mode.JOINT_ONLINE: Command.JOINTS,
    Mode.CARTESIAN_ONLINE: Command.LINE,
}


def put(arm: Arm, mode: Mode, state: State) -> bool:
    """Brings an arm into a mode and a state; returns False for a pair that does not exist."""
    arm.ready()
    arm.move_joints(Q6)
    arm.run()
    arm.ready(mode)
    if state in (State.MOVING, State.STOPPING):
        if mode not in STARTERS:
            return False
        assert send(arm, STARTERS[mode]) == 0
        arm.step(30)
        if state is State.STOPPING:
            arm.call(Function.SET_STATE, "B", 6)
    elif state is State.CHANGED:
        arm.call(Function.SET_TEACH_SENSITIVITY, "B", 2)
    elif state is not State.READY:
        arm.call(Function.SET_STATE, "B", state.value)
    return True


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("mode", Mode)
def test_every_command_is_answered_as_in_the_table(arm: Arm, mode: Mode, state: State) -> None:
    for command in Command:
        if not put(arm, mode, state):
            return
        assert arm.state == state, command
        expected = answer(mode, command, state)
        before, queued = arm.q, arm.controller.queued
        status = send(arm, command)
        assert arm.error == (0, 0), command
        assert bool(status & STATUS_NOT_READY) is not expected.is_taken, (command, expected)
        if expected in (Answer.QUEUED, Answer.HELD):
            assert arm.controller.queued == queued + 1
        if state in (State.MOVING, State.STOPPING):
            continue
        arm.step(60)
        moved = float(np.abs(np.subtract(arm.q, before)).max())
        moves = expected in (Answer.QUEUED, Answer.FOLLOWED) and command is not Command.PAUSE
        assert (moved > 1e-5) is moves, (command, expected, moved)


def test_the_printed_table_has_every_cell() -> None:
    lines = list(mode_table())
    assert len([line for line in lines if line]) == 2 + len(Mode) * len(Command) + 2 + 4
    assert "| 6 joint online | joints | followed | followed | not ready | not ready | not ready | not ready |" in lines
    assert "| 1 servo | line | wrong mode | wrong mode | wrong mode | not ready | not ready | not ready |" in lines


def test_an_arm_that_was_switched_on_is_stopped_without_motors() -> None:
    arm = Arm()
    assert arm.state == State.STOPPED
    assert arm.call(Function.SET_STATE, "B", 0)[0] == STATUS_NOT_READY
    assert arm.state == State.STOPPED
    arm.call(Function.MOTION_ENABLE, "2B", ALL, 1)
    assert arm.controller.enabled == 0x3F
    arm.call(Function.SET_STATE, "B", 0)
    assert arm.state == State.READY


@pytest.mark.parametrize("value", [1, 2, 5, 7, 200])
def test_states_that_are_only_reported_cannot_be_set(arm: Arm, value: int) -> None:
    status, _ = arm.call(Function.SET_STATE, "B", value)
    assert status == STATUS_INVALID | STATUS_WARNING
    assert (arm.state, arm.error) == (State.READY, (0, 12))


@pytest.mark.parametrize("number", [3, 8, 11, 255])
def test_modes_that_do_not_exist_are_refused(arm: Arm, number: int) -> None:
    assert arm.call(Function.SET_MODE, "2B", number, 0)[0] == STATUS_INVALID | STATUS_WARNING
    assert arm.controller.mode is Mode.POSITION


def test_another_mode_empties_the_queue_and_needs_state_0(arm: Arm) -> None:
    arm.move_joints(AWAY)
    arm.move_joints(Q6)
    arm.step(100)
    arm.call(Function.SET_MODE, "2B", 1, 0)
    assert arm.state == State.CHANGED
    assert arm.call(Function.SERVO_JOINT, "10f", *AWAY, *NOTHING)[0] == STATUS_NOT_READY
    arm.run()
    assert arm.controller.queued == 0
    arm.call(Function.SET_STATE, "B", 0)
    assert arm.state == State.READY


SETTINGS: dict[Function, tuple[str, tuple[float, ...]]] = {
    Function.SET_LOAD: ("4f", (0.5, 0.0, 0.0, 30.0)),
    Function.SET_TCP_OFFSET: ("6f", (0.0, 0.0, 50.0, 0.0, 0.0, 0.0)),
    Function.SET_WORLD_OFFSET: ("6f", (10.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    Function.SET_COLLISION_SENSITIVITY: ("B", (2,)),
    Function.SET_TEACH_SENSITIVITY: ("B", (2,)),
    Function.SET_GRAVITY_DIRECTION: ("3f", (0.0, 0.0, -1.0)),
}


@pytest.mark.parametrize("function", SETTINGS)
def test_another_setting_stops_the_arm_until_state_0(arm: Arm, function: Function) -> None:
    code, values = SETTINGS[function]
    arm.move_joints(AWAY)
    arm.step(100)
    status, _ = arm.call(function, code, *values)
    assert status == (0 if function is Function.SET_LOAD else STATUS_NOT_READY)
    assert arm.state == State.CHANGED
    arm.run()
    stood = arm.q
    assert np.abs(np.subtract(stood, AWAY)).max() > 0.05
    arm.call(Function.SET_STATE, "B", 0)
    arm.step(100)
    assert arm.q == stood
    assert arm.move_joints(Q6) == 0
    arm.run()
    np.testing.assert_allclose(arm.q, Q6, atol=1e-6)


def test_a_pause_keeps_the_path_and_the_queue(arm: Arm) -> None:
    arm.move_joints(AWAY)
    arm.move_joints(Q6)
    arm.step(150)
    arm.call(Function.SET_STATE, "B", 3)
    assert arm.state == State.PAUSED
    arm.run()
    stood = arm.q
    assert arm.controller.queued == 2
    shares = np.subtract(stood, Q6) / np.subtract(AWAY, Q6)
    np.testing.assert_allclose(shares, shares[0], atol=1e-6)
    arm.move_joints(AWAY)
    arm.step(100)
    assert (arm.q, arm.controller.queued) == (stood, 3)
    arm.call(Function.SET_STATE, "B", 0)
    assert arm.state == State.MOVING
    arm.run()
    np.testing.assert_allclose(arm.q, AWAY, atol=1e-6)


def test_a_stop_discards_the_queue_and_nothing_is_taken_before_state_0(arm: Arm) -> None:
    arm.move_joints(AWAY)
    arm.move_joints(Q6)
    arm.step(200)
    assert arm.call(Function.SET_STATE, "B", 4)[0] == STATUS_NOT_READY
    assert arm.state == State.STOPPED
    arm.run(500)
    stood = arm.q
    assert arm.move_joints(Q6) == STATUS_NOT_READY
    arm.call(Function.SET_STATE, "B", 0)
    arm.step(200)
    assert arm.q == stood


def test_a_decelerated_stop_is_shown_until_the_arm_stands(arm: Arm) -> None:
    arm.move_joints(AWAY)
    arm.step(200)
    arm.call(Function.SET_STATE, "B", 6)
    arm.step()
    assert arm.state == State.STOPPING
    assert arm.run(until=lambda: arm.state == State.STOPPED) > 20
    arm.step(2)
    assert not arm.controller.is_moving


def test_an_error_is_state_4_until_it_is_cleaned(arm: Arm) -> None:
    arm.move_line((2000.0, 0.0, 300.0, 3.1, 0.0, 0.0))
    arm.run(until=lambda: arm.error[0] != 0)
    assert arm.error[0] in (21, 40)
    assert arm.state == State.STOPPED
    assert arm.call(Function.SET_STATE, "B", 0)[0] == STATUS_ERROR | STATUS_NOT_READY
    assert arm.state == State.STOPPED
    arm.run()
    arm.call(Function.CLEAN_ERROR)
    arm.call(Function.SET_STATE, "B", 0)
    assert (arm.state, arm.error) == (State.READY, (0, 0))


def lost_share(arm: Arm, period: int) -> float:
    """Returns the share of servo commands that are lost at one in so many cycles."""
    arm.ready(Mode.SERVO)
    before = arm.controller.ignored
    for k in range(200):
        q = (Q6[0] + 1e-4 * k, *Q6[1:])
        assert arm.call(Function.SERVO_JOINT, "10f", *q, *NOTHING)[0] == 0
        arm.step(period)
    return (arm.controller.ignored - before) / 200


def test_servo_commands_above_250_hz_are_lost_without_an_error(arm: Arm) -> None:
    assert lost_share(arm, 4) == 0.0
    assert lost_share(arm, 2) == pytest.approx(0.5, abs=0.02)
    assert lost_share(arm, 1) == pytest.approx(0.75, abs=0.02)
    assert arm.error == (0, 0)


def test_the_newest_servo_target_counts_at_180_degrees_per_second(arm: Arm) -> None:
    arm.ready(Mode.SERVO)
    far, near = (Q6[0], *Q6[1:5], Q6[5] + 1.5), (Q6[0], *Q6[1:5], Q6[5] + 0.2)
    arm.call(Function.SERVO_JOINT, "10f", *far, *NOTHING)
    speeds: list[float] = []
    for _ in range(250):
        arm.step()
        speeds.append(arm.controller.arm.commanded.dq[5])
    arm.call(Function.SERVO_JOINT, "10f", *near, *NOTHING)
    arm.run()
    np.testing.assert_allclose(arm.q, near, atol=1e-6)
    assert max(speeds) == pytest.approx(np.pi, abs=5e-3)


@pytest.mark.parametrize("jitter", [0, 1])
@pytest.mark.parametrize("plant", ["ideal", "mujoco"])
def test_a_stream_of_servo_targets_is_followed_one_to_three_periods_later(plant: PlantKind, jitter: int) -> None:
    arm = Arm(plant=plant)
    arm.controller.set_up(ArmSetup(q=Q6))
    arm.ready(Mode.SERVO)
    rows = plan_joint(arm.controller.model, Q6, np.add(Q6, (0.5, 0.1, 0.0, 0.3, 0.0, 0.0)), speed=0.3).q
    late, reached, random = 0, [], np.random.default_rng(1)
    for cycle in range(len(rows) + 200):
        row = rows[min(cycle, len(rows) - 1)]
        if cycle >= late:
            arm.call(Function.SERVO_JOINT, "10f", *row, *NOTHING)
            late = cycle + 5 + int(random.integers(-jitter, jitter + 1))
        arm.step()
        reached.append(arm.q)
    speed = np.abs(np.diff(rows, axis=0)).max()  # Per cycle.
    error = np.abs(np.array(reached)[: len(rows)] - rows).max()
    assert error < (8.0 if jitter == 0 else 20.0) * speed
    assert np.abs(np.diff(reached, 2, axis=0)).max() / CYCLE_TIME**2 < 1.05 * JOINT_ACCELERATION
    np.testing.assert_allclose(reached[-1], rows[-1], atol=1e-5)
    assert arm.error == (0, 0)


def test_a_servo_pose_farther_than_10_mm_is_an_error(arm: Arm) -> None:
    arm.ready(Mode.SERVO)
    arm.call(Function.SERVO_CARTESIAN, "9f", *pose_aside(arm, 9.0), 0.0, 0.0, 0.0)
    arm.run()
    assert arm.error == (0, 0)
    arm.call(Function.SERVO_CARTESIAN, "9f", *pose_aside(arm, 12.0), 0.0, 0.0, 0.0)
    assert arm.error[0] == 24


def test_velocities_hold_until_the_next_command_or_for_their_duration(arm: Arm) -> None:
    arm.ready(Mode.JOINT_VELOCITY)
    dq = (0.3, -0.2, 0.1, 0.0, 0.1, 0.2, 0.0)
    arm.call(Function.JOINT_VELOCITY, "7fBf", *dq, 1, 0.0)
    arm.step(1000)
    np.testing.assert_allclose(arm.controller.arm.commanded.dq, dq[:6], atol=1e-6)
    arm.call(Function.JOINT_VELOCITY, "7fBf", *dq, 1, 0.2)
    assert 200 <= arm.run() <= 500
    assert arm.state == State.READY


def test_tool_velocities_move_the_tool_straight(arm: Arm) -> None:
    arm.ready(Mode.CARTESIAN_VELOCITY)
    start = arm.pose
    arm.call(Function.CARTESIAN_VELOCITY, "6fBf", 0.0, 60.0, 0.0, 0.0, 0.0, 0.0, 0, 0.5)
    arm.run()
    moved = np.subtract(arm.pose, start)
    assert 25.0 < moved[1] < 60.0
    np.testing.assert_allclose(moved[[0, 2]], 0.0, atol=0.2)  # [mm]
    np.testing.assert_allclose(moved[3:], 0.0, atol=1e-3)


def test_an_online_target_replaces_the_one_before_without_a_jump(arm: Arm) -> None:
    arm.ready(Mode.JOINT_ONLINE)
    arm.move_joints(AWAY, speed=0.5)
    arm.step(300)
    before = list(arm.controller.arm.commanded.dq)
    arm.move_joints(Q6, speed=1.0)
    arm.step()
    assert np.abs(np.subtract(arm.controller.arm.commanded.dq, before)).max() < 0.03
    arm.run()
    np.testing.assert_allclose(arm.q, Q6, atol=1e-6)


def test_an_online_line_ends_at_the_newest_pose(arm: Arm) -> None:
    arm.ready(Mode.CARTESIAN_ONLINE)
    first, second = pose_aside(arm, 80.0), pose_aside(arm, -30.0)
    arm.move_line(first)
    arm.step(200)
    arm.move_line(second)
    arm.run()
    np.testing.assert_allclose(arm.pose[:3], second[:3], atol=0.01)


def test_tool_axes_are_refused_in_mode_7(arm: Arm) -> None:
    arm.ready(Mode.CARTESIAN_ONLINE)
    values = (5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 100.0, 1000.0, 0.0, -1.0, 1, 0, 0)
    assert arm.call(Function.MOVE_LINE, "10f3B", *values)[0] & STATUS_WARNING
    assert arm.error == (0, 12)


def feedbacks(arm: Arm) -> list[tuple[int, int]]:
    """Returns kind and result of every feedback to the client."""
    return [(frame[8], frame[12]) for frame in arm.link.sent[arm.client] if frame[6] == 0xFF]


@pytest.mark.parametrize(
    ("then", "results"),
    [
        (lambda arm: None, [(1, 0), (2, 0), (1, 0), (2, 0)]),
        (lambda arm: arm.call(Function.SET_STATE, "B", 4), [(1, 0), (2, 2), (2, 2)]),
    ],
    ids=["carried out", "discarded"],
)
def test_feedback_reports_the_outcome_of_each_motion(
    arm: Arm, then: Callable[[Arm], object], results: list[tuple[int, int]]
) -> None:
    arm.call(Function.SET_FEEDBACK, "B", 3)
    arm.move_joints(AWAY)
    arm.move_joints(Q6)
    arm.step(100)
    then(arm)
    arm.run()
    arm.step(5)
    assert feedbacks(arm) == results
    (first, *_) = (frame for frame in arm.link.sent[arm.client] if frame[6] == 0xFF)
    assert first[9] == Function.MOVE_JOINT
    assert struct.unpack(">Q", first[13:21])[0] > 0


def test_feedback_goes_to_the_client_that_asked(arm: Arm) -> None:
    other = arm.join(0)
    arm.call(Function.SET_FEEDBACK, "B", 2, client=other)
    arm.move_joints(AWAY)
    arm.run()
    assert not feedbacks(arm)
    assert not [frame for frame in arm.link.sent[other] if frame[6] == 0xFF]


def test_the_documentation_has_the_table() -> None:
    text = (Path(__file__).parents[4] / "docs" / "xarm-controller.md").read_text(encoding="utf-8")
    assert "\n".join(mode_table()) in text
