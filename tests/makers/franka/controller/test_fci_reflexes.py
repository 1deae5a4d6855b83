"""Errors of what the arm meets: forces, deviations from its motion, measured velocities, and missing commands."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from rcilab.core.state import RobotState
from rcilab.motion import plan_joint
from tests.makers.franka.controller.test_fci_errors import recover, require_chinese
from tests.peers.franka import programs, wire
from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import Ending, Output, Robot
from tests.peers.franka.wire import ERROR_NAMES

SOFT = wire.doubles(*(200.0,) * 3, *(20.0,) * 3)
HIGH = 1000.0


def thresholds(torque: float, force: float) -> bytes:
    return wire.doubles(*(torque,) * 28, *(force,) * 24)


def stay(robot: Robot, controller: int, cycles: int = 1500, **deviations: tuple[float, ...]) -> Ending:
    """Commands the present pose for some cycles."""
    start = robot.move(controller, wire.CARTESIAN_POSE, **deviations)
    return robot.play(start, [Output(pose=start.O_T_EE_c)] * cycles)


CASES: dict[str, tuple[str, tuple[float, float], list[float], dict[str, tuple[float, ...]]]] = {
    "a force above its threshold": ("7", (HIGH, 10.0), [0.0, 0.0, -20.0, 0.0, 0.0, 0.0], {}),
    "torques above theirs": ("6", (3.0, HIGH), [0.0, 0.0, -20.0, 0.0, 0.0, 0.0], {}),
    "the path of a soft arm": ("9", (HIGH, HIGH), [0.0, 0.0, -10.0, 0.0, 0.0, 0.0], {"path": (0.01, 3.12, 6.28)}),
    "the orientation of a soft arm": ("9", (HIGH, HIGH), [0, 0, 0, 0, 0, 2.0], {"path": (10.0, 0.05, 6.28)}),
    "the end of a soft arm": ("8", (HIGH, HIGH), [0.0, 0.0, -10.0, 0.0, 0.0, 0.0], {"goal": (0.01, 3.12, 6.28)}),
    "a push that turns the tool too fast": ("4", (HIGH, HIGH), [0.0, 0.0, 0.0, 0.0, 0.0, 15.0], {}),
}
"""Errors, thresholds of torques and forces, wrench on the tool, largest deviations."""


@pytest.mark.parametrize("name", CASES)
def test_what_a_force_does_to_the_arm_ends_its_motion(toucher: Robot, felt: FciArena, name: str) -> None:
    numbers, bounds, wrench, deviations = CASES[name]
    assert toucher.ask("set_collision_behavior", thresholds(*bounds)).status == "success"
    assert toucher.ask("set_cartesian_impedance", SOFT).status == "success"
    felt.simulate("push", wrench=wrench)
    ending = stay(toucher, wire.CARTESIAN_IMPEDANCE, **deviations)
    felt.simulate("release")
    assert ending.state.errors == tuple(ERROR_NAMES[int(number)] for number in numbers.split())
    assert ending.status == "reflex"
    assert ending.state.reflex_reason == ending.state.errors
    require_chinese(felt)
    assert toucher.ask("set_collision_behavior", thresholds(HIGH, HIGH)).status in ("success", "not possible")
    toucher.skip(300)
    recover(toucher, ending.state.errors)


@pytest.mark.parametrize(
    ("bounds", "expected"),
    [
        (
            (HIGH, 10.0),
            r"cartesian_reflex: external force along z of K: (\S+) N is above its threshold 10 N "
            r"\(K_F_ext_hat_K\[2\] is -\1\); .*",
        ),
        (
            (3.0, HIGH),
            r"joint_reflex: joint \d: external torque [\d.]+ N m is above its threshold 3 N m "
            r"\(tau_ext_hat_filtered\[\d\] is -?[\d.]+\).*",
        ),
    ],
)
def test_a_reflex_is_one_line_with_the_force_and_its_threshold(bounds: tuple[float, float], expected: str) -> None:
    with fci_arena(5, plant="mujoco") as place, place.connect() as robot:
        robot.ask("set_collision_behavior", thresholds(*bounds))
        place.simulate("push", wrench=[0.0, 0.0, -20.0, 0.0, 0.0, 0.0])
        stay(robot, wire.JOINT_IMPEDANCE)
        place.between(lambda: None)
        (line,) = place.log("fault")
    assert re.fullmatch(expected, line), line


def test_deviations_within_their_bounds_end_nothing(toucher: Robot, felt: FciArena) -> None:
    assert toucher.ask("set_cartesian_impedance", SOFT).status == "success"
    felt.simulate("push", wrench=[0.0, 0.0, -10.0, 0.0, 0.0, 0.0])
    bounds = (0.1, 0.5, 1.0)
    ending = stay(toucher, wire.CARTESIAN_IMPEDANCE, 600, path=bounds, goal=bounds)
    assert ending.status == "success"
    assert ending.state.errors == ()


@pytest.mark.parametrize("version", [5, 10])
def test_links_that_touch_end_a_motion_and_may_be_moved_apart(version: int) -> None:
    folded = {5: (0.0, 1.616, 0.0, -2.606, 0.0, 1.801, 0.785), 10: (0.0, 1.174, 0.0, -2.849, 0.0, 3.813, 0.785)}
    with fci_arena(version) as place, place.connect() as robot:
        start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
        rows = plan_joint(place.controller.model, place.controller.model.home, folded[version], speed=0.3).q
        ending = robot.play(start, [Output(q=tuple(row)) for row in rows.tolist()])
        assert ending.state.errors == ("self_collision_avoidance_violation",)
        assert ending.status == "reflex"
        assert place.log("fault") == [
            "self_collision_avoidance_violation: base and link 6 touch; the arm stops",
        ]
        require_chinese(place)
        assert robot.ask("automatic_error_recovery").status == "success"
        start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
        rows = plan_joint(place.controller.model, start.q_d, place.controller.model.home, speed=0.3).q
        ending = robot.play(start, [Output(q=tuple(row)) for row in rows.tolist()])
        assert (ending.status, ending.state.errors) == ("success", ())


def lose(place: FciArena, cycles: int) -> list[RobotState]:
    """Loses cycles after the next command; the list receives its state and those of all lost cycles but the last."""
    states: list[RobotState] = []
    place.arena.between(lambda cycle: states.extend(cycle.step() for _ in range(cycles)))
    return states


def by_time(robot: Robot, lost: Callable[[int], None], cycles: int = 600) -> Ending:
    """Runs a motion whose program goes by the numbers of states; `lost` is called before each command."""
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    program = programs.motion(start, wire.JOINT_POSITION, cycles=cycles, height=0.05)

    def callback(state: wire.State, k: int) -> Output:
        lost(k)
        return program(state, state.message_id - start.message_id)

    return robot.play(start, callback, cycles=cycles + 1)


def test_a_motion_bridges_nineteen_lost_cycles_with_constant_acceleration(robot: Robot, place: FciArena) -> None:
    seen: list[list[RobotState]] = []

    def lost(k: int) -> None:
        if k == 295:  # Around the farthest place: a path that changes its acceleration more is a discontinuity.
            seen.append(lose(place, 19))

    assert by_time(robot, lost).status == "success"
    acceleration = [state.ddq_c[3] for state in seen[0]]
    assert acceleration == pytest.approx([acceleration[0]] * 19, abs=1e-6)
    assert acceleration[0] < -1.0


STEADY = 3.0  # [rad/s^2] Acceleration of joint 1 before cycles are lost.


@pytest.mark.parametrize("lost", [1, 3, 10])
@pytest.mark.parametrize(("share", "errors"), [(0.9, ()), (1.03, (14,)), (2.5, (14,))])
def test_after_lost_cycles_the_next_angles_are_checked_from_those_of_the_state(
    robot: Robot, place: FciArena, lost: int, share: float, errors: tuple[int, ...]
) -> None:
    limits = place.controller.model.limits.joint
    size = share * float(limits.acceleration[0])
    jerk = (15,) if size - STEADY > 1.03e-3 * limits.jerk[0] else ()
    start = state = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    velocity = angle = 0.0
    for k, acceleration in enumerate([0.0, 1.0, 2.0] + [STEADY] * 20):
        velocity += 1e-3 * acceleration
        angle += 1e-3 * velocity
        if k == 22:
            lose(place, lost)
        robot.answer(state, Output(q=programs.with_offset(start.q_d, 0, angle)))
        before, state = state.message_id, robot.state()
    assert state.message_id == before + 1 + lost
    for _ in range(lost):
        velocity += 1e-3 * STEADY
        angle += 1e-3 * velocity
    assert state.q_d[0] - start.q_d[0] == pytest.approx(angle, abs=1e-6)
    ended = robot.play(state, [Output(q=programs.with_offset(start.q_d, 0, angle + 1e-3 * (velocity + 1e-3 * size)))])
    assert ended.state.errors[: len((*errors, *jerk))] == tuple(ERROR_NAMES[n] for n in (*errors, *jerk))


@pytest.mark.parametrize("lost", [0, 1, 10])
@pytest.mark.parametrize(("step", "errors"), [(0.9, ()), (1.5, (32,))])
def test_after_lost_cycles_a_torque_may_change_by_no_more_than_in_one_cycle(
    robot: Robot, place: FciArena, lost: int, step: float, errors: tuple[int, ...]
) -> None:
    generator = wire.NONE if robot.version == 10 else wire.JOINT_VELOCITY
    state = robot.move(wire.EXTERNAL, generator)
    for k in range(5):
        if k == 4 and lost:
            lose(place, lost)
        robot.answer(state, Output(dq=programs.ZERO, tau=programs.ZERO))
        state = robot.state()
    ending = robot.play(state, [Output(dq=programs.ZERO, tau=(0.0,) * 6 + (step,))])
    assert ending.state.errors == tuple(ERROR_NAMES[n] for n in errors)


@pytest.mark.parametrize(("share", "errors"), [(0.15, ()), (1.5, (20,))])
def test_after_lost_cycles_the_next_pose_is_checked_from_that_of_the_state(
    robot: Robot, place: FciArena, share: float, errors: tuple[int, ...]
) -> None:
    start = state = robot.move(wire.JOINT_IMPEDANCE, wire.CARTESIAN_POSE)
    for k in range(5):
        if k == 4:
            lose(place, 3)
        robot.answer(state, Output(pose=start.O_T_EE_c))
        state = robot.state()
    off = share * float(place.controller.model.limits.cartesian.translation_jerk) * 1e-9
    ending = robot.play(state, [Output(pose=programs.with_offset(start.O_T_EE_c, 14, off))])
    assert set(ending.state.errors) >= {ERROR_NAMES[n] for n in errors}
    assert bool(ending.state.errors) == bool(errors)


def test_twenty_lost_cycles_in_a_row_end_a_motion(robot: Robot, place: FciArena) -> None:
    seen: list[list[RobotState]] = []

    def lost(k: int) -> None:
        if k == 150:
            seen.append(lose(place, 20))

    ending = by_time(robot, lost)
    assert [state.faults for state in seen[0]] == [()] * 20
    assert ending.status == "reflex"
    assert ending.state.errors == ("communication_constraints_violation",)
    recover(robot, ending.state.errors)


def test_a_client_that_falls_silent_loses_its_motion(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    state = start
    for _ in range(10):
        robot.answer(state, Output(q=start.q_d))
        state = robot.state()
    ended = robot.state_when(lambda state: state.robot_mode == wire.ROBOT_REFLEX)
    assert ended.errors == ("communication_constraints_violation",)
    assert robot.ending() == "reflex"


def test_torques_are_held_over_lost_cycles(robot: Robot, place: FciArena) -> None:
    generator = wire.NONE if robot.version == 10 else wire.JOINT_VELOCITY
    state = robot.move(wire.EXTERNAL, generator)
    seen: list[RobotState] = []
    for k in range(20):
        if k == 19:
            seen = lose(place, 10)
        output = Output(dq=programs.ZERO, tau=(0.0,) * 6 + (0.02 * k,))
        robot.answer(state, output)
        state = robot.state()
    assert robot.play(state, [output] * 3).status == "success"
    assert [state.tau_c[6] for state in seen] == pytest.approx([0.38] * 10)


@pytest.mark.parametrize("generator", [wire.JOINT_VELOCITY, wire.CARTESIAN_VELOCITY, wire.CARTESIAN_POSE])
def test_every_generator_bridges_lost_cycles(robot: Robot, place: FciArena, generator: int) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, generator)
    program = programs.motion(start, generator, cycles=600, height=0.03)

    def callback(state: wire.State, k: int) -> Output:
        if k in (100, 200, 320):
            lose(place, 4)
        return program(state, state.message_id - start.message_id)

    ending = robot.play(start, callback, cycles=600)
    assert ending.state.errors == ()
    assert ending.status == "success"
