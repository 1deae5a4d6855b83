"""All twenty faults through the wire: the bit in the very cycle, a stop inside limits, a recovery, a next motion."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.makers.rokae.controller.state_machine import Phase
from rcilab.makers.rokae.wire import SafetyStop, SetMotorPower
from tests.peers import faults, programs, wire
from tests.peers.arena import PLANTS, Arena, arena
from tests.peers.faults import CASES, Case
from tests.peers.kinematics import Model
from tests.peers.robot import CommandException, Output, Robot
from tests.peers.sensors import ALLOWED_ANGLE, ALLOWED_PLACE, LYING, LyingSensors
from tests.peers.wire import State

AFTERMATH = 1500  # States within which an arm has come to rest.
REFLEX, MANUAL_RECOVERY = 6, 2  # Statuses of StartMove and of the recovery.


@pytest.fixture(params=PLANTS)
def place(request: pytest.FixtureRequest) -> Iterator[Arena]:
    with arena(plant=request.param, wrap_plant=LyingSensors) as found:
        yield found


@pytest.fixture
def robot(place: Arena) -> Iterator[Robot]:
    with place.connect() as found:
        found.set_motor_power(1)
        yield found


def begin(robot: Robot, modes: tuple[int, int]) -> State:
    """Starts a motion and returns the first state that shows it; nothing has been answered yet."""
    robot.states.clear()
    robot.start_move(*modes)
    return robot.states[-1]


def answer_until_error(robot: Robot, state: State, output: Callable[[State], Output], limit: int) -> State:
    """Answers state after state until one has an error bit."""
    for _ in range(limit):
        robot.answer(state, output(state))
        state = robot.next_state(state.message_id)
        if state.errors:
            return state
    raise AssertionError(f"no error bit within {limit} states")


def watch_the_stop(robot: Robot, state: State) -> list[State]:
    """Receives states until the arm rests, and returns those in which it was commanded to move.

    Meanwhile the bits stay and the modes are hidden. When the brakes have closed, the commanded angles are those at
    which the arm was caught.
    """
    stop, bits, is_moving = [state], set(state.errors), True
    while is_moving or max(map(abs, state.dq_m)) > 1e-6:
        state = robot.next_state(state.message_id)
        assert state.message_id < stop[0].message_id + AFTERMATH, "the arm does not come to rest"
        assert bits <= set(state.errors)
        assert (state.controller_mode, state.motion_mode) == (wire.OTHER, wire.IDLE)
        is_moving = is_moving and any(state.dq_c + state.ddq_c)
        if is_moving:
            stop.append(state)
    return stop


def stays_inside_the_limits(states: list[State]) -> None:
    if len(states) >= 4:
        second, third = faults.differences(states)
        assert (np.abs(second) <= np.array(faults.ACCELERATION) + 1e-6).all(), np.abs(second).max(axis=0)
        assert (np.abs(third) <= np.array(faults.JERK) + 1e-3).all(), np.abs(third).max(axis=0)


def recover_and_move(robot: Robot) -> None:
    """Nothing moves before the recovery; after it a motion runs as if nothing had been."""
    robot.stop_move()
    assert robot.receive_fresh_state().robot_mode == wire.ROBOT_REFLEX
    with pytest.raises(CommandException) as refused:
        robot.start_move(wire.JOINT_POSITION, wire.JOINT)
    assert refused.value.status == REFLEX
    status = robot.ask(wire.Code.ERROR_RECOVERY)[0]
    assert status in (0, MANUAL_RECOVERY)
    if status == MANUAL_RECOVERY:  # The arm is beyond a soft limit or outside the box: power off, widen them, on.
        robot.set_motor_power(0)
    assert robot.receive_fresh_state().errors == ()
    faults.clear_the_scene(robot)
    robot.set_motor_power(1)
    robot.states.clear()
    programs.joint_sine(robot, 0.05, amplitude=0.001, period=0.1)
    assert not any(state.errors for state in robot.states)
    assert len(robot.states) >= 50


@pytest.mark.parametrize("name", CASES)
def test_a_wrong_command_sets_its_bit_in_the_very_cycle(robot: Robot, name: str) -> None:
    case: Case = CASES[name]
    faults.set_the_scene(robot, robot.receive_fresh_state(), case.bit)
    wrong = case.build(robot, robot.receive_fresh_state())
    state = begin(robot, case.modes)
    first, outputs = state.message_id, iter(wrong.outputs)
    state = answer_until_error(robot, state, lambda _: next(outputs), len(wrong.outputs))
    assert case.bit in state.errors
    assert state.message_id == first + wrong.at + 1
    if case.alone:
        assert state.errors == (case.bit,)
    stop = watch_the_stop(robot, state)
    if case.modes != faults.TORQUE_MODE:  # There the stop begins where the arm is, not where it was told to be.
        stays_inside_the_limits([s for s in robot.states if first <= s.message_id <= stop[-1].message_id])
    stays_inside_the_limits(stop)
    recover_and_move(robot)


@pytest.mark.parametrize("name", LYING)
def test_a_wrong_measurement_sets_its_bit_in_the_very_cycle(place: Arena, robot: Robot, name: str) -> None:
    lie = LYING[name]
    start = robot.receive_fresh_state()
    faults.set_the_scene(robot, start, lie.bit)
    robot.set_collision_behavior(faults.THRESHOLDS)
    state = begin(robot, lie.modes)
    lying = place.plant
    assert isinstance(lying, LyingSensors)
    lying.begin(lie)
    first = state.message_id
    output = Output(q=start.q_c) if lie.modes == faults.JOINT_MODE else Output(pose=start.pos_c, psi=start.psi_c[0])
    state = answer_until_error(robot, state, lambda _: output, len(lie.offsets) + 10)
    place.between(lambda _: lying.end())
    assert lie.bit in state.errors
    early = next(s.message_id for s in robot.states if s.message_id >= first and s.q != s.q_c and lie.breaks(s))
    assert state.message_id == early
    stays_inside_the_limits(watch_the_stop(robot, state))
    while max(map(abs, robot.receive_fresh_state().tau_ext_in_base)) > 1.0:  # The estimate still contains the impact.
        pass
    recover_and_move(robot)


def test_a_line_towards_the_stretched_arm_ends_in_an_invalid_frame(robot: Robot) -> None:
    """So slowly that no joint is too fast before the arm counts as singular."""
    programs.move_j(robot, 1.0, robot.receive_fresh_state().q, (0.1, 0.5, 0.0, 0.08, 0.0, 1.0, 0.0))
    model = Model(robot.load_robot_model())
    state = begin(robot, faults.CARTESIAN_MODE)
    frames = model.frames(state.q_c)
    outwards = frames[5][:3, 3] - frames[1][:3, 3]
    outwards /= np.linalg.norm(outwards)
    T, path = state.pos_c, iter(np.cumsum(np.minimum(np.arange(2000) * 1e-8, 1e-6)).tolist())

    def on_the_line(state: State) -> Output:
        x, y, z = outwards * next(path)
        return Output(pose=(*T[:3], T[3] + x, *T[4:7], T[7] + y, *T[8:11], T[11] + z, *T[12:]))

    state = answer_until_error(robot, state, on_the_line, 2000)
    assert state.errors == (16,)
    assert 0.0 < state.q_c[3] < 0.05
    stays_inside_the_limits(watch_the_stop(robot, state))
    recover_and_move(robot)


def push(wrench: tuple[float, ...]) -> Callable[[RciController], object]:
    return lambda cycle: cycle.plant.push(wrench)


def test_a_push_above_the_threshold_is_a_collision(place: Arena, robot: Robot) -> None:
    robot.set_collision_behavior((10.0,) * 7)
    state = begin(robot, faults.JOINT_MODE)
    q = state.q_c
    for _ in range(50):
        robot.answer(state, Output(q=q))
        state = robot.next_state(state.message_id)
        assert not state.errors
    place.between(push((0.0, 0.0, -60.0, 0.0, 0.0, 0.0)))
    state = answer_until_error(robot, state, lambda _: Output(q=q), 100)
    assert state.errors == (15,)
    assert state.tau_ext_in_base[2] < -5.0
    place.between(push((0.0,) * 6))
    stays_inside_the_limits(watch_the_stop(robot, state))
    recover_and_move(robot)


@pytest.mark.parametrize(
    ("bit", "wrench"), [(0, (0.0, 25.0, 0.0, 0.0, 0.0, 0.0)), (1, (0.0, 0.0, -25.0, 0.0, 0.0, 0.0))]
)
def test_a_push_that_an_impedance_yields_to_is_judged_where_the_arm_is(
    place: Arena, robot: Robot, bit: int, wrench: tuple[float, ...]
) -> None:
    """The commanded arm stands still inside its limits; the measured one is pushed out of them."""
    start = robot.receive_fresh_state()
    robot.set_joint_impedance((100.0,) * 4 + (20.0,) * 3)
    faults.set_the_scene(robot, start, bit)
    state = begin(robot, (wire.JOINT_IMPEDANCE, wire.JOINT))
    shares = iter(np.minimum(np.arange(3000) / 1000.0, 1.0).tolist())

    def pushed(state: State) -> Output:
        share = next(shares)
        place.between(push(tuple(share * value for value in wrench)))
        return Output(q=start.q_c)

    state = answer_until_error(robot, state, pushed, 3000)
    place.between(push((0.0,) * 6))
    assert state.errors == (bit,)
    beyond = [out_of_scene(bit, start, s) for s in robot.states]
    assert beyond.index(True) == next(k for k, s in enumerate(robot.states) if s.errors)
    stays_inside_the_limits(watch_the_stop(robot, state)[1:])  # The stop is placed where the arm is, in motion.
    recover_and_move(robot)


def out_of_scene(bit: int, start: State, state: State) -> bool:
    if bit == 0:
        return state.q[0] > start.q[0] + 0.01 + ALLOWED_ANGLE
    off = np.subtract(state.pos_m[3:12:4], start.pos_c[3:12:4])
    return bool(np.abs(off).max() > 0.02 + ALLOWED_PLACE)


@pytest.mark.parametrize("modes", [faults.JOINT_MODE, faults.CARTESIAN_MODE, faults.TORQUE_MODE])
def test_a_client_that_falls_silent_is_an_instability(robot: Robot, modes: tuple[int, int]) -> None:
    state = begin(robot, modes)
    still = Output(tau=(0.0,) * 7) if modes == faults.TORQUE_MODE else Output(q=state.q_c)
    output = Output(pose=state.pos_c) if modes == faults.CARTESIAN_MODE else still
    for _ in range(30):
        robot.answer(state, output)
        state = robot.next_state(state.message_id)
    last_answer = state.message_id - 1
    while not state.errors:
        state = robot.next_state(state.message_id)
    assert state.errors == (19,)
    allowed = 20 if modes == faults.TORQUE_MODE else 50  # Cycles: lost commands in a row, and 30 that may be late.
    assert state.message_id == last_answer + 1 + allowed
    stays_inside_the_limits(watch_the_stop(robot, state))
    recover_and_move(robot)


@pytest.mark.parametrize("kind", [1, 2], ids=["ESTOP", "GSTOP"])
def test_a_safety_stop_in_mid_motion_sets_a_bit_and_waits_for_its_release(
    place: Arena, robot: Robot, kind: int
) -> None:
    state = begin(robot, faults.JOINT_MODE)
    second = np.minimum(0.2 * np.arange(400), 2.0)
    q = np.cumsum(np.cumsum(second)) * 1e-6
    start, path = state.q_c, iter(q.tolist())
    for _ in range(100):
        robot.answer(state, Output(q=(start[0] + next(path), *start[1:])))
        state = robot.next_state(state.message_id)
    place.between(lambda cycle: cycle.press_safety_stop(SafetyStop(kind)))
    state = answer_until_error(robot, state, lambda _: Output(q=(start[0] + next(path), *start[1:])), 200)
    stop = watch_the_stop(robot, state)
    stays_inside_the_limits(stop)
    assert stop[-1].robot_mode == robot.receive_fresh_state().robot_mode == wire.ROBOT_USER_STOPPED
    robot.stop_move()
    assert robot.get_safety_stop_state() == kind
    with pytest.raises(CommandException):
        robot.automatic_error_recovery()
    place.between(lambda cycle: cycle.press_safety_stop(SafetyStop.NONE))
    while robot.receive_fresh_state().robot_mode == wire.ROBOT_USER_STOPPED:
        pass
    robot.set_motor_power(1)
    assert robot.receive_fresh_state().errors == ()
    programs.joint_sine(robot, 0.05, amplitude=0.001, period=0.1)


def test_starting_a_cartesian_motion_at_a_singular_pose_is_refused(robot: Robot) -> None:
    programs.move_j(robot, 1.0, robot.receive_fresh_state().q, (0.0,) * 7)
    with pytest.raises(CommandException) as refused:
        robot.start_move(*faults.CARTESIAN_MODE)
    assert refused.value.status == 4
    programs.joint_sine(robot, 0.05, amplitude=0.001, period=0.1)


@pytest.mark.parametrize("joint", [2, 6], ids=["axes 1 and 3 in line", "axes 5 and 7 in line"])
def test_a_wrist_or_shoulder_that_is_straight_is_singular_too(robot: Robot, joint: int) -> None:
    q = list(robot.receive_fresh_state().q)
    q[joint - 1] = 0.005
    programs.move_j(robot, 1.0, robot.receive_fresh_state().q, tuple(q))
    with pytest.raises(CommandException) as refused:
        robot.start_move(*faults.CARTESIAN_MODE)
    assert refused.value.status == 4


@pytest.mark.parametrize("what", ["estop", "power off"])
def test_what_stops_the_arm_before_the_modes_ends_the_clients_wait_for_them(
    robot: Robot, place: Arena, what: str
) -> None:
    def stop(cycle: RciController) -> None:
        if what == "estop":
            cycle.press_safety_stop(SafetyStop.ESTOP)
        else:
            cycle.handle(SetMotorPower(0))

    waiting = threading.Thread(target=robot.start_move, args=faults.JOINT_MODE)
    waiting.start()
    while place.cycle.phase is not Phase.STARTING:
        assert waiting.is_alive()
    place.between(stop)
    waiting.join()
    state = robot.receive_fresh_state()
    assert state.errors == (19,)
    robot.stop_move()
    assert robot.receive_fresh_state().controller_mode != faults.JOINT_MODE[0]


def test_motors_switched_off_in_mid_motion_set_a_bit_until_they_are_on_again(robot: Robot) -> None:
    state = begin(robot, faults.JOINT_MODE)
    still = Output(q=state.q_c)
    for _ in range(30):
        robot.answer(state, still)
        state = robot.next_state(state.message_id)
    robot.set_motor_power(0)
    state = answer_until_error(robot, state, lambda _: still, 20)
    assert state.errors == (19,)
    robot.stop_move()
    robot.set_motor_power(1)
    assert robot.receive_fresh_state().errors == ()
    programs.joint_sine(robot, 0.05, amplitude=0.001, period=0.1)
