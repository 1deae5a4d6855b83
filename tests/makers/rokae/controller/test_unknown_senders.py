"""Data of unknown senders has no effect, and log lines that are not read do not block the controller."""

from __future__ import annotations

import logging
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import numpy as np
import pytest

from rcilab.control_process.simulate import simulate
from rcilab.execution.session import RobotSession
from rcilab.makers.rokae import wire as rci
from rcilab.model.robot_model import load_model
from rcilab.motion import plan_joint
from rcilab.sim import log_lines
from rcilab.sim.channels import LOWEST_CLIENT_PORT
from rcilab.sim.log_entry import LogEntry
from rcilab.sim.log_lines import ControllerLog, LogHandler, LogLines
from tests.makers.rokae.controller.test_server import PATIENCE, Peer, Running, bind_udp, running
from tests.waiting import wait_for

MODEL = load_model("xMatePro7")


def absurd(message_id: int) -> bytes:
    """A command that no arm can follow."""
    return rci.encode_command(rci.CommandPacket(message_id, (1.0,) * 7))


@contextmanager
def stranger(host: str, robot: RobotSession) -> Iterator[Callable[[bytes], object]]:
    """Sends datagrams from another address or port to the robot's command port."""
    at, _, port = robot.address.removeprefix("rci://").split("?")[0].partition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind((host, 0))
        yield lambda datagram: udp.sendto(datagram, (at, int(port)))


@pytest.mark.parametrize("host", ["127.0.0.9", "127.0.0.1"], ids=["another address", "another port"])
def test_commands_of_an_unknown_sender_do_not_end_a_motion_and_are_counted(host):
    with simulate(MODEL) as robot, stranger(host, robot) as send:
        robot.power_on()
        motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.1)
        sent = []

        def tell(t, duration):
            if t == 0.0:  # The client has not sent anything yet: its port is not learned.
                return
            send(absurd(robot.state.message_id))
            sent.append(t)

        run = robot.execute(motion, progress=tell)
        assert run.faults == ()
        assert np.array_equal(robot.state.q_c, motion.goal)
        assert sent
        assert 1 <= robot.world.status().unknown_senders <= len(sent)


@pytest.mark.parametrize("host", ["127.0.0.9", "127.0.0.1"], ids=["another address", "another port"])
def test_a_flood_of_an_unknown_sender_leaves_room_for_commands(host):
    """From the first command on; it comes while the controller does not know yet which port the client sends from."""
    with simulate(MODEL) as robot, stranger(host, robot) as send:
        robot.power_on()
        send_command = robot._driver.connection._transport.send_command

        def flood_and_send(datagram: bytes) -> None:
            for _ in range(2000):  # More than the buffer holds.
                send(bytes(1000))
            send_command(datagram)

        robot._driver.connection._transport.send_command = flood_and_send
        run = robot.execute(plan_joint(MODEL, MODEL.home, MODEL.home + 0.01))
        assert run.faults == ()
        assert robot.world.status().unknown_senders > 0


class FloodedPeer(Peer):
    """Sends its commands from a socket of choice, each after more of unknown senders than a buffer holds."""

    def __init__(self, found: Running, unknown_senders: list[socket.socket]) -> None:
        super().__init__(found, udp=bind_udp(0, "127.0.0.1"))
        self.sender = self.udp
        self.unknown_senders = unknown_senders

    def direct_states_to(self, udp: socket.socket) -> None:
        assert self.ask(rci.Connect(udp.getsockname()[1])) == 0
        self.udp, old = udp, self.udp
        old.close()

    def send(self, message_id: int, q: np.ndarray) -> None:
        for _ in range(1000):
            for unknown in self.unknown_senders:
                unknown.sendto(bytes(290), self.controller)
        self.sender.sendto(rci.encode_command(rci.CommandPacket(message_id, tuple(q.tolist()))), self.controller)

    def hold(self, cycles: int) -> None:
        self.run(np.tile(MODEL.home, (cycles, 1)))
        assert self.ask(rci.StopMove()) is rci.StopStatus.SUCCESS


