"""Frames and datagrams of the FCI that no good client sends, and what must be true of every state whatever arrives.

`fuzz_frames` and `fuzz_datagrams` run a controller as a user starts it; short and long versions differ by their count.
"""

from __future__ import annotations

import math
import random
import socket
import struct

import numpy as np

from tests.peers.arena import Process
from tests.peers.franka import programs, wire
from tests.peers.franka.arena import MODELS
from tests.peers.franka.robot import Robot
from tests.peers.franka.wire import State

PAYLOADS = {  # [bytes] Payload of a well-formed request.
    "move": 56, "stop_move": 0, "get_cartesian_limit": 4, "set_collision_behavior": 416, "set_joint_impedance": 56,
    "set_cartesian_impedance": 48, "set_guiding_mode": 7, "set_ee_to_k": 128, "set_ne_to_ee": 128, "set_load": 104,
    "set_filters": 40, "automatic_error_recovery": 0, "get_robot_model": 0, "load_model_library": 2,
}  # fmt: skip
_CONTENTS = {"get_cartesian_limit": 153}  # [bytes] After the status; those of models are long, all others empty.
_MODELS = ("get_robot_model", "load_model_library")
_SPECIAL = (0.0, -0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 1e-12)
_FRAME = (1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0.1, 0, 0.2, 1.0)
_MALFORMED = 0.05  # Share of frames that are no FCI; the connection must end there.
_BATCH = 50  # Datagrams between two looks at the state.


