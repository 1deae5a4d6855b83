"""Motions of both versions from Move to its second answer: every generator under every controller, and every end."""

from __future__ import annotations

import numpy as np
import pytest

from tests.peers.franka import programs, wire
from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import Output, Robot
from tests.peers.franka.wire import State

CONTROLLERS = {"joint": wire.JOINT_IMPEDANCE, "cartesian": wire.CARTESIAN_IMPEDANCE, "external": wire.EXTERNAL}
GENERATORS = {
    "q": wire.JOINT_POSITION, "dq": wire.JOINT_VELOCITY, "pose": wire.CARTESIAN_POSE, "twist": wire.CARTESIAN_VELOCITY
}  # fmt: skip
CYCLES = 200
REST = (0, wire.OTHER, wire.ROBOT_IDLE)


def modes(state: State) -> tuple[int, int, int]:
    return state.generator, state.controller, state.robot_mode


def differences(states: list[State], field: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns second and third differences of a field over consecutive states."""
    numbers = [state.message_id for state in states]
    assert numbers == list(range(numbers[0], numbers[-1] + 1)), "states are missing"
    rows = np.array([getattr(state, field) for state in states])
    return np.diff(rows, 2, axis=0) / 1e-6, np.diff(rows, 3, axis=0) / 1e-9


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("generator", [*GENERATORS, "pose with elbow", "twist with elbow"])
def test_every_generator_is_followed_under_every_controller(robot: Robot, generator: str, controller: str) -> None:
    kind, elbow = GENERATORS[generator.split()[0]], "elbow" in generator
    start = robot.move(CONTROLLERS[controller], kind)
    ending = robot.play(start, programs.motion(start, kind, cycles=CYCLES, elbow=elbow), cycles=CYCLES + 1)
    assert ending.state.errors == ending.state.reflex_reason == ()
    assert ending.status == "success"
    assert modes(ending.state) == REST
    moving = [state for state in robot.states if state.robot_mode == wire.ROBOT_MOVE]
    assert {modes(state) for state in moving} == {(kind + 1, CONTROLLERS[controller], wire.ROBOT_MOVE)}
    field, place, height = ("q_d", 3, 0.01) if kind < wire.CARTESIAN_POSE else ("O_T_EE_d", 14, 0.003)
    values = np.array([getattr(state, field)[place] for state in moving])
    assert values.max() - getattr(start, field)[place] == pytest.approx(height, abs=2e-5)
    if controller == "external":  # Torques of zero move nothing; those of the ideal plant have no gravity.
        assert moving[-1].q == pytest.approx(start.q, abs=1e-5)
    else:
        measured = np.array([getattr(state, field.removesuffix("_d"))[place] for state in moving])
        assert measured.max() - getattr(start, field)[place] == pytest.approx(height, rel=0.1)
    if elbow:
        assert max(state.elbow_d[0] for state in moving) - start.elbow_d[0] == pytest.approx(0.01, abs=2e-5)


def test_torques_alone_move_the_arm_and_the_reference_follows_it(robot: Robot) -> None:
    generator = wire.NONE if robot.version == 10 else wire.JOINT_VELOCITY
    start = robot.move(wire.EXTERNAL, generator)
    torque = programs.motion(start, wire.NONE, cycles=CYCLES)
    ending = robot.play(start, lambda state, k: Output(dq=programs.ZERO, tau=torque(state, k).tau), cycles=CYCLES + 1)
    assert ending.status == "success"
    moving = [state for state in robot.states if state.robot_mode == wire.ROBOT_MOVE]
    assert max(abs(state.q[6] - start.q[6]) for state in moving) > 1e-4
    assert max(state.tau_J_d[6] for state in moving) == pytest.approx(0.2, abs=1e-3)
    if robot.version == 10:
        assert all(state.q_d == state.q for state in moving[2:])
        assert {state.generator for state in moving} == {wire.NONE + 1}


def test_the_generator_none_needs_the_external_controller(robot: Robot) -> None:
    for controller in CONTROLLERS.values():
        expected = "invalid argument" if robot.version == 5 or controller != wire.EXTERNAL else "started"
        assert robot.try_move(controller, wire.NONE) == expected
    if robot.version == 10:
        robot.stop()


@pytest.mark.parametrize("modes", [(3, 0), (0, 5), (2**32 - 1, 0), (0, 2**32 - 1)])
def test_unknown_modes_are_an_invalid_argument(robot: Robot, modes: tuple[int, int]) -> None:
    assert robot.try_move(*modes) == "invalid argument"
    assert robot.state().robot_mode == wire.ROBOT_IDLE


def test_move_is_answered_at_once_and_again_after_the_end(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    for _ in range(20):
        robot.answer(start, Output(q=start.q_d))
        start = robot.state()
        assert not robot.has_answer()
    assert robot.play(start, [Output(q=start.q_d)]).status == "success"
    robot.skip(20)
    assert not robot.has_answer()


def test_no_command_is_needed_before_the_first_one(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    late = robot.skip(5)  # Each takes a tenth of a second in lock-step.
    assert modes(late) == modes(start)
    assert late.success_rate == 1.0
    assert robot.play(late, programs.motion(start, wire.JOINT_POSITION), cycles=201).status == "success"


@pytest.mark.parametrize("generator", GENERATORS)
def test_stop_move_stops_inside_the_limits_and_the_next_move_is_possible_at_once(
    robot: Robot, place: FciArena, generator: str
) -> None:
    kind = GENERATORS[generator]
    start = robot.move(wire.JOINT_IMPEDANCE, kind)
    program = programs.motion(start, kind, height=0.01)
    state = start
    for k in range(60):
        robot.answer(state, program(state, k))
        state = robot.state()
    robot.stop()
    assert robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION) == "started"
    robot.stop()
    limits = place.controller.model.limits.joint
    first = next(k for k, state in enumerate(robot.states) if state.message_id > start.message_id + 3)
    ddq, dddq = differences(robot.states[first:], "q_d")
    rounding = 2e-7 if robot.version == 10 else 1e-12  # [rad] Of single precision.
    assert (np.abs(ddq) < limits.acceleration + 4.0 * rounding / 1e-6).all()
    if robot.version == 5:
        assert (np.abs(dddq) < limits.jerk * 1.001).all()


def test_the_modes_are_shown_until_the_arm_has_stopped(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_VELOCITY)
    program = programs.motion(start, wire.JOINT_VELOCITY, height=0.1, cycles=800)
    state = start
    for k in range(250):
        robot.answer(state, program(state, k))
        state = robot.state()
    assert abs(state.dq_d[3]) > 0.2
    robot.ask("stop_move")
    ended = robot.state_when(lambda state: state.generator == 0)
    assert ended.dq_d == ended.ddq_d == programs.ZERO
    assert modes(ended) == REST


@pytest.mark.parametrize("controller", ["cartesian", "external"])
def test_a_compliant_motion_ends_with_its_last_command(toucher: Robot, controller: str) -> None:
    start = toucher.move(CONTROLLERS[controller], wire.JOINT_POSITION)
    ending = toucher.play(start, programs.motion(start, wire.JOINT_POSITION), cycles=201)
    assert ending.status == "success"
    moving = [state for state in toucher.states if state.robot_mode == wire.ROBOT_MOVE]
    last = max(k for k, state in enumerate(moving) if abs(state.q_d[3] - start.q_d[3]) > 1e-6)
    assert len(moving) - last < 80


def test_a_goal_is_reached_within_its_velocity_and_replaced_on_the_way() -> None:
    with fci_arena(10) as place, place.connect() as robot:
        speed = (0.4,) * 7
        start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION, goal_velocity=speed)
        goal = programs.with_offset(start.q_d, 0, 0.2)
        state = start
        robot.answer(state, Output(q=goal))
        state = robot.state_when(lambda state: state.q_d[0] > 0.1)
        back = programs.with_offset(start.q_d, 0, -0.05)
        robot.answer(state, Output(q=back))
        state = robot.state_when(lambda state: abs(state.q_d[0] + 0.05) < 1e-6 and state.dq_d == programs.ZERO)
        assert modes(state) == (1, 0, wire.ROBOT_MOVE)
        assert robot.play(state, [Output(q=back)]).status == "success"
        assert max(abs(state.dq_d[0]) for state in robot.states) == pytest.approx(0.4, abs=1e-3)
        assert max(state.q_d[0] for state in robot.states) < 0.2


@pytest.mark.parametrize(
    ("generator", "speed"), [(wire.JOINT_VELOCITY, 0.5), (wire.CARTESIAN_POSE, 0.5), (wire.JOINT_POSITION, 0.0)]
)
def test_goals_are_joint_angles_with_a_velocity(generator: int, speed: float) -> None:
    with fci_arena(10) as place, place.connect() as robot:
        robot.state()
        assert robot.try_move(0, generator, goal_velocity=(speed,) * 7) == "invalid argument"


def test_the_user_stop_ends_a_motion_and_blocks_the_next_until_it_is_released(robot: Robot, place: FciArena) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    program = programs.motion(start, wire.JOINT_POSITION, height=0.05, cycles=600)
    state = start
    for k in range(200):
        robot.answer(state, program(state, k))
        state = robot.state()
    place.between(lambda: place.controller.press_button("estop"))
    stopped = robot.state_when(lambda state: state.robot_mode == wire.ROBOT_USER_STOPPED)
    assert modes(stopped)[:2] == (0, wire.OTHER)
    assert robot.ending() == "emergency"
    assert stopped.errors == ()
    assert robot.try_move(0, 0) == "not possible"
    assert robot.ask("automatic_error_recovery").status == "emergency"
    assert robot.ask("stop_move").status == "emergency"
    robot.state_when(lambda state: state.dq == programs.ZERO)
    assert place.simulate("press", button="none")["ok"]
    free = robot.state_when(lambda state: state.robot_mode == wire.ROBOT_IDLE)
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    assert start.q_d == pytest.approx(free.q_d)
    assert robot.play(start, [Output(q=start.q_d)] * 5).status == "success"


def test_the_user_stop_during_a_recovery_ends_it(robot: Robot, place: FciArena) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    assert robot.play(start, [Output(q=programs.with_offset(start.q_d, 0, 0.1))]).status == "reflex"
    request = robot.request("automatic_error_recovery")
    robot.state_when(lambda state: state.robot_mode == wire.ROBOT_RECOVERING)
    place.simulate("press", button="estop")
    assert robot.response("automatic_error_recovery", request).status == "emergency"
    place.simulate("press", button="none")
    robot.state_when(lambda state: state.robot_mode == wire.ROBOT_REFLEX)
    assert robot.ask("automatic_error_recovery").status == "success"


def test_a_user_stop_released_before_the_arm_has_stopped_is_followed_by_the_rest_of_the_stop(
    robot: Robot, place: FciArena
) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_VELOCITY)
    program = programs.motion(start, wire.JOINT_VELOCITY, height=0.1, cycles=800)
    state = start
    for k in range(250):
        robot.answer(state, program(state, k))
        state = robot.state()

    def tap() -> None:
        place.controller.press_button("estop")
        place.controller.press_button("none")

    place.between(tap)
    assert robot.ending() == "emergency"
    ended = robot.state_when(lambda state: state.robot_mode == wire.ROBOT_IDLE)
    assert ended.dq_d == programs.ZERO


def test_a_second_move_is_refused_and_the_first_continues(robot: Robot) -> None:
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    first = robot._move_id
    assert robot.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_VELOCITY) == "not possible"
    robot._move_id = first
    assert robot.play(robot.state(), [Output(q=start.q_d)] * 20).status == "success"


def test_the_success_rate_is_that_of_the_last_hundred_cycles_and_zero_at_rest(robot: Robot, place: FciArena) -> None:
    assert robot.state().success_rate == 0.0
    start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    state = start
    for _ in range(120):
        robot.answer(state, Output(q=start.q_d))
        state = robot.state()
    assert state.success_rate == 1.0
    place.arena.between(lambda cycle: [cycle.step() for _ in range(10)])  # The next command, and 10 lost ones.
    for _ in range(5):
        robot.answer(state, Output(q=start.q_d))
        state = robot.state()
    assert state.success_rate == pytest.approx(0.9, abs=0.011)
    assert robot.play(state, [Output(q=start.q_d)]).state.success_rate == 0.0
