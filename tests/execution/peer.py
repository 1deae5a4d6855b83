"""A scripted controller on real sockets: as small as the wire allows, and able to misbehave on request.

It answers every request, streams states, and in a motion waits for the answer to each state (repeating the state every
few milliseconds, as a lock-step controller does), so that no test depends on how busy the machine is.
"""

from __future__ import annotations

import select
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rcilab.core.command import JointPosition
from rcilab.core.spatial import IDENTITY
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotMode, RobotState
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")
HOST = "127.0.0.2"
MODE_DELAY = 10  # States between StartMove and the new modes.


@dataclass
class Script:
    """What the peer does differently from a friendly controller."""

    q: np.ndarray = field(default_factory=lambda: np.array([0.1, 0.2, 0.3, 0.9, -0.1, 0.5, 0.0]))
    statuses: dict[type[rci.Request], int] = field(default_factory=dict)
    safety_stop: rci.SafetyStop = rci.SafetyStop.NONE
    silent_requests: tuple[type[rci.Request], ...] = ()
    split_responses: bool = False
    stale_responses: bool = False
    fault_at: int | None = None
    fault: Fault = Fault.COMMAND_JOINT_VELOCITY_LIMITS_VIOLATION
    fault_on_stop: bool = False
    silent_at: int | None = None
    end_at: int | None = None
    skip_at: int | None = None
    on_state: Callable[[socket.socket, tuple[str, int]], None] | None = None


