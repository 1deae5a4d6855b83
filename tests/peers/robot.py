"""The vendor's client library as the wire sees it, with its habits, good and bad. Shares no code with the package.

It never says Connect, takes states from anybody, sleeps after StartMove while its socket buffer fills with old states,
then reads them oldest first, answers the last state again when none comes in time, filters what the callback returns,
sends nothing for the last callback, announces the end over TCP alone, leaves rubbish in unused fields, and has neither
a time limit on answers (here a test has one) nor a way back after a fault other than a new object.
"""

from __future__ import annotations

import math
import socket
import struct
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from tests.peers.wire import (
    ERROR_NAMES,
    HEADER_SIZE,
    RESPONSE_SIZES,
    SHOWN_AS,
    STATE_SIZE,
    Code,
    State,
    doubles,
    pack_command,
    pack_frame,
)

PATIENCE = 30.0  # [s] A missing answer blocks the vendor's client for ever; a test that waits longer has found a bug.
RUBBISH = struct.pack("<6d", math.nan, math.inf, -1e300, 5e-324, math.nan, 3.0)  # Uninitialised memory.
FILTER = 100.0  # [Hz] What the library starts with.
UNFILTERED = 1000.0  # [Hz]

JOINT_SPACE, CARTESIAN_SPACE = 0, 1
DRAG_TRANSLATION, DRAG_ROTATION, DRAG_FREE = 0, 1, 2


class Output(NamedTuple):
    """What a callback returns: joint angles, a pose (with arm angle) or torques."""

    q: tuple[float, ...] | None = None
    pose: tuple[float, ...] | None = None
    psi: float = 0.0
    tau: tuple[float, ...] | None = None
    finished: bool = False


Callback = Callable[[State], Output]


class CommandException(Exception):
    """The controller refused."""

    def __init__(self, code: Code, status: int) -> None:
        super().__init__(f"{code.name} was answered with status {status}")
        self.status = status


class ControlException(Exception):
    """Error bits were set while a motion ran."""

    def __init__(self, errors: tuple[int, ...], state: State) -> None:
        super().__init__(", ".join(ERROR_NAMES[error] for error in errors))
        self.errors = errors
        self.state = state


