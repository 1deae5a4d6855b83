"""Whatever arrives, the controller lives, nothing changes but what the protocol allows, and the next client works.

The long versions are in tests/endurance.
"""

from __future__ import annotations

import socket
from collections.abc import Iterator

import numpy as np
import pytest

from tests.peers import programs, wire
from tests.peers.arena import Arena, arena
from tests.peers.fuzz import FrameFuzzer, Watcher, datagrams, good_client_works
from tests.peers.robot import PATIENCE, Output

FRAMES = 1500
DATAGRAMS = 10_000
BATCH = 100
PATIENT = {"start_sleep": 0.0, "receive_timeout": PATIENCE, "first_timeout": PATIENCE}


@pytest.fixture
def watcher() -> Iterator[Watcher]:
    found = Watcher()
    yield found
    found.close()


def place_for(watcher: Watcher, **options: object):
    return arena(client_host="127.0.0.1", client_port=watcher.port, **options)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_fuzzed_frames_are_answered_or_refused_and_every_state_stays_sound(watcher: Watcher, seed: int) -> None:
    with place_for(watcher) as place, FrameFuzzer((place.host, place.port), seed) as fuzzer:
        for _ in range(FRAMES // 3 // BATCH):
            fuzzer.send(BATCH)
            watcher.look()
        assert fuzzer.answered > FRAMES // 4
        assert fuzzer.hung_up > 0


def test_the_next_good_client_works_after_fuzzed_frames() -> None:
    with arena() as place:
        with FrameFuzzer((place.host, place.port), 4) as fuzzer:
            fuzzer.send(BATCH)
        good_client_works(place.host, place.port, **PATIENT)


def test_fuzzed_datagrams_change_nothing_while_nothing_moves(watcher: Watcher) -> None:
    with place_for(watcher) as place:
        before = watcher.look()
        noise = datagrams(5, DATAGRAMS)
        for start in range(0, DATAGRAMS, BATCH):
            for datagram in noise[start : start + BATCH]:
                watcher.send(datagram, (place.host, place.port))
            after = watcher.look()
        assert after.data[8:] == before.data[8:]
        assert arrived(place) > DATAGRAMS // 2


def arrived(place: Arena) -> int:
    return place.server.bad_datagrams + place.cycle.ignored


def test_datagrams_of_a_wrong_size_do_not_disturb_a_motion() -> None:
    noise = [datagram for datagram in datagrams(6, 2000) if len(datagram) != wire.COMMAND_SIZE]
    with arena() as place, place.connect() as robot:
        programs.prepare(robot, factor=1.0)
        robot.start_move(wire.JOINT_POSITION, wire.JOINT)
        q = robot.receive_fresh_state().q
        left = iter(noise)

        def callback(state: wire.State, t: float) -> Output:
            for _ in range(3):
                robot.send_raw(next(left, b""))
            delta = programs.swing(0.01, 0.4, t)
            return Output(q=tuple(value + delta for value in q), finished=t > 0.4)

        robot.control(programs.timed(callback))
        last = robot.receive_fresh_state()
        assert not last.errors
        assert last.success_rate[0] == 1.0
        assert np.allclose(last.q, q, atol=1e-4)


MODES = {
    "joint position": (wire.JOINT_POSITION, wire.JOINT),
    "Cartesian position": (wire.CARTESIAN_POSITION, wire.CARTESIAN),
    "joint impedance": (wire.JOINT_IMPEDANCE, wire.JOINT),
    "Cartesian impedance": (wire.CARTESIAN_IMPEDANCE, wire.CARTESIAN),
    "torque": (wire.TORQUE, wire.IDLE),
}


@pytest.mark.parametrize("mode", MODES)
def test_noise_of_the_right_size_is_a_fault_and_never_a_motion(watcher: Watcher, mode: str) -> None:
    with place_for(watcher) as place, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        noise = [datagram for datagram in datagrams(7, 200) if len(datagram) == wire.COMMAND_SIZE]
        for round_ in range(10):
            with socket.create_connection((place.host, place.port), timeout=PATIENCE) as tcp:
                start = watcher.look()
                while watcher.look().robot_mode == wire.ROBOT_MOVE:  # The last round's stop, if it still goes on.
                    pass
                ask(tcp, wire.Code.ERROR_RECOVERY)
                assert ask(tcp, wire.Code.MOTOR_POWER, b"\x01") == 0
                assert ask(tcp, wire.Code.START_MOVE, bytes(MODES[mode])) == 0
                while watcher.look().robot_mode != wire.ROBOT_MOVE:
                    pass
                start = watcher.look()
                for datagram in noise[10 * round_ : 10 * round_ + 10]:
                    udp.sendto(datagram, (place.host, place.port))
                while not watcher.look().errors:
                    pass
                ask(tcp, wire.Code.STOP_MOVE)
                after = watcher.look()
                assert np.abs(np.subtract(after.q, start.q)).max() < 1e-3
        assert place.thread.is_alive()


def ask(tcp: socket.socket, code: wire.Code, payload: bytes = b"") -> int:
    tcp.sendall(wire.pack_frame(1, code, payload))
    answer = tcp.recv(11)
    assert len(answer) == 11
    return answer[10]