def test_a_client_is_heard_in_a_flood_wherever_it_sends_from_and_when_its_port_changes():
    with (
        bind_udp(0, "127.0.0.1") as other_port, bind_udp(0, "127.0.0.1") as next_port,
        bind_udp(0, "127.0.0.9") as unknown, bind_udp(0, "127.0.0.1") as neighbour,
        running(lockstep=True) as found, FloodedPeer(found, []) as peer,
    ):  # fmt: skip
        peer.direct_states_to(bind_udp(0, "127.0.0.1"))
        peer.sender = other_port
        peer.hold(1)
        peer.unknown_senders = [unknown, neighbour]
        peer.hold(20)
        peer.sender = peer.udp
        peer.hold(20)
        peer.direct_states_to(next_port)
        peer.sender = next_port
        peer.hold(20)
        assert found.server.controller.playout.lost == 0
        assert found.server.bad_datagrams == 0


def test_the_client_that_is_named_at_the_start_is_heard_in_a_flood():
    with bind_udp(0, "127.0.0.1") as udp, bind_udp(0, "127.0.0.9") as unknown:
        port = udp.getsockname()[1]
        with running(lockstep=True, client_host="127.0.0.1", client_port=port) as found:
            for _ in range(2):  # The second time, too: it is kept when the client leaves.
                with FloodedPeer(found, [unknown]) as peer:
                    peer.udp.close()
                    peer.udp = peer.sender = udp.dup()
                    peer.udp.settimeout(PATIENCE)
                    peer.hold(20)
            assert found.server.bad_datagrams == 0


