"""Waiting at the sockets of a client library: what is no new state of the robot is dropped, and loss is reported."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

import pytest

from rcilab.core.errors import ConnectionLostError
from rcilab.makers.franka.driver.call_limit import CallLimit
from rcilab.makers.franka.driver.client_sockets import ClientSockets, open_with_sockets

SIZE = 40


class Ends:
    """A robot and a client's sockets, connected over loopback."""

    def __init__(self) -> None:
        with socket.create_server(("127.0.0.1", 0)) as listener:
            self.port = listener.getsockname()[1]
            self.tcp = socket.create_connection(listener.getsockname())
            self.robot, _ = listener.accept()
        self.udp = socket.socket(type=socket.SOCK_DGRAM)
        self.udp.bind(("0.0.0.0", 0))
        self.sender = socket.socket(type=socket.SOCK_DGRAM)
        self.sender.bind(("127.0.0.1", 0))

    def send(self, number: int, size: int = SIZE, sender: socket.socket | None = None) -> None:
        datagram = struct.pack("<Q", number) + bytes(size - 8)
        (sender or self.sender).sendto(datagram, ("127.0.0.1", self.udp.getsockname()[1]))

    def close(self) -> None:
        for sock in (self.tcp, self.robot, self.udp, self.sender):
            sock.close()


@pytest.fixture
def ends() -> Iterator[Ends]:
    made = Ends()
    yield made
    made.close()


@pytest.fixture
def sockets(ends: Ends) -> Iterator[ClientSockets]:
    limit = CallLimit("127.0.0.1", ends.port)
    made = ClientSockets(limit, ends.tcp.dup(), ends.udp.dup(), SIZE, "fci://robot")
    yield made
    made.close()


def test_a_new_state_stays_for_the_library(ends: Ends, sockets: ClientSockets):
    ends.send(8)
    assert sockets.wait_for_state(7, 1.0)
    assert struct.unpack_from("<Q", ends.udp.recv(100))[0] == 8
    assert not sockets.wait_for_state(7, 0.0)


def test_states_that_repeat_and_datagrams_that_are_none_are_dropped(ends: Ends, sockets: ClientSockets):
    with socket.socket(type=socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.9", 0))
        ends.send(7)
        ends.send(9, size=SIZE - 1)
        ends.send(9, size=SIZE + 1)
        ends.send(9, sender=stranger)
        assert not sockets.wait_for_state(7, 0.0)
        ends.send(8)
        assert sockets.wait_for_state(7, 1.0)
    assert struct.unpack_from("<Q", ends.udp.recv(100))[0] == 8


def test_a_connection_that_the_robot_closes_is_lost_after_its_last_state(ends: Ends, sockets: ClientSockets):
    sockets.require_open()
    ends.send(8)
    ends.robot.close()
    assert sockets.wait_for_state(7, 1.0)
    ends.udp.recv(100)
    with pytest.raises(ConnectionLostError, match="fci://robot: the connection is lost"):
        sockets.wait_for_state(8, 1.0)
    with pytest.raises(ConnectionLostError):
        sockets.require_open()


def test_the_sockets_that_a_client_opens_are_found_among_others(ends: Ends):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()

        def open_client() -> tuple[socket.socket, socket.socket]:
            udp = socket.socket(type=socket.SOCK_DGRAM)
            udp.bind(("0.0.0.0", 0))
            return socket.create_connection(address), udp

        (tcp, udp), found = open_with_sockets(open_client, SIZE, address, "fci://robot", 5.0)
        robot, _ = listener.accept()
        with tcp, udp, robot, socket.socket(type=socket.SOCK_DGRAM) as sender:
            sender.bind(("127.0.0.1", 0))
            sender.sendto(struct.pack("<Q", 1) + bytes(SIZE - 8), ("127.0.0.1", udp.getsockname()[1]))
            assert found.wait_for_state(0, 1.0)
            found.abort()
            assert robot.recv(1) == b""
            found.close()
    with pytest.raises(ConnectionLostError, match="the client library is not connected"):
        open_with_sockets(lambda: None, SIZE, ("127.0.0.1", 1337), "fci://robot", 5.0)
