"""The server on real sockets, with scripted clients: refusals, many clients, several arms."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from rcilab.makers.ufactory.controller.xarm_controller import XArmController
from rcilab.makers.virtual_controller import build_virtual_controller
from rcilab.sim.arm_server import ArmServer
from rcilab.sim.controller_config import ControllerConfig
from rcilab.sim.log_entry import LogEntry

GET_VERSION = bytes.fromhex("0001 0002 0001 01")
PATIENCE = 5.0  # [s]


class Server:
    """A controller whose cycles the test computes."""

    def __init__(self, host: str, model: str = "xArm6") -> None:
        self.entries: list[LogEntry] = []
        config = ControllerConfig(model=model, host=host, port=0, world_port=None, realtime=False)
        self.server: ArmServer = build_virtual_controller(config, log=self.entries.append)
        self.ports = {int(name): int(port) for name, port in re.findall(r"report_(\d+)=(\d+)", self.server.url)}
        self.host, self.port = self.server.host, int(self.server.url.split(":")[2].partition("?")[0])

    def connect(self, port: int | None = None) -> socket.socket:
        client = socket.create_connection((self.host, self.port if port is None else port), timeout=PATIENCE)
        self.server._poll(PATIENCE)
        return client

    @property
    def log(self) -> str:
        return "\n".join(entry.text for entry in self.entries)


@contextmanager
def running(host: str = "127.0.0.4", model: str = "xArm6") -> Iterator[Server]:
    server = Server(host, model)
    try:
        yield server
    finally:
        server.server.close()


@pytest.fixture
def server() -> Iterator[Server]:
    with running() as found:
        yield found


def test_a_request_is_answered_while_a_cycle_waits_for_its_time(server: Server) -> None:
    with server.connect() as client:
        client.sendall(GET_VERSION)
        server.server._step(server.server._clock.now() + 0.05)
        assert client.recv(100).startswith(bytes.fromhex("0001 0002 0025 01 10") + b"6,6,XI1304")


def test_a_client_that_speaks_another_protocol_is_disconnected(server: Server) -> None:
    with server.connect() as client, server.connect() as other:
        client.sendall(b"GET / HTTP/1.1\r\n\r\n")
        server.server._poll(PATIENCE)
        assert client.recv(100) == b""
        assert "not valid xArm protocol: protocol" in server.log + str(server.server._poll(0.0))
        other.sendall(GET_VERSION)
        server.server._poll(PATIENCE)
        assert other.recv(100)


def test_a_report_port_sends_at_once_and_ignores_what_it_receives(server: Server) -> None:
    with server.connect(server.ports[30003]) as client:
        assert len(client.recv(1000)) == 135
        client.sendall(b"anything")
        server.server._poll(PATIENCE)
        for _ in range(10):
            server.server._step(server.server._clock.now())
        assert len(client.recv(1000)) == 135


def test_a_client_too_many_is_refused(server: Server) -> None:
    clients = [server.connect() for _ in range(17)]
    assert clients[-1].recv(100) == b""
    clients[0].sendall(GET_VERSION)
    server.server._poll(PATIENCE)
    assert clients[0].recv(100)
    for client in clients:
        client.close()


def test_several_arms_have_an_address_each() -> None:
    with running("127.0.0.4") as first, running("127.0.0.5", "xArm7") as second:
        for server, name in ((first, b"6,6,"), (second, b"7,7,")):
            with server.connect() as client:
                client.sendall(GET_VERSION)
                server.server._poll(PATIENCE)
                assert client.recv(100)[8:12] == name


def test_without_clients_several_cycles_are_computed_after_one_wait(server: Server) -> None:
    loop = server.server
    loop._advance()
    loop._timer.restart(loop._clock.now())
    assert loop._is_unattended
    polls, cycle = loop._endpoint._polls, loop.controller.cycle_number
    loop._advance_unattended()
    assert loop._endpoint._polls == polls + 1
    assert loop.controller.cycle_number == cycle + 10
    with server.connect(server.ports[30003]):
        assert not loop._is_unattended


def test_a_motion_is_not_charged_with_cycles_that_were_missed_before_it(server: Server) -> None:
    """It begins between two cycles, as a request does that is served while none is computed."""
    loop, controller = server.server, server.server.controller
    assert isinstance(controller, XArmController)
    controller.enable(8, True)
    controller.set_mode(1)
    controller.set_state(0)
    loop._step(loop._clock.now())
    loop._timer.missed += 2000
    goal = [q + 0.01 for q in controller.arm.commanded.q]
    controller.follow(1, lambda planner: planner.follow_joints(goal, mode="linear"))
    moved = False
    for _ in range(2000):
        loop._step(loop._clock.now())
        moved = moved or controller.is_moving
        if moved and not controller.is_moving:
            break
    assert moved
    assert not controller.is_moving
    assert "longer than planned" not in server.log