def test_unknown_senders_before_a_socket_is_connected_are_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between its bind and its connect, the socket of the client's commands takes anybody's datagrams."""
    connect = socket.socket.connect
    with running(lockstep=True) as found, bind_udp(0, "127.0.0.9") as unknown:

        def connect_late(sock: socket.socket, place: tuple[str, int]) -> None:
            if sock.type == socket.SOCK_DGRAM and sock.getsockname() == (found.host, found.port):
                unknown.sendto(absurd(1), (found.host, found.port))
            connect(sock, place)

        monkeypatch.setattr(socket.socket, "connect", connect_late)
        with Peer(found, udp=bind_udp(found.port, "127.0.0.1")) as peer:
            peer.receive_state()
            assert found.server._endpoint.unknown_senders == 1
            assert found.server.bad_datagrams == 0


def test_a_flood_does_not_keep_the_controller_from_its_cycles() -> None:
    """Once the client's commands have a socket of their own, few of the unknown senders' are read at a time."""
    with running(lockstep=True) as found, bind_udp(0, "127.0.0.9") as unknown, FloodedPeer(found, []) as peer:
        peer.direct_states_to(bind_udp(0, "127.0.0.1"))
        peer.sender = peer.udp
        peer.hold(1)
        before = found.server._endpoint.unknown_senders
        peer.unknown_senders = [unknown]
        peer.hold(20)
        cycles = found.server.controller.playout
        assert 0 < found.server._endpoint.unknown_senders - before < 64 * 20, cycles


def test_unknown_senders_are_counted_again_for_the_next_client():
    with running() as found, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.9", 0))
        endpoint = found.server._endpoint
        for _ in range(2):
            with socket.create_connection((found.host, found.port)):
                wait_for(lambda: endpoint.peers, 30.0, "a client")
                wanted = endpoint.unknown_senders + 1000

                def is_counted(wanted: int = wanted) -> bool:
                    for _ in range(100):
                        udp.sendto(b"x", (found.host, found.port))
                    return endpoint.unknown_senders >= wanted

                wait_for(is_counted, 30.0, "unknown senders to be counted")
            wait_for(lambda: not endpoint.peers, 30.0, "the client to leave")


def test_a_connect_request_is_for_its_own_connection_and_for_ports_of_programs():
    with simulate(MODEL) as robot, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        for port in (0, 9, LOWEST_CLIENT_PORT - 1):
            answer = robot._driver.connection.request(rci.Connect(port))
            assert answer.status is rci.SettingStatus.INVALID_ARGUMENT
            assert robot.receive_states(), "they still come here"
        udp.bind((robot._driver.connection.local_address[0], 0))
        udp.settimeout(10.0)
        robot._driver.connection.request(rci.Connect(udp.getsockname()[1]))
        assert len(udp.recv(2000)) == rci.STATE_SIZE


def test_what_anybody_can_cause_is_written_once_in_a_while_and_summed_up():
    entries, now = [], 100.0
    log = ControllerLog(entries.append, lambda: now, lambda: 7)
    for number in range(1000):
        log.write("client_dropped", f"the client left {number}")
    log.write("refused", "another kind")
    assert [entry.text for entry in entries] == [*(f"the client left {number}" for number in range(5)), "another kind"]
    now += 60.0
    log.write_counts()
    assert [entry.text for entry in entries[6:]] == ["995 more clients were dropped within 10 s"]
    assert entries[6].facts == {"count": 995}
    for number in range(30):
        log.write("refused", f"refused {number}")
    assert [entry.text for entry in entries[7:]] == [f"refused {number}" for number in range(20)]


def test_a_client_that_is_refused_again_and_again_fills_no_log(monkeypatch):
    monkeypatch.setattr(log_lines, "_PERIOD", 3.0)
    with running() as found, Peer(found) as client:
        for _ in range(100):
            assert client.ask(rci.SetMotorPower(7)) != 0
        found.wait_for_line("80 more requests were refused within 3 s")
    assert len(found.lines) == 21


@pytest.mark.parametrize("sent", [b"oops, a line of text", struct.pack("<HHH", 10, 1, 999) + bytes(4)])
def test_connections_that_speak_no_rci_are_summed_up(sent):
    with running() as found:
        for _ in range(30):
            with socket.create_connection((found.host, found.port), timeout=30.0) as link:
                link.sendall(sent)
                with suppress(ConnectionResetError):
                    while link.recv(4096):
                        pass
        found.wait_for_line("not valid RCI")
    assert len(found.lines) == 5


def test_lines_that_are_not_read_are_dropped_and_counted_and_do_not_block():
    reader, writer = os.pipe()
    lines = LogLines(writer)

    def entry(text: str) -> LogEntry:
        return LogEntry(kind="refused", text=text, cycle=1234, wall=0.0)

    began = time.monotonic()
    for number in range(20_000):
        lines.write(entry(f"line {number} " + "x" * 100))
    assert time.monotonic() - began < 5.0, "a pipe takes 64 kB, and then waits for ever"
    time.sleep(0.2)
    with os.fdopen(reader, "rb", buffering=0) as stream:
        said = b""
        while b"lines were dropped" not in said:
            said += stream.read(65536)
            lines.write(entry("the last one"))
        lines.close()
    assert re.match(rb"rcilab controller: \d\d:\d\d:\d\d\.\d\d\d 1\.234 s line 0 ", said)


def test_a_controller_whose_stderr_is_never_read_goes_on_and_ends_when_it_is_told_to():
    command = [sys.executable, "-m", "rcilab.cli", "controller", "--model", "xMatePro7", "--port", "0", "--lockstep"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        line = process.stdout.readline()
        host, port = line.split()[1].removeprefix("rci://").split("?")[0].split(":")
        with socket.create_connection((host, int(port))):
            for _ in range(800):  # Each is refused; a line for each would fill the pipe, and the controller would wait.
                socket.create_connection((host, int(port))).close()
                time.sleep(2e-3)  # It takes one at a time; a queue that is full costs a second.
            process.send_signal(signal.SIGINT)
            assert process.wait(20.0) in (0, 130, -signal.SIGINT)


def test_what_the_simulation_finds_odd_goes_the_way_of_all_lines(capfd: pytest.CaptureFixture[str]) -> None:
    """A warning of MuJoCo comes in the middle of a cycle."""
    entries: list[LogEntry] = []
    handler = LogHandler(ControllerLog(entries.append, lambda: 0.0, lambda: 0))
    log = logging.getLogger("rcilab.sim")
    log.addHandler(handler)
    try:
        log.warning("MuJoCo: %s", "odd")
    finally:
        log.removeHandler(handler)
    assert [(entry.kind, entry.text) for entry in entries] == [("warning", "MuJoCo: odd")]
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("files", [5, 6])
def test_a_controller_with_too_few_descriptors_says_so_in_one_sentence(files: int) -> None:
    """Too few for its sockets, or for what it reads once they are open."""
    limited = f"import resource, runpy; resource.setrlimit(resource.RLIMIT_NOFILE, ({files}, {files})); "
    start = "runpy.run_module('rcilab', run_name='__main__', alter_sys=True)"
    done = subprocess.run(
        [sys.executable, "-c", limited + start, "controller", "--model", "xMatePro7", "--port", "0"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == (
        "rcilab: the limit of open files is too low; close other programs or raise it: ulimit -n 256\n"
    )
