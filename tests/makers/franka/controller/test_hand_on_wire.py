"""The hand over its own sockets, beside the arm: its commands, its states, and bytes that are no request."""

from __future__ import annotations

import math
import socket
import struct
from collections.abc import Iterator

import pytest

from rcilab.core.errors import UsageError
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.sim.controller_config import ControllerConfig
from tests.peers.franka import hand as wire
from tests.peers.franka import programs
from tests.peers.franka.arena import FciArena
from tests.peers.franka.hand import Hand
from tests.peers.franka.robot import PATIENCE, Robot


@pytest.fixture
def hand(place: FciArena) -> Iterator[Hand]:
    with place.connect_hand() as client:
        client.ask(wire.MOVE, 0.08, 0.2)
        client.ask(wire.STOP)
        yield client


def test_connect_names_the_version_and_states_follow(hand: Hand) -> None:
    assert (hand.status, hand.server_version) == (0, 3)
    first = hand.state()
    assert first.width == pytest.approx(0.08)
    assert first.temperature > 0
    assert hand.state().number > first.number


def test_another_version_is_refused(place: FciArena) -> None:
    with place.connect_hand(version=2) as hand:
        assert (hand.status, hand.server_version) == (1, 3)
        with pytest.raises(ConnectionResetError):
            hand.ask(wire.HOMING)
    assert "refused a client of the hand of version 2: this hand has version 3" in place.log("refused")
    with place.connect_hand() as good:
        assert good.status == 0


def test_fingers_move_at_their_speed_and_answer_at_the_end(hand: Hand) -> None:
    start = hand.state()
    request = hand.send(wire.MOVE, struct.pack("<2d", 0.06, 0.1))
    assert hand.response() == (request, "success")
    end = hand.state()
    assert end.width == pytest.approx(0.06)
    assert end.number - start.number >= 200  # [ms] 20 mm at 0.1 m/s.
    assert not end.is_grasped


def test_homing_finds_the_largest_width(hand: Hand, place: FciArena) -> None:
    server = place.arena.server._server
    request = hand.send(wire.HOMING)
    hand.state()
    place.between(lambda: [server._hand.step() for _ in range(3300)])
    assert hand.response() == (request, "success")
    assert hand.state().max_width == pytest.approx(0.08)


def test_a_grasp_holds_an_object_of_its_width_and_fails_without_one(hand: Hand, place: FciArena) -> None:
    fingers = place.arena.server._server._hand.hand
    assert hand.ask(wire.GRASP, 0.06, 0.005, 0.005, 0.2, 40.0) == "success"
    assert hand.state().is_grasped
    assert hand.ask(wire.STOP) == "success"
    assert not hand.state().is_grasped
    fingers.object_width = 0.0
    try:
        assert hand.ask(wire.GRASP, 0.05, 0.005, 0.005, 0.2, 40.0) == "unsuccessful"
    finally:
        fingers.object_width = None
    assert hand.state().width == pytest.approx(0.0)


def test_fingers_that_are_closer_than_the_object_close_without_it(hand: Hand) -> None:
    assert hand.ask(wire.MOVE, 0.01, 0.2) == "success"
    assert hand.ask(wire.GRASP, 0.03, 0.005, 0.005, 0.2, 40.0) == "unsuccessful"
    state = hand.state()
    assert (state.width, state.is_grasped) == (pytest.approx(0.0), False)


def test_a_command_is_aborted_by_the_next_one(hand: Hand) -> None:
    first = hand.send(wire.MOVE, struct.pack("<2d", 0.0, 0.01))
    second = hand.send(wire.STOP)
    assert [hand.response(), hand.response()] == [(first, "aborted"), (second, "success")]
    width = hand.state().width
    assert width > 0.07


@pytest.mark.parametrize(
    "values", [(0.09, 0.1), (-0.01, 0.1), (0.05, 0.0), (0.05, -1.0), (math.nan, 0.1), (0.05, math.inf)]
)
def test_a_width_or_speed_out_of_range_fails_and_moves_nothing(hand: Hand, values: tuple[float, float]) -> None:
    before = hand.state()
    assert hand.ask(wire.MOVE, *values) == "fail"
    assert hand.state().width == before.width


@pytest.mark.parametrize("epsilon", [math.nan, -0.005])
def test_a_grasp_with_an_impossible_tolerance_fails_and_moves_nothing(hand: Hand, epsilon: float) -> None:
    before = hand.state()
    for tolerances in ((epsilon, 0.005), (0.005, epsilon)):
        assert hand.ask(wire.GRASP, 0.06, *tolerances, 0.2, 40.0) == "fail"
    assert hand.state().width == before.width


@pytest.mark.parametrize(
    "data", [b"\0" * 3, struct.pack("<HII", 9, 1, 10), struct.pack("<HII", 2, 1, 10), struct.pack("<HII", 1, 1, 2**31)]
)
def test_bytes_that_are_no_request_end_the_connection_of_the_hand_alone(
    place: FciArena, robot: Robot, data: bytes
) -> None:
    start = robot.move(0, 0)
    with socket.create_connection((place.arena.host, place.hand_port), timeout=PATIENCE) as tcp:
        tcp.sendall(data)
        tcp.shutdown(socket.SHUT_WR)
        try:
            assert tcp.recv(100) == b""
        except ConnectionResetError:
            pass
    program = programs.motion(start, 0)
    assert robot.play(robot.state(), program, cycles=201).status == "success"
    with place.connect_hand() as hand:
        assert hand.status == 0


def test_arm_and_hand_are_commanded_at_the_same_time(robot: Robot, hand: Hand) -> None:
    start = robot.move(0, 0)
    request = hand.send(wire.MOVE, struct.pack("<2d", 0.07, 0.1))
    assert robot.play(start, programs.motion(start, 0), cycles=201).status == "success"
    assert hand.response() == (request, "success")


def test_a_second_client_of_the_hand_is_refused(place: FciArena, hand: Hand) -> None:
    with pytest.raises((ConnectionResetError, BrokenPipeError)):
        place.connect_hand()
    assert hand.ask(wire.STOP) == "success"


def test_the_arm_does_not_listen_on_the_port_of_the_hand() -> None:
    with pytest.raises(UsageError, match="--port 1338 is where clients expect the hand; choose another"):
        build_virtual_controller(ControllerConfig(model="Panda", host="127.0.0.5", port=1338))
