"""Frames and datagrams that no good client sends, and what must be true of every state whatever arrives."""

from __future__ import annotations

import random
import socket
import struct

import numpy as np

from tests.peers.robot import PATIENCE, Robot
from tests.peers.wire import (
    COMMAND_SIZE,
    FIELD_NAMES,
    HEADER_SIZE,
    RESPONSE_SIZES,
    ROBOT_MOVE,
    ROBOT_RECOVERING,
    STATE_SIZE,
    Code,
    State,
    doubles,
    pack_command,
    pack_frame,
)

PAYLOADS = {  # [bytes] Payload of a well-formed request.
    Code.MOTOR_POWER: 1, Code.MOTOR_STATE: 0, Code.START_MOVE: 2, Code.STOP_MOVE: 0, Code.CARTESIAN_LIMIT: 153,
    Code.JOINT_LIMIT: 112, Code.COLLISION_BEHAVIOR: 56, Code.JOINT_IMPEDANCE: 56, Code.CARTESIAN_IMPEDANCE: 48,
    Code.COOR: 128, Code.LOAD: 104, Code.DESIRED_TAU: 48, Code.FILTERS: 24, Code.TORQUE_FILTER: 8,
    Code.ERROR_RECOVERY: 0, Code.LOAD_MODEL: 0, Code.FC_COOR: 129, Code.VIRTUAL_GUIDE: 49, Code.SET_DO: 2,
    Code.GET_DI: 1, Code.START_DRAG: 2, Code.STOP_DRAG: 0, Code.SAFETY_STOP_STATE: 0, Code.REBOOT: 0,
}  # fmt: skip
"""All but Connect, which would send the states elsewhere."""

STATUS_COUNTS = {Code.START_MOVE: 10, Code.STOP_MOVE: 5, Code.ERROR_RECOVERY: 6, Code.VIRTUAL_GUIDE: 2}
_CONTENT = (Code.MOTOR_STATE, Code.LOAD_MODEL, Code.GET_DI, Code.SAFETY_STOP_STATE)
_SPECIAL = (0.0, -0.0, 1.0, -1.0, float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 5e-324, 1e-12)
_ENDS = (Code.REBOOT,)  # The connection ends after its answer.
_MALFORMED = 0.05  # Share of frames that are no RCI; the connection must end there.


