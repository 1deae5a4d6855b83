"""Guiding a Franka arm by hand: the buttons at its wrist, the axes that setGuidingMode frees, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from tests.peers.franka import programs, wire
from tests.peers.franka.arena import FciArena
from tests.peers.franka.robot import Output, Robot

FORCE = [8.0, 10.0, 6.0, 0.5, 0.4, 0.3]
FREE, HELD = (1,) * 6, (0,) * 6


def led(robot: Robot, place: FciArena, axes: tuple[int, ...], elbow: int) -> tuple[np.ndarray, float]:
    """Pushes a guided arm; returns how far the tool moved along and turned about the axes of the base, and joint 3."""
    assert robot.ask("set_guiding_mode", bytes((*axes, elbow))).status == "success"
    start = robot.state()
    assert place.simulate("guide", on=True)["ok"]
    robot.state_when(lambda state: state.robot_mode == wire.ROBOT_GUIDING)
    place.simulate("push", wrench=FORCE)
    state = robot.skip(500)
    place.simulate("release")
    assert place.simulate("guide", on=False)["ok"]
    robot.state_when(lambda state: state.robot_mode == wire.ROBOT_IDLE)
    T, S = (np.reshape(found.O_T_EE, (4, 4)).T for found in (state, start))
    R = T[:3, :3] @ S[:3, :3].T
    turn = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return np.abs(np.concatenate((T[:3, 3] - S[:3, 3], turn))), abs(state.q[2] - start.q[2])


def test_a_free_arm_yields_in_every_direction(toucher: Robot, felt: FciArena) -> None:
    way, elbow = led(toucher, felt, FREE, 1)
    assert np.linalg.norm(way[:3]) > 0.05
    assert np.linalg.norm(way[3:]) > 0.1
    assert elbow > 0.01


@pytest.mark.parametrize("axis", range(3))
def test_only_the_axes_that_are_free_move(toucher: Robot, felt: FciArena, axis: int) -> None:
    axes = tuple(int(k == axis) for k in range(6))
    way, _ = led(toucher, felt, axes, 1)
    assert way[axis] > 0.03
    held = np.delete(way, axis)
    assert (held[:2] < 0.01).all()  # 10 N against 3000 N/m, and what the light wrist adds.
    assert (held[2:] < 0.04).all()


def test_an_elbow_that_is_not_free_holds_joint_3(toucher: Robot, felt: FciArena) -> None:
    way, elbow = led(toucher, felt, FREE, 0)
    assert np.linalg.norm(way[:3]) > 0.03
    assert elbow < 0.01


def test_no_motion_begins_while_the_arm_is_guided_and_none_is_guided_in_a_motion(
    toucher: Robot, felt: FciArena
) -> None:
    assert felt.simulate("guide", on=True)["ok"]
    toucher.state_when(lambda state: state.robot_mode == wire.ROBOT_GUIDING)
    assert toucher.try_move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION) == "not possible"
    assert toucher.ask("stop_move").status == "not possible"
    assert toucher.ask("automatic_error_recovery").status == "not possible"
    assert toucher.ask("set_load", bytes(104)).status == "not possible"
    assert toucher.ask("set_guiding_mode", bytes(7)).status == "success"
    felt.simulate("guide", on=False)
    toucher.state_when(lambda state: state.robot_mode == wire.ROBOT_IDLE)
    start = toucher.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
    answer = felt.simulate("guide", on=True)
    assert not answer["ok"]
    assert answer["error"] == "the arm cannot be guided in phase moving; end its motion or clear its error"
    assert toucher.play(start, [Output(q=start.q_d)] * 5).status == "success"


def test_the_user_stop_ends_guiding(toucher: Robot, felt: FciArena) -> None:
    felt.simulate("guide", on=True)
    felt.simulate("push", wrench=FORCE)
    toucher.skip(200)
    felt.simulate("press", button="estop")
    toucher.state_when(lambda state: state.robot_mode == wire.ROBOT_USER_STOPPED and state.dq == programs.ZERO)
    felt.simulate("press", button="none")
    toucher.state_when(lambda state: state.robot_mode == wire.ROBOT_IDLE)