class Robot:
    """A program's connection to its arm.

    Args:
        host: Address of the controller.
        port: The one number: its TCP and UDP port, and our UDP port.
        axes: 7, or 6; then seventh elements are rubbish.
        start_sleep: How long to sleep after StartMove, [s].
        receive_timeout: How long to wait for a state before the last one is answered again, [s].
        first_timeout: How long the constructor waits for its one state, [s].
        shares_port: Whether the UDP port may be in use at another address of this machine.
        answers_once: Whether a state that comes twice is answered once, which the library does not do: for runs that
            shall come out the same every time.
    """

    def __init__(
        self,
        host: str,
        port: int,
        *,
        axes: int = 7,
        start_sleep: float = 1.0,
        receive_timeout: float = 0.001,
        first_timeout: float = 0.001,
        shares_port: bool = True,
        answers_once: bool = False,
    ) -> None:
        self.axes = axes
        self.sent = 0
        self.timeouts = 0
        self.states: list[State] = []
        self.record_states = True
        self.filter_frequency = FILTER
        self._address = (host, port)
        self._start_sleep = start_sleep
        self._receive_timeout = receive_timeout
        self._answers_once = answers_once
        self._command_id = 0
        self._modes: tuple[int, int] | None = None
        self._error: ControlException | None = None
        self._last: State | None = None
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        if shares_port:
            self._udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._udp.bind(("0.0.0.0", port))
        self._tcp: socket.socket | None = None
        helper = threading.Thread(target=self._connect)
        helper.start()
        try:
            self._udp.settimeout(first_timeout)
            self._last = State(self._udp.recv(STATE_SIZE))
        except OSError as error:
            helper.join()
            self.close()
            raise RuntimeError("initial UDP receive timed out") from error
        helper.join()  # The examples sleep 1 to 2 s instead, "against failing connections".
        assert self._tcp is not None, "the TCP connection was refused: the vendor's process would abort"

    def close(self) -> None:
        """Ends the program."""
        self._udp.close()
        if self._tcp is not None:
            self._tcp.close()

    def __enter__(self) -> Robot:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Commands over TCP.

    def set_motor_power(self, power: int) -> None:
        self._set(Code.MOTOR_POWER, bytes([power & 0xFF]))

    def get_motor_state(self) -> int:
        return self.ask(Code.MOTOR_STATE)[0]

    def set_collision_behavior(self, thresholds: Sequence[float]) -> None:
        self._set(Code.COLLISION_BEHAVIOR, self._seven(thresholds))

    def set_cartesian_limit(self, size: Sequence[float], pose: Sequence[float]) -> None:
        self._set(Code.CARTESIAN_LIMIT, doubles(*size, *pose) + b"\x01")

    def set_joint_limit(self, upper: Sequence[float], lower: Sequence[float]) -> None:
        self._set(Code.JOINT_LIMIT, self._seven(upper) + self._seven(lower))

    def set_joint_impedance(self, stiffness: Sequence[float]) -> None:
        self._set(Code.JOINT_IMPEDANCE, self._seven(stiffness))

    def set_cartesian_impedance(self, stiffness: Sequence[float]) -> None:
        self._set(Code.CARTESIAN_IMPEDANCE, doubles(*stiffness))

    def set_coor(self, pose: Sequence[float]) -> None:
        self._set(Code.COOR, doubles(*pose))

    def set_load(self, mass: float, center: Sequence[float], inertia: Sequence[float]) -> None:
        self._set(Code.LOAD, doubles(mass, *center, *inertia))

    def set_cart_imp_desired_tau(self, wrench: Sequence[float]) -> None:
        self._set(Code.DESIRED_TAU, doubles(*wrench))

    def set_filters(self, joint: float, cartesian: float, torque: float) -> None:
        self._set(Code.FILTERS, doubles(joint, cartesian, torque))

    def set_fc_coor(self, pose: Sequence[float], kind: int) -> None:
        self._set(Code.FC_COOR, doubles(*pose) + bytes([kind]))

    def enable_virtual_guide(self, enable: bool) -> None:
        self._set(Code.VIRTUAL_GUIDE, bytes([enable]) + RUBBISH)

    def set_do(self, signal: int, level: bool) -> None:
        self._set(Code.SET_DO, bytes([signal, level]))

    def get_di(self, signal: int) -> bool:
        return bool(self.ask(Code.GET_DI, bytes([signal]))[1])

    def start_drag(self, space: int, kind: int) -> None:
        self._set(Code.START_DRAG, bytes([space, kind]))

    def stop_drag(self) -> None:
        self._set(Code.STOP_DRAG)

    def get_safety_stop_state(self) -> int:
        return self.ask(Code.SAFETY_STOP_STATE)[0]

    def reboot(self) -> None:
        self._set(Code.REBOOT)

    def automatic_error_recovery(self) -> None:
        self._set(Code.ERROR_RECOVERY)

    def load_robot_model(self) -> tuple[float, ...]:
        """Returns the 160 numbers of the model; the first 28 are 7 rows of a [mm], alpha, d [mm], theta."""
        payload = self.ask(Code.LOAD_MODEL)
        assert payload[0] == 0
        return struct.unpack("<160d", payload[1:])

    def start_move(self, controller_mode: int, motion_mode: int) -> None:
        """Starts a motion, sleeps, then reads states, oldest first, until one shows the modes."""
        if self._modes is not None:
            raise RuntimeError("attempted to start multiple motions")
        status = self.ask(Code.START_MOVE, bytes([controller_mode, motion_mode]))[0]
        if status > 1:
            raise CommandException(Code.START_MOVE, status)
        time.sleep(self._start_sleep)
        self._modes = (controller_mode, SHOWN_AS[motion_mode])
        deadline = time.monotonic() + PATIENCE
        while True:
            state = self._receive()
            if state is not None and (state.controller_mode, state.motion_mode) == self._modes:
                return
            assert time.monotonic() < deadline, "the modes were never shown: the vendor's client hangs here for ever"

    def stop_move(self) -> None:
        status = self.ask(Code.STOP_MOVE)[0]
        self._modes = None
        if status != 0:
            raise CommandException(Code.STOP_MOVE, status)

    def ask(self, code: Code, payload: bytes = b"") -> bytes:
        """Sends a request and returns the payload of its answer, read with one call of exactly the expected size."""
        assert self._tcp is not None
        self._command_id += 1
        self._tcp.sendall(pack_frame(self._command_id, code, payload))
        size = RESPONSE_SIZES.get(code, HEADER_SIZE + 1)
        while True:
            frame = self._tcp.recv(size)
            assert len(frame) == size, f"response length error: {len(frame)} instead of {size} bytes for {code.name}"
            if struct.unpack(">I", frame[2:6])[0] == self._command_id:
                return frame[HEADER_SIZE:]

    # Real time over UDP.

    def receive_robot_state(self) -> State:
        """Performs exactly 100 receives and returns the last state, however old it is."""
        for _ in range(100):
            self._receive()
        assert self._last is not None
        return self._last

    def receive_fresh_state(self) -> State:
        """What a careful program does instead: drains the buffer, then waits for a state."""
        self._udp.setblocking(False)
        try:
            while True:
                self._udp.recv(STATE_SIZE)
        except BlockingIOError:
            pass
        self._udp.settimeout(PATIENCE)
        return self._keep(self._udp.recv(STATE_SIZE))

    def next_state(self, after: int = -1) -> State:
        """Waits for a state with a higher number."""
        self._udp.settimeout(PATIENCE)
        while True:
            state = self._keep(self._udp.recv(STATE_SIZE))
            if state.message_id > after:
                return state

    def answer(self, state: State, output: Output) -> None:
        """Sends one command, unfiltered."""
        self._send(state, output)

    def control(self, callback: Callback) -> None:
        """Runs the callback once a state until it says finished.

        Raises:
            ControlException: A state had error bits; after the first time, at the end of every later run too.
        """
        assert self._modes is not None, "mode error: the vendor's process would abort"
        memory: Output | None = None
        answered = -1
        while True:
            state = self._receive() or self._last
            assert state is not None
            if self._answers_once and state.message_id <= answered:
                continue
            if state.errors:
                self._error = self._error or ControlException(state.errors, state)
                self.stop_move()
                raise self._error
            output = callback(state)
            if output.finished:
                self.stop_move()
                if self._error is not None:
                    raise self._error
                return
            memory = low_pass(memory, output, self.filter_frequency)
            self._send(state, memory)
            answered = state.message_id

    def _send(self, state: State, output: Output) -> None:
        assert self._modes is not None
        message_id = state.message_id
        if output.tau is not None:
            assert self._modes[1] != SHOWN_AS[2], "a torque callback in a Cartesian motion aborts the vendor's process"
            data = pack_command(message_id, tau=self._padded(output.tau))
        elif output.pose is not None:
            data = pack_command(message_id, state.q, output.pose, output.psi)
        else:
            assert output.q is not None
            data = pack_command(message_id, self._padded(output.q), state.pos_m)
        self._udp.sendto(data, self._address)
        self.sent += 1

    def send_raw(self, datagram: bytes) -> None:
        """Sends any bytes from where commands come from."""
        self._udp.sendto(datagram, self._address)

    def _receive(self) -> State | None:
        self._udp.settimeout(self._receive_timeout)
        try:
            return self._keep(self._udp.recv(STATE_SIZE))
        except TimeoutError:
            self.timeouts += 1
            return None

    def _keep(self, data: bytes) -> State:
        self._last = State(data)
        if self.record_states:
            self.states.append(self._last)
        return self._last

    def _connect(self) -> None:
        try:
            self._tcp = socket.create_connection(self._address, timeout=PATIENCE)
            self._tcp.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except ConnectionRefusedError:
            self._tcp = None

    def _set(self, code: Code, payload: bytes = b"") -> None:
        status = self.ask(code, payload)[0]
        if status != 0:
            raise CommandException(code, status)

    def _padded(self, values: Sequence[float]) -> tuple[float, ...]:
        return (*values[: self.axes], *([math.nan] * (7 - self.axes)))

    def _seven(self, values: Sequence[float]) -> bytes:
        return doubles(*self._padded(values))


