"""Networks that lose, copy and reorder datagrams, and clients that are slow: what a smooth motion survives."""

from __future__ import annotations

import time

import pytest

from tests.peers.franka import programs, wire
from tests.peers.franka.arena import FciArena, fci_arena
from tests.peers.franka.robot import Ending, Output, Robot

GENERATORS = (wire.JOINT_POSITION, wire.JOINT_VELOCITY, wire.CARTESIAN_POSE, wire.CARTESIAN_VELOCITY)


def by_time(robot: Robot, generator: int, cycles: int = 600) -> Ending:
    """Runs a motion whose program goes by the numbers of states."""
    start = robot.move(wire.JOINT_IMPEDANCE, generator)
    program = programs.motion(start, generator, cycles=cycles, height=0.02)
    return robot.play(start, lambda state, k: program(state, state.message_id - start.message_id), cycles=cycles)


@pytest.mark.parametrize("faults", [{"loss": 0.03}, {"duplicate": 0.2}, {"loss": 0.02, "duplicate": 0.1}])
@pytest.mark.parametrize("generator", GENERATORS)
def test_a_smooth_motion_survives_a_network_that_loses_and_copies(
    robot: Robot, place: FciArena, generator: int, faults: dict[str, float]
) -> None:
    try:
        assert place.simulate("network", faults={**faults, "seed": 3}, direction="commands")["ok"]
        ending = by_time(robot, generator)
    finally:
        place.simulate("network", faults={})
    assert (ending.status, ending.state.errors) == ("success", ())
    if "loss" in faults:
        assert min(state.success_rate for state in robot.states if state.robot_mode == wire.ROBOT_MOVE) < 1.0


def test_lost_states_cost_nothing_but_their_cycles(robot: Robot, place: FciArena) -> None:
    try:
        place.simulate("network", faults={"loss": 0.02, "seed": 5}, direction="states")
        ending = by_time(robot, wire.JOINT_POSITION)
    finally:
        place.simulate("network", faults={})
    assert (ending.status, ending.state.errors) == ("success", ())


@pytest.mark.parametrize("version", [5, 10])
def test_by_the_clock_a_client_that_falls_silent_loses_its_motion(version: int) -> None:
    with fci_arena(version, lockstep=False, patience=None) as place, place.connect() as robot:
        state = start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
        for _ in range(50):
            robot.answer(state, Output(q=start.q_d))
            state = robot.state()
        ended = robot.state_when(lambda state: state.robot_mode == wire.ROBOT_REFLEX)
        assert ended.errors == ("communication_constraints_violation",)
        assert robot.ending() == "reflex"
        (advice,) = place.log("advice")
        assert advice.startswith("a cycle waits 0.02 s for its command, --patience S for longer; --lockstep waits")
        assert robot.ask("automatic_error_recovery").status == "success"
        ending = by_time(robot, wire.JOINT_POSITION, 300)
        assert (ending.status, ending.state.errors) == ("success", ())


@pytest.mark.parametrize("version", [5, 10])
def test_by_the_clock_every_generator_is_followed(version: int) -> None:
    with fci_arena(version, lockstep=False, patience=None, plant="mujoco") as place, place.connect() as robot:
        for generator in GENERATORS:
            ending = by_time(robot, generator, 300)
            assert (ending.status, ending.state.errors) == ("success", ())


@pytest.mark.parametrize("version", [5, 10])
def test_by_the_clock_a_first_command_that_takes_its_time_is_waited_for(version: int) -> None:
    with fci_arena(version, lockstep=False, patience=5.0) as place, place.connect() as robot:
        for cycle in range(8):  # Move comes at any time of a cycle.
            start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
            time.sleep(0.004 + 0.0003 * cycle)
            first = programs.with_offset(start.q_d, 3, 5e-7)
            robot.answer(start, Output(q=first))
            state = robot.state()
            assert state.message_id == start.message_id + 1
            assert state.q_d == pytest.approx(first, abs=1e-7)
            assert robot.play(state, [Output(q=first)] * 3).status == "success"
