"""The pushed states of a connection: taken from the controller alone, counted, and refused if they are not valid."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.core.errors import DecodeError
from rcilab.core.state import RobotMode
from rcilab.makers.network import HostRoute
from rcilab.makers.realman.controller.push import encode_push
from rcilab.makers.realman.driver.push_receiver import PushReceiver
from rcilab.makers.realman.driver.state_reader import StateReader
from rcilab.makers.realman.errors import RealManError, errors_of_codes
from rcilab.makers.realman.wire.pushed_state import decode_push
from tests.makers.realman.controller.bench import Bench

PUSHED = encode_push(Bench().controller, "127.0.0.1")


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, PushReceiver]]:
    receiver = PushReceiver(HostRoute("127.0.0.1", "127.0.0.1"), 6, "arm")
    with socket.socket(type=socket.SOCK_DGRAM) as controller:
        controller.connect(("127.0.0.1", receiver.port))
        yield controller, receiver
    receiver.close()


def test_every_state_counts_5_ms(ends):
    controller, receiver = ends
    for _ in range(3):
        controller.send(PUSHED)
    assert [number for number, _ in receiver.poll(1.0)] == [5, 10, 15]
    controller.send(b"{}")
    controller.send(PUSHED)
    assert [number for number, _ in receiver.poll(1.0)] == [20]
    assert receiver.poll(0.0) == []


def test_states_of_another_host_are_not_taken(ends):
    _, receiver = ends
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.9", 0))
        other.sendto(PUSHED, ("127.0.0.1", receiver.port))
    assert receiver.poll(0.05) == []


def test_a_state_that_repeats_has_the_same_arrays(ends):
    controller, receiver = ends
    controller.send(PUSHED)
    controller.send(PUSHED)
    reader = StateReader(6)
    first, second = (reader.read(numbered, is_streaming=False) for numbered in receiver.poll(1.0))
    assert second.message_id == first.message_id + 5
    assert (second.q is first.q, second.T_base_tool is first.T_base_tool) == (True, True)


@pytest.mark.parametrize(
    ("change", "mode"),
    [
        ({}, RobotMode.IDLE),
        ({"arm_current_status": "move_L"}, RobotMode.MOVE),
        ({"arm_current_status": "stop"}, RobotMode.USER_STOPPED),
        ({"err": [0x100D]}, RobotMode.REFLEX),
        ({"err": [0x1010]}, RobotMode.IDLE),
    ],
)
def test_what_the_arm_does_is_its_mode(ends, change, mode):
    controller, receiver = ends
    controller.send(json.dumps({**json.loads(PUSHED), **change}).encode())
    (numbered,) = receiver.poll(1.0)
    assert StateReader(6).read(numbered, is_streaming=False).robot_mode is mode


def test_errors_of_system_and_joints_are_known_by_their_numbers():
    assert errors_of_codes([0, 0x1002, 0x7777], [0, 0x4200]) == (
        RealManError.TARGET_OVER_LIMIT,
        RealManError.JOINT_POSITION_LIMIT,
        RealManError.JOINT_POSITION_STEP,
    )
    assert max(RealManError) < 64  # Records keep them as bits.


@given(st.binary(max_size=200) | st.builds(lambda i, b: PUSHED[:i] + b + PUSHED[i:], st.integers(0, 900), st.binary()))
def test_any_datagram_is_a_state_or_an_error(datagram):
    try:
        assert len(decode_push(datagram, 6).joint_status.joint_position) == 6
    except DecodeError:
        pass