class FrameFuzzer:
    """Sends frames, one answer each, and connects anew when the controller has hung up.

    Args:
        address: The controller.
        seed: What comes is a function of this.
    """

    def __init__(self, address: tuple[str, int], seed: int) -> None:
        self._address = address
        self._random = random.Random(seed)
        self._tcp: socket.socket | None = None
        self.answered = self.hung_up = 0

    def send(self, count: int) -> None:
        """Sends that many frames and judges every answer."""
        for _ in range(count):
            if self._tcp is None:
                self._tcp = self._connect()
            if self._random.random() < _MALFORMED:
                self._tcp.sendall(self._malformed())
                self._hang_up()
            else:
                self._ask(self._tcp)

    def close(self) -> None:
        if self._tcp is not None:
            self._tcp.close()
            self._tcp = None

    def __enter__(self) -> FrameFuzzer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _connect(self) -> socket.socket:
        while True:  # Who comes before the controller has seen the last one go is refused.
            tcp = socket.create_connection(self._address, timeout=PATIENCE)
            tcp.sendall(pack_frame(7, Code.SAFETY_STOP_STATE))
            try:
                if tcp.recv(11):
                    return tcp
            except ConnectionResetError:
                pass
            tcp.close()

    def _ask(self, tcp: socket.socket) -> None:
        code = self._random.choice(tuple(PAYLOADS))
        command_id = self._random.choice((0, 1, 2**31, 2**32 - 1, self._random.getrandbits(32)))
        frame = pack_frame(command_id, code, self._payload(code))
        if self._random.random() < 0.2:  # In two pieces.
            cut = self._random.randrange(1, len(frame))
            tcp.sendall(frame[:cut])
            frame = frame[cut:]
        tcp.sendall(frame)
        size = RESPONSE_SIZES.get(code, HEADER_SIZE + 1)
        answer = tcp.recv(size)
        assert len(answer) == size, f"{code.name}: {len(answer)} of {size} bytes"
        assert struct.unpack(">HII", answer[:HEADER_SIZE]) == (size, command_id, code)
        if code not in _CONTENT:
            assert answer[HEADER_SIZE] < STATUS_COUNTS.get(code, 3), f"{code.name}: status {answer[HEADER_SIZE]}"
        self.answered += 1
        if code in _ENDS and answer[HEADER_SIZE] == 0:
            self._hang_up()

    def _hang_up(self) -> None:
        """The controller must have ended the connection; whatever else it still sends is not looked at."""
        assert self._tcp is not None
        self._tcp.shutdown(socket.SHUT_WR)  # A frame that was only begun ends here, too.
        try:
            while self._tcp.recv(4096):
                pass
        except ConnectionResetError:
            pass
        self.close()
        self.hung_up += 1

    def _payload(self, code: Code) -> bytes:
        size, pick = PAYLOADS[code], self._random
        if pick.random() < 0.3:
            return pick.randbytes(size)
        head = bytes(pick.choice((0, 0, 1, 1, 2, 3, 4, 5, 6, 255)) for _ in range(size % 8))
        numbers = [pick.choice(_SPECIAL) if pick.random() < 0.1 else pick.uniform(0.0, 3.0) for _ in range(size // 8)]
        if pick.random() < 0.5 and size // 8 >= 16:  # A proper pose among the numbers, now and then.
            numbers[-16:] = [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0.2, 0, 0, 0, 1]
        return head + doubles(*numbers) if code == Code.VIRTUAL_GUIDE else doubles(*numbers) + head

    def _malformed(self) -> bytes:
        pick = self._random
        code = pick.choice(tuple(PAYLOADS))
        return pick.choice(
            (
                lambda: pick.randbytes(pick.randrange(1, 300)),
                lambda: struct.pack(">HII", pick.randrange(HEADER_SIZE), 1, code),  # Shorter than itself.
                lambda: pack_frame(1, pick.randrange(25, 2**32), b""),
                lambda: pack_frame(1, code, bytes(PAYLOADS[code] + pick.randrange(1, 9))),
                lambda: pack_frame(1, code, bytes(400))[: pick.randrange(1, 400)],
                lambda: b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n",
            )
        )()


def datagrams(seed: int, count: int) -> list[bytes]:
    """Returns datagrams: noise of every size, noise of the right size, and commands with numbers that are none."""
    pick = random.Random(seed)

    def make() -> bytes:
        kind = pick.random()
        if kind < 0.4:
            return pick.randbytes(pick.choice((0, 1, 8, 289, 291, 1247, 1400, pick.randrange(2000))))
        if kind < 0.7:
            return pick.randbytes(COMMAND_SIZE)
        numbers = tuple(pick.choice(_SPECIAL) if pick.random() < 0.5 else pick.uniform(-7.0, 7.0) for _ in range(30))
        return pack_command(pick.getrandbits(64), numbers[:7], numbers[7:23], numbers[23], numbers[23:])

    return [make() for _ in range(count)]


class Watcher:
    """Receives the states, from power-up on, and holds each against what must be true of every one.

    A state has the right size, finite numbers, proper poses, known modes, bits that are 0 or 1, a success rate from 0
    to 1; numbers of states rise; modes are shown while the robot moves only; and an arm that does not move or is not
    moved by hand stands still as far as commands go.
    """

    def __init__(self) -> None:
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind(("127.0.0.1", 0))
        self._udp.settimeout(PATIENCE)
        self.port: int = self._udp.getsockname()[1]
        self.seen = 0
        self.last: State | None = None

    def send(self, datagram: bytes, address: tuple[str, int]) -> None:
        """Sends a datagram from where states come to: a controller takes it for its client's."""
        self._udp.setblocking(True)
        self._udp.sendto(datagram, address)

    def look(self) -> State:
        """Waits for a state and judges it and all that have come meanwhile."""
        self._udp.settimeout(PATIENCE)
        state = self._judge(self._udp.recv(4096))
        self._udp.setblocking(False)
        try:
            while True:
                state = self._judge(self._udp.recv(4096))
        except BlockingIOError:
            return state

    def close(self) -> None:
        self._udp.close()

    def _judge(self, data: bytes) -> State:
        assert len(data) == STATE_SIZE
        state = State(data)
        for name in FIELD_NAMES:
            assert np.isfinite(getattr(state, name)).all(), f"{name} is {getattr(state, name)}"
        assert set(data[1216:1236]) <= {0, 1}
        assert state.controller_mode <= 5
        assert state.motion_mode in (0, 1, 3)
        assert state.robot_mode <= ROBOT_RECOVERING
        assert (state.controller_mode == 5) or state.robot_mode == ROBOT_MOVE
        assert 0.0 <= state.success_rate[0] <= 1.0
        for pose in (state.pos_m, state.pos_c):
            R = np.array(pose).reshape(4, 4)[:3, :3]
            assert np.allclose(R @ R.T, np.eye(3), atol=1e-9)
        if self.last is not None:
            assert state.message_id >= self.last.message_id
        self.last = state
        self.seen += 1
        return state


def good_client_works(host: str, port: int, **options: object) -> None:
    """Reboots, which forgets whatever was set, and runs a motion to its end."""
    from tests.peers import programs

    with Robot(host, port, **options) as robot:  # type: ignore[arg-type]
        if robot.receive_fresh_state().errors:
            robot.automatic_error_recovery()
        robot.set_motor_power(0)
        robot.reboot()
    with Robot(host, port, **options) as robot:  # type: ignore[arg-type]
        programs.prepare(robot, factor=1.0)
        programs.joint_sine(robot, 0.2, amplitude=0.001, period=0.2)
        state = robot.receive_fresh_state()
        assert not state.errors
        assert np.allclose(state.q, programs.LEFT[7], atol=0.01)