class FrameFuzzer:
    """Sends frames, judges every answer and every state, and connects anew when the controller has hung up.

    Args:
        host: Address of the controller.
        port: Its TCP port.
        version: Of the interface.
        seed: What is sent is a function of this.
    """

    def __init__(self, host: str, port: int, version: int, seed: int) -> None:
        self._host, self._port, self.version = host, port, version
        self._random = random.Random(seed)
        self._robot: Robot | None = None
        self._commands = [name for name in wire.commands_of(version) if name != "connect"]
        self.answered = self.hung_up = 0

    def send(self, count: int) -> None:
        """Sends that many frames."""
        for number in range(count):
            if self._robot is None:
                self._robot = connect(self._host, self._port, self.version)
            if self._random.random() < _MALFORMED:
                self._send_malformed(self._robot)
            else:
                self._ask(self._robot, self._random.choice(self._commands))
            if self._robot is not None and number % 20 == 0:
                self._robot.state()
                judge(self._robot)

    def close(self) -> None:
        if self._robot is not None:
            self._robot.close()
            self._robot = None

    def __enter__(self) -> FrameFuzzer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self, robot: Robot, name: str) -> None:
        request = robot.request(name, self._payload(name))
        answer = robot.response(name, request)
        self.answered += 1
        if name in _MODELS:
            assert bool(answer.content) is (answer.status == "success")
        elif answer.status in ("success", "not possible", "invalid argument"):
            assert len(answer.content) in (0, _CONTENTS.get(name, 0)), f"{name}: {len(answer.content)} bytes"
        if name == "move" and answer.status == "started":
            robot.state()
            for datagram in datagrams(self.version, self._random.getrandbits(32), self._random.randrange(4)):
                robot.send(datagram)
            robot.ask("stop_move")
            ending = robot.response("move", request).status
            assert ending in ("preempted", "reflex", "success"), ending

    def _send_malformed(self, robot: Robot) -> None:
        robot.tcp.sendall(self._malformed())
        robot.tcp.shutdown(socket.SHUT_WR)  # A frame that was only begun ends here, too.
        try:
            while robot.tcp.recv(65536):
                pass
        except ConnectionResetError:
            pass
        self.close()
        self.hung_up += 1

    def _payload(self, name: str) -> bytes:
        pick, size = self._random, PAYLOADS[name]
        if name == "move":
            numbers = [pick.choice(_SPECIAL) if pick.random() < 0.05 else pick.uniform(0.0, 10.0) for _ in range(13)]
            payload = struct.pack("<II", pick.randrange(4), pick.randrange(6)) + wire.doubles(*numbers[:6])
            is_goal = pick.random() < 0.2
            return payload + bytes([is_goal]) + wire.doubles(*numbers[6:]) if self.version == 10 else payload
        if pick.random() < 0.3:
            return pick.randbytes(size)
        numbers = [pick.choice(_SPECIAL) if pick.random() < 0.1 else pick.uniform(0.0, 30.0) for _ in range(size // 8)]
        if pick.random() < 0.5 and size == 128:
            numbers = list(_FRAME)
        return wire.doubles(*numbers) + bytes(pick.choice((0, 0, 1, 1, 2, 255)) for _ in range(size % 8))

    def _malformed(self) -> bytes:
        pick = self._random
        number = pick.randrange(len(self._commands))
        return pick.choice(
            (
                lambda: pick.randbytes(pick.randrange(1, 12)),
                lambda: struct.pack("<III", number, 1, pick.randrange(12)),  # Shorter than its header.
                lambda: struct.pack("<III", number, 1, pick.randrange(1025, 2**32)) + pick.randbytes(200),
                lambda: wire.pack_frame(pick.randrange(14, 2**32), 1),
                lambda: wire.pack_frame(1, 1, bytes(pick.randrange(56))),  # Shorter than a Move.
                lambda: wire.pack_frame(1, 1, bytes(400))[: pick.randrange(1, 400)],
                lambda: b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n",
            )
        )()


def connect(host: str, port: int, version: int) -> Robot:
    """Returns a client; the controller refuses one while it has not seen the last one go."""
    while True:
        try:
            return Robot(host, port, version)
        except (ConnectionResetError, BrokenPipeError):
            continue


def datagrams(version: int, seed: int, count: int) -> list[bytes]:
    """Returns datagrams: noise of every size, noise of the right size, and commands with numbers that are none."""
    pick = random.Random(seed)

    def some(count: int) -> tuple[float, ...]:
        return tuple(pick.choice(_SPECIAL) if pick.random() < 0.5 else pick.uniform(-7.0, 7.0) for _ in range(count))

    def make() -> bytes:
        kind = pick.random()
        if kind < 0.4:
            return pick.randbytes(pick.choice((0, 1, 8, 369, 372, 1377, 2373, pick.randrange(3000))))
        if kind < 0.7:
            return pick.randbytes(wire.COMMAND_SIZES[version])
        return wire.pack_command(
            version,
            pick.getrandbits(pick.choice((8, 64))),
            q=some(7),
            dq=some(7),
            pose=some(16),
            twist=some(6),
            elbow=some(2),
            has_elbow=pick.random() < 0.5,
            finished=pick.random() < 0.2,
            tau=some(7),
            torques_finished=pick.random() < 0.2,
        )

    return [make() for _ in range(count)]


def judge(robot: Robot) -> None:
    """Holds every state that a client has received against what must be true of each, and forgets all but the last."""
    last: State | None = None
    for state in robot.states:
        for name in state.names:
            assert np.isfinite(getattr(state, name)).all(), f"{name} is {getattr(state, name)}"
        assert set(state.flags) <= {0, 1}
        assert state.generator <= 5
        assert state.controller <= 3
        assert wire.ROBOT_IDLE <= state.robot_mode <= wire.ROBOT_RECOVERING
        assert state.controller == wire.OTHER or state.robot_mode == wire.ROBOT_MOVE
        assert 0.0 <= state.success_rate <= 1.0
        for pose in (state.O_T_EE, state.O_T_EE_d, state.EE_T_K, state.F_T_EE):
            R = np.reshape(pose, (4, 4)).T[:3, :3]
            assert np.allclose(R @ R.T, np.eye(3), atol=1e-5)
        assert last is None or state.message_id > last.message_id
        last = state
    del robot.states[:-1]


def good_client_works(host: str, port: int, version: int) -> None:
    """Recovers, sets what the motion needs, and runs it to its end."""
    with connect(host, port, version) as robot:
        robot.state_when(lambda state: state.robot_mode != wire.ROBOT_MOVE)
        assert robot.ask("automatic_error_recovery").status == "success"
        stiffness = wire.doubles(*(3000.0,) * 3, *(2500.0,) * 2, *(2000.0,) * 2)
        assert robot.ask("set_joint_impedance", stiffness).status == "success"
        assert robot.ask("set_collision_behavior", wire.doubles(*(1000.0,) * 52)).status == "success"
        assert robot.ask("set_load", bytes(104)).status == "success"
        if version == 5:
            assert robot.ask("set_filters", wire.doubles(*(1000.0,) * 5)).status == "success"
        start = robot.move(wire.JOINT_IMPEDANCE, wire.JOINT_POSITION)
        ending = robot.play(start, programs.motion(start, wire.JOINT_POSITION, height=0.003), cycles=201)
        assert (ending.status, ending.state.errors) == ("success", ())


def fuzz_frames(version: int, plant: str, count: int, seed: int) -> None:
    """Sends fuzzed frames to a controller that a good client then uses."""
    with Process("--lockstep", "--plant", plant, model=MODELS[version]) as controller:
        with FrameFuzzer(controller.host, controller.port, version, seed) as fuzzer:
            fuzzer.send(count)
            assert fuzzer.answered
        assert controller.process.poll() is None
        good_client_works(controller.host, controller.port, version)


def fuzz_datagrams(version: int, count: int, seed: int) -> None:
    """Sends fuzzed datagrams to a resting controller; its state must stay the same, and a good client must work."""
    with Process("--lockstep", model=MODELS[version]) as controller:
        with connect(controller.host, controller.port, version) as robot:
            before = robot.skip(3).data[8:]
            noise = datagrams(version, seed, min(count, 20_000))
            for start in range(0, count, _BATCH):
                for number in range(start, start + _BATCH):
                    robot.send(noise[number % len(noise)])
                assert robot.state().data[8:] == before
                del robot.states[:-1]
        good_client_works(controller.host, controller.port, version)