class Peer:
    def __init__(self, script: Script | None = None) -> None:
        self.script = script or Script()
        self._tcp = socket.create_server((HOST, 0))
        self.port: int = self._tcp.getsockname()[1]
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind((HOST, self.port))
        self._udp.setblocking(False)
        self.requests: list[rci.Request] = []
        self.commands: list[rci.CommandPacket] = []
        self.q_c: list[np.ndarray] = []
        self._id = 1000
        self._mode: tuple[ControllerMode, MotionGeneratorMode] | None = None
        self._pending_mode = 0
        self._next_mode: tuple[ControllerMode, MotionGeneratorMode] | None = None
        self._cycle = 0
        self._faults: tuple[Fault, ...] = ()
        self._q = np.array(self.script.q)
        self._stop = threading.Event()
        self.error: BaseException | None = None
        self._thread = threading.Thread(target=self._guarded)
        self._thread.start()

    @property
    def url(self) -> str:
        return f"rci://{HOST}:{self.port}"

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._tcp.close()
        self._udp.close()
        if self.error is not None:
            raise self.error

    def __enter__(self) -> Peer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _guarded(self) -> None:
        try:
            self._serve()
        except BaseException as error:
            self.error = error

    def _serve(self) -> None:
        while not self._stop.is_set():
            if not select.select([self._tcp], [], [], 0.02)[0]:
                continue
            connection, client = self._tcp.accept()
            to = (client[0], self.port)
            with connection:
                connection.setblocking(False)
                self._attend(connection, to)

    def _attend(self, connection: socket.socket, to: tuple[str, int]) -> None:
        reader = rci.FrameReader()
        sent_at, answered = 0.0, True
        while not self._stop.is_set():
            now = time.monotonic()
            if self._may_stream() and (answered or now - sent_at > 0.005):
                if answered:
                    self._advance()
                self._udp.sendto(rci.encode_state(self._state()), to)
                if self.script.on_state is not None:
                    self.script.on_state(self._udp, to)
                sent_at, answered = now, self._mode is None
            select.select([connection, self._udp], [], [], 0.001)
            for packet in self._take_commands():
                self.commands.append(packet)
                if self._mode is not None and packet.message_id == self._id:
                    answered = True
                    if self._mode[1] == MotionGeneratorMode.JOINT_POSITION and not self._faults:
                        self._q = np.array(packet.q_c)
            try:
                data = connection.recv(4096)
            except BlockingIOError:
                continue
            except ConnectionError:
                return
            if not data:
                return
            for frame in reader.feed(data):
                self._answer(connection, frame)
                answered = True

    def _may_stream(self) -> bool:
        return self.script.silent_at is None or self._cycle < self.script.silent_at

    def _advance(self) -> None:
        self._id += 1
        if self._pending_mode:
            self._pending_mode -= 1
            if not self._pending_mode:
                self._mode, self._cycle = self._next_mode, 0
        elif self._mode is not None:
            self._cycle += 1
            self.q_c.append(self._q)
            if self._cycle == self.script.skip_at:
                self._id += 5
            if self._cycle == self.script.fault_at:
                self._faults = (self.script.fault,)
            if self._cycle == self.script.end_at:
                self._mode = None

    def _take_commands(self) -> list[rci.CommandPacket]:
        packets = []
        while True:
            try:
                packets.append(rci.decode_command(self._udp.recv(2048), len(self._q)))
            except BlockingIOError:
                return packets

    def _answer(self, connection: socket.socket, frame: bytes) -> None:
        command_id, request = rci.decode_request(frame)
        self.requests.append(request)
        if isinstance(request, self.script.silent_requests):
            return
        status = self.script.statuses.get(type(request), 0)
        if isinstance(request, rci.StartMove) and not status:
            shown = rci.StartMotionMode(request.motion_mode).shown_as
            self._next_mode, self._pending_mode = (ControllerMode(request.controller_mode), shown), MODE_DELAY
        if isinstance(request, rci.StopMove):
            self._mode, self._pending_mode = None, 0
            if self.script.fault_on_stop:
                self._faults = (self.script.fault,)
        if isinstance(request, rci.AutomaticErrorRecovery):
            self._faults = ()
            self.script.fault_at, self.script.fault_on_stop = None, False
        response = {
            rci.GetMotorState: rci.MotorStateResponse(1),
            rci.GetSafetyStopState: rci.SafetyStopResponse(self.script.safety_stop),
            rci.GetDIState: rci.DigitalInputResponse(rci.SettingStatus.SUCCESS, True),
            rci.LoadRobotModel: rci.ModelResponse(_DH_PRO7, (0.0,) * 66, (0.0,) * 45),
        }.get(type(request)) or rci.StatusResponse(rci.STATUS_TYPES[request.code](status))
        data = rci.encode_response(request.code, command_id, response)
        if self.script.stale_responses:
            stale = rci.encode_response(request.code, command_id + 77, response)
            connection.sendall(stale)
        if self.script.split_responses:
            step = max(1, len(data) // 20)
            for start in range(0, len(data), step):
                connection.sendall(data[start : start + step])
                time.sleep(0.001)
        else:
            connection.sendall(data)

    def _state(self) -> RobotState:
        n = len(self._q)
        zeros, six = np.zeros(n), np.zeros(6)
        mode = self._mode or (ControllerMode.OTHER, MotionGeneratorMode.IDLE)
        return RobotState(
            message_id=self._id, q=self._q, q_c=self._q, dq=zeros, dq_c=zeros, ddq_c=zeros,
            T_base_tool=IDENTITY, T_base_tool_c=IDENTITY, tool_velocity_c=six, tool_acceleration_c=six,
            psi=0.0, psi_c=0.0, dpsi_c=0.0, ddpsi_c=0.0, tau=zeros, tau_filtered=zeros, tau_c=zeros, dtau_c=zeros,
            tau_ext_in_base=six, tau_ext_in_stiff=six, theta=zeros, dtheta=zeros, motor_tau=zeros,
            motor_tau_filtered=zeros, faults=self._faults, success_rate=1.0, motion_generator_mode=mode[1],
            controller_mode=mode[0], robot_mode=RobotMode.MOVE if self._mode else RobotMode.IDLE,
        )  # fmt: skip


_DH_PRO7 = tuple(number for d in (404.0, 0.0, 437.5, 0.0, 412.5, 0.0, 275.5) for number in (0.0, 0.0, d, 0.0))


def wave(cycles: int, joint: int = 0, size: float = 0.02):
    """Returns a callback that turns a joint by `size` with the least jerk."""
    s = np.arange(cycles + 1) / cycles
    rows = size * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
    start = {}

    def callback(state, t):
        start.setdefault("q", state.q_c)
        k = min(round(t / 0.001), cycles)
        q = np.array(start["q"])
        q[joint] += rows[k]
        return JointPosition(q, finished=k == cycles)

    return callback


def assert_controlled_stop(peer: Peer) -> None:
    """What was commanded ends at rest and keeps velocity, acceleration and jerk limits to its last sample."""
    q = np.array([packet.q_c for packet in peer.commands])
    limits = MODEL.limits.joint
    assert np.abs(np.diff(q, axis=0)[-1]).max() < 1e-9
    assert (np.abs(np.diff(q, axis=0)) / 1e-3 <= limits.velocity).all()
    assert (np.abs(np.diff(q, 2, axis=0)) / 1e-6 <= limits.acceleration).all()
    assert (np.abs(np.diff(q, 3, axis=0)) / 1e-9 <= limits.jerk).all()
    assert isinstance(peer.requests[-1], rci.StopMove)
