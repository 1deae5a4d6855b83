"""The client library of the FCI as the wire sees it, in both versions. Shares no code with the package.

Of the states that have arrived it answers the newest; it sends no command before a state shows the modes of Move; it
repeats the last command, marked as finished, until the modes are gone; and it reads the second answer of Move after
the states say that the motion has ended. Fields of a command that its motion does not use hold rubbish here.
"""

from __future__ import annotations

import math
import socket
import struct
from collections.abc import Callable, Sequence
from typing import NamedTuple

from tests.peers.franka.wire import (
    EXTERNAL,
    HEADER_SIZE,
    NONE,
    OTHER,
    ROBOT_MOVE,
    STATE_SIZES,
    State,
    number_of,
    pack_command,
    pack_frame,
    pack_move,
    status_name,
)

PATIENCE = 30.0  # [s] A test that waits longer has found a bug.
_RUBBISH = (math.nan, math.inf, -1e300, 5e-324)


class Output(NamedTuple):
    """What a program commands in a cycle; only the fields of its motion are sent as they are."""

    q: tuple[float, ...] | None = None
    dq: tuple[float, ...] | None = None
    pose: tuple[float, ...] | None = None
    twist: tuple[float, ...] | None = None
    elbow: tuple[float, ...] | None = None
    tau: tuple[float, ...] | None = None


class Answer(NamedTuple):
    """The answer to a command."""

    status: str
    content: bytes


class Ending(NamedTuple):
    """How a motion ended."""

    status: str
    """Of the second answer to Move."""
    state: State
    """The first state without the motion's modes."""
    sent: int
    """Number of commands before."""


Callback = Callable[[State, int], Output]


