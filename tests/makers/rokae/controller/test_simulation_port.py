"""The simulation port on real sockets: who gets through, what it does to a controller that runs, and what faults do."""

from __future__ import annotations

import json
import os
import select
import socket
import struct
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, UsageError
from rcilab.core.state import RobotMode
from rcilab.execution.simulation_control import SimulationControl
from rcilab.makers.rokae import wire as rci
from rcilab.sim.api import LONGEST_LINE, Done, NetworkFaults, Stall, WorldRequest
from rcilab.sim.peer_user import is_allowed_peer
from rcilab.sim.simulation_port import MAX_CLIENTS, SimulationPort
from tests.makers.rokae.controller.test_server import MODEL, MOTION, PATIENCE, Peer, Running, bind_udp, closes, running


class Guest:
    """A raw connection to the simulation port."""

    def __init__(self, found: Running) -> None:
        assert found.server.world_address is not None
        host, _, port = found.server.world_address.partition(":")
        self.socket = socket.create_connection((host, int(port)), timeout=PATIENCE)
        self.stream = self.socket.makefile("rb")

    def __enter__(self) -> Guest:
        return self

    def __exit__(self, *_: object) -> None:
        self.stream.close()
        self.socket.close()

    def ask(self, **content: object) -> dict:
        self.socket.sendall(json.dumps({"id": 7, **content}).encode() + b"\n")
        answer = json.loads(self.stream.readline())
        assert answer["id"] == 7
        return answer

    def is_cut_off(self) -> bool:
        try:
            return self.stream.read() == b""
        except ConnectionResetError:
            return True


@pytest.fixture
def lockstep() -> Iterator[Running]:
    with running(lockstep=True) as found:
        yield found


def test_the_status_says_what_the_state_does_not(lockstep: Running) -> None:
    with Guest(lockstep) as guest:
        answer = guest.ask(request="status")
    assert answer["ok"] is True
    status = answer["status"]
    assert (status["model"], status["plant"], status["phase"]) == ("xMatePro7", "ideal", "off")
    assert status["q"] == MODEL.home.tolist()
    assert status["commands"] == NetworkFaults().as_dict()


def test_a_web_page_gets_nowhere(lockstep: Running) -> None:
    body = b'{"request":"press","button":"estop"}\n'
    head = b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n" % len(body)
    with Guest(lockstep) as guest:
        guest.socket.sendall(head + body)
        answer = json.loads(guest.stream.readline())
        assert answer["ok"] is False
        assert guest.is_cut_off()
    with Guest(lockstep) as guest:
        assert guest.ask(request="status")["status"]["button"] == "none"


@pytest.mark.parametrize("line", [b"\n", b"[]\n", b'{"id":-1}\n', b"\x00" * (LONGEST_LINE + 4000)])
def test_a_line_that_is_no_request_ends_the_connection_after_one_answer(lockstep: Running, line: bytes) -> None:
    with Guest(lockstep) as guest:
        guest.socket.sendall(line)
        assert json.loads(guest.stream.readline())["ok"] is False
        assert guest.is_cut_off()


def test_a_wrong_request_is_refused_by_its_id_and_the_next_one_is_heard(lockstep: Running) -> None:
    with Guest(lockstep) as guest:
        guest.socket.sendall(b'{"id":5,"request":"explode"}\n{"id":6,"request":"release"}\n')
        refused, done = (json.loads(guest.stream.readline()) for _ in range(2))
    assert (refused["id"], refused["ok"]) == (5, False)
    assert "unknown request 'explode'" in refused["error"]
    assert done == {"id": 6, "ok": True}


def test_requests_in_pieces_and_several_at_once_are_answered_in_order(lockstep: Running) -> None:
    lines = b"".join(json.dumps({"id": k, "request": "release"}).encode() + b"\n" for k in range(5))
    with Guest(lockstep) as guest:
        for start in range(0, len(lines), 11):
            guest.socket.sendall(lines[start : start + 11])
        assert [json.loads(guest.stream.readline()) for _ in range(5)] == [{"id": k, "ok": True} for k in range(5)]


def test_of_many_requests_at_once_one_is_handled_at_a_time() -> None:
    """The cycle of the arm waits for as long as requests are handled."""
    handled: list[WorldRequest] = []
    port = SimulationPort("127.0.0.2", 0, lambda request: (handled.append(request), Done())[1])
    with socket.create_connection(port.address) as guest:
        guest.sendall(b'{"id":1,"request":"release"}\n' * 100)
        time.sleep(0.05)
        port.serve(port.sockets)  # Accepts.
        for count in (1, 2, 3):
            port.serve(select.select(port.sockets, (), (), PATIENCE)[0])
            assert len(handled) == count
    port.close()


