"""Datagrams of unknown senders at the client: they neither count as states nor keep it from those of the robot."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from rcilab.core.errors import ConnectionLostError
from rcilab.makers.rokae.driver import connection as module
from rcilab.makers.rokae.driver.address import parse_address
from rcilab.makers.rokae.driver.connection import SocketTransport

HOST, SIZE = "127.0.0.2", 1000


@dataclass
class Wire:
    transport: SocketTransport
    robot: socket.socket

    def send(self, sender: socket.socket, content: bytes, count: int = 1) -> None:
        for _ in range(count):
            sender.sendto(content.ljust(SIZE, b"."), self.transport.local_address)

    def received(self) -> list[bytes]:
        return [state.rstrip(b".") for state in self.transport.receive_states()]


@pytest.fixture
def wire() -> Iterator[Wire]:
    with socket.create_server((HOST, 0)) as listener, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        port = listener.getsockname()[1]
        robot.bind((HOST, port))
        transport = SocketTransport(parse_address(f"rci://{HOST}:{port}"), SIZE, 10.0)
        yield Wire(transport, robot)
        transport.close()


def sender(host: str) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bound.bind((host, 0))
    return bound


def test_a_flood_from_another_address_leaves_room_for_a_state(wire: Wire):
    with sender("127.0.0.9") as unknown:
        wire.send(unknown, b"unknown sender", 5000)
    wire.send(wire.robot, b"state")
    assert wire.received() == [b"state"]


def test_a_flood_from_the_robots_address_leaves_room_for_a_state(wire: Wire):
    with sender(HOST) as unknown:
        wire.send(unknown, b"unknown sender", 5000)
        wire.send(wire.robot, b"state")
        wire.send(unknown, b"unknown sender", 5000)
        wire.send(wire.robot, b"next")
    assert wire.received() == [b"state", b"next"]


def test_a_flood_leaves_room_for_a_robot_that_sends_from_another_port(wire: Wire):
    with sender(HOST) as robot, sender(HOST) as unknown:
        wire.send(robot, b"state")
        assert wire.received() == [b"state"]
        for host in (unknown, sender("127.0.0.9")):
            with host:
                wire.send(host, b"unknown sender", 5000)
        wire.send(robot, b"next")
        assert wire.received() == [b"next"]


def test_unknown_senders_are_ignored_before_the_socket_is_connected(monkeypatch: pytest.MonkeyPatch):
    """Between its bind and its connect, the socket of the robot's states takes anybody's datagrams."""
    with socket.create_server((HOST, 0)) as listener, sender("127.0.0.9") as unknown:
        port = listener.getsockname()[1]
        connect = socket.socket.connect

        def connect_late(sock: socket.socket, place: tuple[str, int]) -> None:
            if sock.type == socket.SOCK_DGRAM and place[1] == port and sock.getsockname()[1] == port:
                unknown.sendto(bytes(SIZE), sock.getsockname())
            connect(sock, place)

        monkeypatch.setattr(module.socket.socket, "connect", connect_late)
        transport = SocketTransport(parse_address(f"rci://{HOST}:{port}"), SIZE, 10.0)
        assert transport.receive_states() == []
        transport.close()


def test_a_second_client_of_the_same_robot_finds_the_port_taken(wire: Wire):
    with pytest.raises(ConnectionLostError, match="already listens"):
        SocketTransport(wire.transport.address, SIZE, 10.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with pytest.raises(OSError, match="in use"):
            other.bind(wire.transport.local_address)


def test_the_robots_port_counts_and_no_other_once_a_state_came_from_there(wire: Wire):
    with sender(HOST) as unknown:
        wire.send(unknown, b"first")
        assert wire.received() == [b"first"], "nothing has come from where commands go"
        wire.send(wire.robot, b"state")
        wire.send(unknown, b"unknown sender")
        wire.send(wire.robot, b"next")
        assert wire.received() == [b"state", b"next"]
        wire.send(unknown, b"unknown sender")
        assert wire.received() == []


def test_a_robot_that_sends_from_another_port_is_received(wire: Wire):
    with sender(HOST) as robot, sender(HOST) as unknown:
        for sock in (robot, unknown, robot):
            wire.send(sock, b"state")
    assert wire.received() == [b"state", b"state"]


def test_a_flood_from_the_robots_own_address_does_not_keep_the_caller(wire: Wire, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(module, "_DATAGRAMS_AT_ONCE", 8)
    wire.send(wire.robot, b"state", 20)
    assert [len(wire.received()) for _ in range(4)] == [8, 8, 4, 0]