def low_pass(memory: Output | None, output: Output, frequency: float) -> Output:
    """Returns what the library sends: every quantity through a first-order filter, started at the first value."""
    if memory is None or frequency >= UNFILTERED:
        return output
    gain = 0.001 / (0.001 + 1.0 / (2.0 * math.pi * frequency))

    def mix(old: tuple[float, ...] | None, new: tuple[float, ...] | None) -> tuple[float, ...] | None:
        if old is None or new is None:
            return None
        return tuple(a + gain * (b - a) for a, b in zip(old, new, strict=True))

    pose = None
    if memory.pose is not None and output.pose is not None:
        pose = _mix_poses(memory.pose, output.pose, gain)
    psi = memory.psi + gain * (output.psi - memory.psi)
    return Output(mix(memory.q, output.q), pose, psi, mix(memory.tau, output.tau))


def _mix_poses(old: tuple[float, ...], new: tuple[float, ...], gain: float) -> tuple[float, ...]:
    from tests.peers.kinematics import slerp

    position = [a + gain * (b - a) for a, b in zip(old[3:12:4], new[3:12:4], strict=True)]
    rotation = slerp(old, new, gain)
    rows: list[Any] = [(*rotation[i], position[i]) for i in range(3)]
    return (*rows[0], *rows[1], *rows[2], 0.0, 0.0, 0.0, 1.0)