def test_what_cannot_be_done_is_refused_and_the_connection_stays(lockstep: Running) -> None:
    with Guest(lockstep) as guest:
        answer = guest.ask(request="floor", on=True)
        assert answer["ok"] is False
        assert "plant='mujoco'" in answer["error"]
        assert guest.ask(request="release") == {"id": 7, "ok": True}


def test_eight_guests_are_welcome_and_the_ninth_is_not(lockstep: Running) -> None:
    guests = [Guest(lockstep) for _ in range(8)]
    try:
        for guest in guests:
            guest.ask(request="status")
        with Guest(lockstep) as ninth:
            answer = json.loads(ninth.stream.readline())
            assert answer["ok"] is False
            assert "all 8 connections of the simulation port are in use" in answer["error"]
            assert "60 s" in answer["error"]
            assert ninth.is_cut_off()
        guests.pop().__exit__()
        guests[0].ask(request="status")
        guests.append(Guest(lockstep))
        assert guests[-1].ask(request="status")["ok"]
    finally:
        for guest in guests:
            guest.__exit__()


def test_who_holds_a_place_and_says_nothing_gives_it_to_the_next_and_comes_back(
    lockstep: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rcilab.sim.simulation_port.IDLE_TIMEOUT", 0.05)
    assert lockstep.server.world_address is not None
    host, _, port = lockstep.server.world_address.partition(":")
    with SimulationControl(host, int(port)) as world, ExitStack() as stack:
        assert world.status().phase == "off"
        idle = [stack.enter_context(Guest(lockstep)) for _ in range(MAX_CLIENTS - 1)]
        assert all(guest.ask(request="status")["ok"] for guest in idle)
        time.sleep(0.1)
        for _ in range(2 * MAX_CLIENTS):
            with Guest(lockstep) as guest:
                assert guest.ask(request="status")["ok"]
        assert world.status().phase == "off", "it has connected again by itself"


def ask_as_another_user(found: Running) -> dict:
    """What another account of this machine is answered when it presses the emergency stop."""
    assert found.server.world_address is not None
    host, _, port = found.server.world_address.partition(":")
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setuid(65534)
            with socket.create_connection((host, int(port)), timeout=PATIENCE) as link:
                link.sendall(b'{"id": 1, "request": "press", "button": "estop"}\n')
                said = b""
                with suppress(ConnectionResetError):
                    while part := link.recv(4096):
                        said += part
                os.write(writing, said)
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        return json.loads(stream.read())


def test_who_finds_all_places_taken_is_told_so_in_words_and_comes_in_later(lockstep: Running) -> None:
    assert lockstep.server.world_address is not None
    host, _, port = lockstep.server.world_address.partition(":")
    with SimulationControl(host, int(port)) as world, ExitStack() as stack:
        guests = [stack.enter_context(Guest(lockstep)) for _ in range(MAX_CLIENTS)]
        assert all(guest.ask(request="status")["ok"] for guest in guests)
        for _ in range(3):
            with pytest.raises(
                UsageError, match=r"all 8 connections of the simulation port are in use.* idle for 60 s"
            ) as caught:
                world.status()
            assert caught.value.code == "world_full"
        guests[0].__exit__()
        guests[1].ask(request="status")
        assert world.status().phase == "off"


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
def test_another_account_takes_no_place_from_a_guest_that_is_silent(
    lockstep: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rcilab.sim.simulation_port.IDLE_TIMEOUT", 0.05)
    with ExitStack() as stack:
        guests = [stack.enter_context(Guest(lockstep)) for _ in range(MAX_CLIENTS)]
        assert all(guest.ask(request="status")["ok"] for guest in guests)
        time.sleep(0.1)
        answer = ask_as_another_user(lockstep)
        assert "for the user who started the controller" in answer["error"]
        assert all(guest.ask(request="status")["ok"] for guest in guests)


def test_guests_that_are_gone_before_they_are_looked_at_disturb_nobody(lockstep: Running) -> None:
    """A reset connection has no other end any more."""
    for _ in range(50):
        with Guest(lockstep) as guest:
            guest.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    with Guest(lockstep) as guest:
        assert guest.ask(request="status")["ok"]


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize(("user", "stays", "allowed"), [(0, True, True), (65534, True, False), (65534, False, False)])
def test_an_account_is_not_taken_for_root_because_it_has_hung_up(user: int, stays: bool, allowed: bool) -> None:
    """The kernel says of a closed socket that it is root's."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        ready, done = os.pipe(), os.pipe()
        child = os.fork()
        if child == 0:
            with suppress(BaseException):
                os.setuid(user)
                link = socket.socket()
                link.connect(listener.getsockname())
                if not stays:
                    link.close()
                os.write(ready[1], b"!")
                os.read(done[0], 1)
            os._exit(0)
        os.read(ready[0], 1)
        guest, _ = listener.accept()
        with guest:
            if not stays:
                assert guest.recv(1) == b"", "it has hung up"
            assert is_allowed_peer(guest) is allowed
        os.write(done[1], b"!")
        os.waitpid(child, 0)
        for end in (*ready, *done):
            os.close(end)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can become another user")
def test_another_account_of_this_machine_is_refused(lockstep: Running) -> None:
    answer = ask_as_another_user(lockstep)
    assert answer["ok"] is False
    assert "for the user who started the controller" in answer["error"]
    with Guest(lockstep) as guest:
        assert guest.ask(request="status")["status"]["button"] == "none"


def test_the_world_port_is_on_loopback_also_where_the_controller_is_not() -> None:
    with running(lockstep=True, host="0.0.0.0") as found:
        assert found.server.world_address is not None
        assert found.server.world_address.startswith("127.0.0.1:")


def test_without_a_world_port_there_is_none() -> None:
    with running(lockstep=True, world_port=None) as found:
        assert found.server.world_address is None


def test_a_world_port_in_use_says_so_and_frees_the_others(lockstep: Running) -> None:
    assert lockstep.server.world_address is not None
    port = int(lockstep.server.world_address.partition(":")[2])
    with pytest.raises(UsageError, match=rf"simulation port {port} on 127\.0\.0\.2 .*--world-port N"):
        Running(lockstep=True, world_port=port)
    with pytest.raises(InvalidValueError, match="world_port"):
        Running(world_port=70000)


def test_things_happen_in_the_middle_of_a_motion(lockstep: Running) -> None:
    with Guest(lockstep) as guest, Peer(lockstep) as peer:
        peer.run(MOTION.q[:100])
        assert guest.ask(request="status")["status"]["phase"] == "moving"
        assert guest.ask(request="press", button="estop")["ok"]
        while not peer.receive_state().faults:
            pass
        status = guest.ask(request="status")["status"]
        assert status["button"] == "estop"
        assert status["faults"] == ["kInstabilityDetection"]
        assert peer.ask(rci.GetSafetyStopState()) == rci.SafetyStopResponse(rci.SafetyStop.ESTOP)
    line = lockstep.wait_for_line("kInstabilityDetection")
    assert "an emergency stop was pressed" in line


def test_a_stop_that_is_released_before_a_state_could_show_it_is_seen_by_its_bit(lockstep: Running) -> None:
    with Guest(lockstep) as guest, Peer(lockstep) as peer:
        peer.run(MOTION.q[:100])
        press = b'{"request": "press", "button": "%b"}\n'
        guest.socket.sendall(press % b"estop" + press % b"none")
        while not peer.receive_state().faults:
            pass
        assert peer.ask(rci.StopMove()) == 0
        assert peer.ask(rci.SetMotorPower(1)) == 0
        assert peer.receive_live_state().faults == ()
    assert "an emergency stop was pressed" in lockstep.wait_for_line("kInstabilityDetection")


def test_an_emergency_stop_between_start_move_and_its_modes_sets_a_bit_and_says_why() -> None:
    with running(lockstep=True, mode_delay=5.0) as found, Guest(found) as guest, Peer(found) as peer:
        assert peer.ask(rci.SetMotorPower(1)) == 0
        assert peer.ask(rci.StartMove(0, 1)) in (0, 1)
        assert guest.ask(request="press", button="estop")["ok"]
        while not peer.receive_state().faults:
            assert peer.seen[-1].motion_generator_mode == 0
        first = peer.seen[-1]  # The vendor's client waits for the modes, without end, and then looks at the bits.
        assert (first.controller_mode, first.motion_generator_mode) == (0, 1)
        assert first.robot_mode is RobotMode.USER_STOPPED
        assert peer.ask(rci.StopMove()) == 0
        assert peer.receive_live_state().motion_generator_mode == 0
        assert "an emergency stop was pressed" in found.wait_for_line("kInstabilityDetection")


def test_a_motion_arrives_over_a_slow_network_that_repeats_every_state() -> None:
    to_client = NetworkFaults(delay=0.001, jitter=0.001, duplicate=1.0)
    with running(lockstep=True, network=NetworkFaults(delay=0.001), states_network=to_client) as found:
        with Peer(found) as peer:
            peer.run(MOTION.q)
            assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS
            assert np.array_equal(peer.receive_live_state().q, MOTION.goal)
            ids = [state.message_id for state in peer.seen]
            assert len(set(ids)) < 0.6 * len(ids)
        assert found.server.controller.playout.lost == 0


def test_no_state_gets_through_until_the_network_is_mended(lockstep: Running) -> None:
    with Guest(lockstep) as guest:
        assert guest.ask(request="network", direction="states", faults={"loss": 1.0})["ok"]
        assert guest.ask(request="status")["status"]["states"]["loss"] == 1.0
        assert guest.ask(request="status")["status"]["commands"]["loss"] == 0.0
        with Peer(lockstep) as peer:
            assert peer.ask(rci.SetMotorPower(1)) == 0  # TCP is another matter.
            peer.udp.setblocking(False)
            with pytest.raises(BlockingIOError):
                peer.receive_state()
            peer.udp.settimeout(PATIENCE)
            assert guest.ask(request="network", faults={})["ok"]
            assert np.array_equal(peer.receive_state().q, MODEL.home)


def test_spoiled_commands_never_reach_the_arm_as_a_jump() -> None:
    with running(lockstep=True, network=NetworkFaults(corrupt=0.2, seed=1), states_network=NetworkFaults()) as found:
        with Peer(found) as peer:
            state = peer.start()
            for row in MOTION.q:
                peer.send(state.message_id, row)
                state = peer.receive_state()
            q_c = np.array([state.q_c for state in peer.seen])
            assert (np.abs(np.diff(q_c, axis=0)) <= 1e-3 * MODEL.limits.joint.velocity).all()
            assert peer.ask(rci.StopMove()) is rci.StopStatus.SUCCESS


def test_answers_split_into_single_bytes_are_whole_in_the_end() -> None:
    with running(lockstep=True, network=NetworkFaults(tcp_split=1, tcp_delay=0.01)) as found, Peer(found) as peer:
        frames = rci.FrameReader()
        peer.tcp.sendall(rci.encode_request(rci.SetMotorPower(1), 5) + rci.encode_request(rci.GetMotorState(), 6))
        pieces, answers = 0, []
        while len(answers) < 2:
            pieces += 1
            answers += frames.feed(peer.tcp.recv(100))
        assert pieces > 2
        assert rci.decode_response(rci.CommandCode.SET_MOTOR_POWER, answers[0])[0] == 5
        assert rci.decode_response(rci.CommandCode.GET_MOTOR_STATE, answers[1]) == (6, rci.MotorStateResponse(1))


def test_a_connection_that_breaks_within_an_answer_leaves_room_for_the_next_client() -> None:
    with running(lockstep=True, network=NetworkFaults(tcp_break=15)) as found:
        for _ in range(2):
            with Peer(found) as peer:
                assert peer.ask(rci.SetMotorPower(1)) == 0
                peer.tcp.sendall(rci.encode_request(rci.SetMotorPower(1), 2))
                got = peer.tcp.recv(100)
                while len(got) < 4:
                    got += peer.tcp.recv(100)
                assert len(got) == 4
                assert closes(peer.tcp)
        found.wait_for_line("a network fault")


def test_a_stalled_clock_leaves_cycles_out_and_the_robot_goes_on() -> None:
    with bind_udp(0, "127.0.0.1") as watcher:
        options = {"client_host": "127.0.0.1", "client_port": watcher.getsockname()[1]}
        with running(stalls=(Stall(duration=0.2, after=0.01),), **options) as found:
            while found.server.missed < 199:
                watcher.recv(1247)
            with Guest(found) as guest:
                status = guest.ask(request="status")["status"]
                assert status["stalls"] == 1
                assert status["missed"] >= 199
                assert guest.ask(request="stall", duration=0.1)["ok"]
                while guest.ask(request="status")["status"]["stalls"] < 2:
                    pass
            ids = [rci.decode_state(watcher.recv(1247), 7).message_id for _ in range(20)]
            assert ids == list(range(ids[0], ids[0] + 20))  # Simulated time slips; nothing of it is missing.