class Robot:
    """A program's connection to its arm.

    Args:
        host: Address of the controller.
        port: Its TCP port.
        version: Version that the client speaks.
        claimed: Version that it names in Connect; None: the same.
    """

    def __init__(self, host: str, port: int, version: int, *, claimed: int | None = None) -> None:
        self.version = version
        self.states: list[State] = []
        self._answers: dict[int, tuple[int, bytes]] = {}
        self._command_id = 100
        self._move_id = 0
        self._is_external = False
        self._buffer = b""
        self._source: tuple[str, int] | None = None
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)  # States that come while a test waits.
        self.udp.bind(("0.0.0.0", 0))
        self.udp.settimeout(PATIENCE)
        try:
            self.tcp = socket.create_connection((host, port), timeout=PATIENCE)
            self.tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.udp_port: int = self.udp.getsockname()[1]
            connect = struct.pack("<HH", version if claimed is None else claimed, self.udp_port)
            self.connected = self.ask("connect", connect)
        except BaseException:
            self.close()
            raise

    @property
    def server_version(self) -> int:
        """The version that the controller named."""
        return struct.unpack("<H", self.connected.content)[0]

    def close(self) -> None:
        """Ends the program."""
        self.udp.close()
        if hasattr(self, "tcp"):
            self.tcp.close()

    def __enter__(self) -> Robot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Commands over TCP.

    def request(self, name: str, payload: bytes = b"") -> int:
        """Sends a command and returns its id."""
        self._command_id += 1
        self.tcp.sendall(pack_frame(number_of(name, self.version), self._command_id, payload))
        return self._command_id

    def response(self, name: str, command_id: int) -> Answer:
        """Waits for the next answer to a command; answers to others are kept."""
        while command_id not in self._answers:
            self._read_answer()
        number, body = self._answers.pop(command_id)
        assert number == number_of(name, self.version)
        return Answer(status_name(name, self.version, body[0]), body[1:])

    def ask(self, name: str, payload: bytes = b"") -> Answer:
        """Sends a command and waits for its answer."""
        return self.response(name, self.request(name, payload))

    def ending(self) -> str:
        """Waits for the second answer to Move."""
        return self.response("move", self._move_id).status

    def has_answer(self) -> bool:
        """Whether an answer to anything has arrived that was not asked for."""
        self.tcp.setblocking(False)
        try:
            return bool(self._answers or self._buffer or self.tcp.recv(1, socket.MSG_PEEK))
        except BlockingIOError:
            return False
        finally:
            self.tcp.settimeout(PATIENCE)

    def _read_answer(self) -> None:
        while len(self._buffer) < HEADER_SIZE or len(self._buffer) < struct.unpack_from("<I", self._buffer, 8)[0]:
            data = self.tcp.recv(65536)
            if not data:
                raise ConnectionResetError("the controller closed the connection")
            self._buffer += data
        number, command_id, size = struct.unpack_from("<III", self._buffer)
        assert command_id not in self._answers, "two answers with one id before the first was read"
        self._answers[command_id] = number, self._buffer[HEADER_SIZE:size]
        self._buffer = self._buffer[size:]

    # Real time over UDP.

    def state(self) -> State:
        """Returns the newest state, and waits for one if none has arrived since the last call."""
        after = self.states[-1].message_id if self.states else 0
        while True:
            newest = self._keep(*self.udp.recvfrom(4096))
            self.udp.setblocking(False)
            try:
                while True:
                    newest = self._keep(*self.udp.recvfrom(4096))
            except BlockingIOError:
                pass
            finally:
                self.udp.settimeout(PATIENCE)
            if newest.message_id > after:
                return newest

    def state_when(self, condition: Callable[[State], bool]) -> State:
        """Waits for a state with a property."""
        for _ in range(30_000):
            state = self.state()
            if condition(state):
                return state
        raise AssertionError("no state had the property")

    def skip(self, cycles: int) -> State:
        """Waits for a number of cycles."""
        start = self.state().message_id
        return self.state_when(lambda state: state.message_id >= start + cycles)

    def move(self, controller: int, generator: int, **options: tuple[float, ...]) -> State:
        """Starts a motion; returns the state that the first command answers."""
        started = self.try_move(controller, generator, **options)
        assert started == "started", started
        shown = (generator + 1, controller, ROBOT_MOVE)
        self.state_when(lambda state: (state.generator, state.controller, state.robot_mode) == shown)
        return self.state()

    def try_move(self, controller: int, generator: int, **options: tuple[float, ...]) -> str:
        """Sends Move; returns the status of its first answer."""
        self._move_id = self.request("move", pack_move(self.version, controller, generator, **options))
        self._is_external = controller == EXTERNAL
        self._is_torque_alone = generator == NONE
        return self.response("move", self._move_id).status

    def answer(self, state: State, output: Output, *, finished: bool = False) -> None:
        """Sends the command that answers a state."""
        self.send(self.pack(state.message_id, output, finished=finished))

    def pack(self, message_id: int, output: Output, *, finished: bool = False) -> bytes:
        """Returns the datagram of a command."""
        torque_alone = self._is_external and self._is_torque_alone
        return pack_command(
            self.version,
            message_id,
            q=output.q or _rubbish(7),
            dq=output.dq or _rubbish(7),
            pose=output.pose or _rubbish(16),
            twist=output.twist or _rubbish(6),
            elbow=output.elbow or _rubbish(2),
            has_elbow=output.elbow is not None,
            finished=finished and not torque_alone,
            tau=output.tau or _rubbish(7),
            torques_finished=finished and torque_alone,
        )

    def send(self, datagram: bytes) -> None:
        """Sends bytes to where states come from."""
        assert self._source is not None, "no state has arrived"
        self.udp.sendto(datagram, self._source)

    def play(self, state: State, callback: Callback | Sequence[Output], *, cycles: int | None = None) -> Ending:
        """Commands one output for each state, then that the last one is finished, until the motion has ended.

        Args:
            state: The state of `move`.
            callback: Returns the output of a cycle, counted from 0; or all outputs.
            cycles: Number of outputs before the end; None: all of a sequence.
        """
        count = len(callback) if cycles is None else cycles  # type: ignore[arg-type]
        shown, sent = (state.generator, state.controller), 0
        output = Output()
        while (state.generator, state.controller) == shown and state.robot_mode == ROBOT_MOVE:
            if sent < count:
                output = callback(state, sent) if callable(callback) else callback[sent]
            self.answer(state, output, finished=sent >= count)
            sent += 1
            state = self.state()
        return Ending(self.ending(), state, min(sent, count))

    def stop(self) -> State:
        """Ends the motion with StopMove; returns the first state without its modes."""
        assert self.ask("stop_move").status == "success"
        state = self.state_when(lambda state: (state.generator, state.controller) == (0, OTHER))
        assert self.ending() == "preempted"
        return state

    def _keep(self, data: bytes, source: tuple[str, int]) -> State:
        assert len(data) == STATE_SIZES[self.version]
        assert self._source in (None, source), "states come from several ports"
        self._source = source
        state = State(data, self.version)
        self.states.append(state)
        return state


def _rubbish(count: int) -> tuple[float, ...]:
    return tuple(_RUBBISH[k % len(_RUBBISH)] for k in range(count))
