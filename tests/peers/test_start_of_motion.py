"""Motions in all modes, one after another, from each place that a client may take for where the arm is."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator

import pytest

from rcilab.sim.generators.start import SERVO_LENGTH
from tests.peers import wire
from tests.peers.arena import PLANTS, Arena, arena
from tests.peers.robot import CARTESIAN_SPACE, DRAG_FREE, Output, Robot
from tests.peers.wire import State

ROUNDS = 2  # The pushes of the second one are opposite: a round has an odd number of motions.
DURATION = 150  # [cycles] of one motion
LEAN = 3.0
"""Force on the tool while it yields, up and down in turn, [N]; it then rests 2 to 3 mm off."""
DRAG = "drag"
MODES = {
    "joint position": (0, wire.JOINT),
    "Cartesian position": (1, wire.CARTESIAN),
    "joint impedance": (2, wire.JOINT),
    "Cartesian impedance": (3, wire.CARTESIAN),
    "torque": (4, wire.IDLE),
    DRAG: None,
}
Place = tuple[tuple[float, ...], tuple[float, ...], float]
"""Joint angles, tool pose and arm angle."""
STARTS: dict[str, Callable[[State, Place], Place]] = {
    "measured": lambda state, last: (state.q, state.pos_m, state.psi_m[0]),
    "commanded": lambda state, last: (state.q_c, state.pos_c, state.psi_c[0]),
    "own last command": lambda state, last: last,
}


def every_pair(names: list[str]) -> Iterator[str]:
    """Names in an order in which each follows each, itself too: an Eulerian circuit (a de Bruijn sequence)."""
    for i, first in enumerate(names):
        yield first
        for other in names[i + 1 :]:
            yield first
            yield other
    yield names[0]


def swing(mode: tuple[int, int], start: Place) -> Callable[[State], Output]:
    """There and back by 1 mrad of every joint, or 1 mm of the tool; torques of zero. Ends exactly at its start."""
    q, pose, psi = start
    cycle = -1

    def callback(state: State) -> Output:
        nonlocal cycle
        cycle += 1
        step = 0.0005 * (1.0 - math.cos(2.0 * math.pi * min(cycle, DURATION) / DURATION))
        is_over = cycle > DURATION + 1
        if mode[1] == wire.IDLE:
            return Output(tau=(0.0,) * 7, finished=is_over)
        if mode[1] == wire.JOINT:
            return Output(q=tuple(angle + step for angle in q), finished=is_over)
        moved = (*pose[:11], pose[11] - step, *pose[12:])
        return Output(pose=moved, psi=psi, finished=is_over)

    return callback


def run(found: Arena, robot: Robot, name: str, start: Place, lean: float) -> None:
    """Runs one motion; in impedance modes the tool is pushed until it has ended."""
    mode = MODES[name]
    is_yielding = name.endswith("impedance")
    if is_yielding:
        found.between(lambda _: found.plant.push((0.0, 0.0, lean, 0.0, 0.0, 0.0)))
    if mode is None:
        robot.start_drag(CARTESIAN_SPACE, DRAG_FREE)
        before = robot.receive_fresh_state().message_id
        robot.next_state(before + DURATION)
        robot.stop_drag()
        return
    robot.start_move(*mode)
    robot.control(swing(mode, start))
    if is_yielding:
        found.between(lambda _: found.plant.push((0.0,) * 6))


def distance(start: Place, reference: Place) -> float:
    """How far the tool of a start is from that of a reference, [m]."""
    return math.dist(start[1][3::4], reference[1][3::4])


def begin_in_every_mode(where: str, plant: str, rounds: int) -> None:
    """Runs every mode after every mode, so many times, on one arm."""
    with arena(plant=plant) as found, found.connect(answers_once=True) as robot:
        robot.filter_frequency = 1000.0
        robot.set_motor_power(1)
        robot.set_cartesian_impedance((1000.0,) * 3 + (100.0,) * 3)
        robot.set_joint_impedance((500.0,) * 4 + (100.0,) * 3)
        state = robot.receive_fresh_state()
        first: Place = state.q_c, state.pos_c, state.psi_c[0]
        leans = itertools.cycle((LEAN, -LEAN))
        farthest = 0.0
        for _ in range(rounds):
            for name in every_pair(list(MODES)):
                robot.record_states = False
                state = robot.receive_fresh_state()
                start = STARTS[where](state, first)
                farthest = max(farthest, distance(start, (state.q_c, state.pos_c, state.psi_c[0])))
                run(found, robot, name, start, next(leans))
                assert not robot.receive_fresh_state().errors
        # The controller's reference follows an arm that has yielded; only a client's own last command is then off it.
        assert farthest > SERVO_LENGTH if where == "own last command" else farthest < SERVO_LENGTH


def test_the_sequence_has_every_pair_of_modes() -> None:
    order = list(every_pair(list(MODES)))
    assert len(set(itertools.pairwise(order))) == len(MODES) ** 2 == len(order) - 1


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("where", STARTS)
def test_every_mode_begins_after_every_mode(where: str, plant: str) -> None:
    """The short version of the one in `tests/endurance`."""
    begin_in_every_mode(where, plant, ROUNDS)
