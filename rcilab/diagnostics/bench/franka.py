"""The virtual controller of an FR3: computing time of a cycle, period of its states, and start-up times."""

from __future__ import annotations

import math
import socket
import struct
import time
from dataclasses import replace

import numpy as np

from rcilab.control_process.launch import start_controller
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import ConnectionLostError
from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor
from rcilab.diagnostics.bench.measure import Measurement, summarise
from rcilab.makers.driver import parse_address
from rcilab.makers.franka.controller.fci_controller import FciController
from rcilab.makers.franka.wire.command_packet import CommandPacket
from rcilab.makers.franka.wire.requests import AsyncMove, Connect, Request
from rcilab.makers.franka.wire.state_packet import encode_state
from rcilab.makers.franka.wire.versions import VERSION_10, MoveController, MoveGenerator
from rcilab.model.robot_model import load_model
from rcilab.realtime.scheduling import realtime_section
from rcilab.sim.controller_config import PLANT_KINDS, PlantKind
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

_ROBOT = "FR3"
_CYCLES = 5000
_STARTS = 5
_CONNECTIONS = 3
_AMPLITUDE = 0.05  # [rad], [m]
_PERIOD = 2.5  # [s]
_TARGETS: dict[PlantKind, float] = {"ideal": 150.0, "mujoco": 250.0}  # [us]
_LATE = 1.1e-3  # [s] Target of the 99.9th percentile of the period.
_MEAN_TOLERANCE = 1e-6  # [s] Of the mean period.
_TIMEOUT = 10.0  # [s]
_SO_TIMESTAMPNS = 35  # Linux, socket(7): the kernel adds the time of arrival to every datagram.
_DEVIATION = (0.1, 0.1, 0.1)
_HEADER = struct.Struct("<III")
_COMMAND = struct.Struct("<Q7d7d16d6d2d??7d?")
_ZEROS = (0.0,) * 7


def bench_franka_controller() -> Measurement:
    """A cycle of an FR3 whose joints move: command received and checked, plant advanced, state encoded."""
    return _in_both_plants("franka_controller", MoveGenerator.JOINT_POSITION)


def bench_franka_cartesian() -> Measurement:
    """The same with poses of the end effector, inverse kinematics included."""
    return _in_both_plants("franka_cartesian", MoveGenerator.CARTESIAN_POSITION)


def bench_franka_period(seconds: float = 10.0) -> Measurement:
    """Time between two states of a moving FR3 at its client, by the kernel's time stamps."""
    controller = start_controller(_ROBOT)
    try:
        assert controller.address is not None
        with CpuStallMonitor() as stalls, realtime_section():
            stamps = _stream(parse_address(controller.address).host, round(seconds / CYCLE_TIME))
    finally:
        controller.end()
    note = (
        f"{len(stalls.pauses)} stalls of a core; lateness of an empty loop with the highest priority: p99.9 "
        f"{1e6 * float(np.quantile(stalls.lateness, 0.999)):.0f} us"
    )
    return summarise_period(np.diff(stamps), note)


def summarise_period(periods: Array, note: str) -> Measurement:
    """Returns the row of the periods, [s], with targets for their mean and for 99.9 % of them."""
    found = summarise("franka_period", periods, "us", 1e6 * CYCLE_TIME)
    mean, p999 = float(periods.mean()), float(np.quantile(periods, 0.999))
    text = (
        f"mean {1e6 * mean:.1f} (target {1e6 * CYCLE_TIME:.1f}, within {1e6 * _MEAN_TOLERANCE:.0f}), p99.9 "
        f"{1e6 * p999:.0f} us (target {1e6 * _LATE:.0f}), max {1e6 * periods.max():.0f} us of {len(periods)} periods "
        f"while moving; {note}"
    )
    return replace(found, note=text, ok=abs(mean - CYCLE_TIME) <= _MEAN_TOLERANCE and p999 <= _LATE)


def bench_franka_connect() -> Measurement:
    """From the connection of a client to its first state; in the note, the start of `rcilab controller`."""
    starts: list[float] = []
    times: list[float] = []
    for _ in range(_STARTS):
        begin = time.perf_counter()
        controller = start_controller(_ROBOT)
        try:
            starts.append(time.perf_counter() - begin)
            assert controller.address is not None
            times += [_time_connection(parse_address(controller.address).host) for _ in range(_CONNECTIONS)]
        finally:
            controller.end()
    ready = float(np.median(starts))
    found = summarise("franka_connect", times, "s", 0.5, f"`rcilab controller` ready after {ready:.2f} s (target 2 s)")
    return replace(found, ok=bool(found.ok and ready <= 2.0))


def _in_both_plants(name: str, generator: MoveGenerator) -> Measurement:
    ideal, mujoco = (summarise(name, _time_cycles(plant, generator), "us", _TARGETS[plant]) for plant in PLANT_KINDS)
    note = f"{_ROBOT}, {_CYCLES} cycles; in MuJoCo {mujoco.median:.0f} us (target {_TARGETS['mujoco']:.0f})"
    return replace(ideal, note=note, ok=bool(ideal.ok and mujoco.ok))


def _time_cycles(plant: PlantKind, generator: MoveGenerator) -> Array:
    model = load_model(_ROBOT)
    controller = FciController(VirtualArm(model, build_plant(plant, model), prefill=0), VERSION_10)
    controller.begin_move(AsyncMove(MoveController.JOINT_IMPEDANCE, generator, _DEVIATION, _DEVIATION))
    q, T = controller.state.q_c.copy(), controller.state.T_base_tool_c.matrix.copy()
    start, height = q[3], T[2, 3]
    times = np.empty(_CYCLES)
    for k in range(_CYCLES):
        q[3], T[2, 3] = start + _displacement(k), height - _displacement(k)
        pose = tuple(T.T.ravel().tolist())
        nothing = (0.0,) * 6, (0.0, -1.0), False, False, _ZEROS, False
        packet = CommandPacket(controller.cycle_number, tuple(q.tolist()), _ZEROS, pose, *nothing)
        begin = time.perf_counter_ns()
        controller.receive(packet)
        controller.step()
        encode_state(controller.packet, VERSION_10)
        times[k] = 1e-9 * (time.perf_counter_ns() - begin)
    if controller.faults:
        raise ConnectionLostError(f"bench: the motion was stopped: {controller.reason}")
    return times


def _displacement(cycle: int) -> float:
    """A smooth motion there and back."""
    return _AMPLITUDE / 2.0 * (1.0 - math.cos(2.0 * math.pi * CYCLE_TIME * cycle / _PERIOD))


def _stream(host: str, count: int) -> Array:
    """Runs a motion of joint angles with a minimal client; returns the arrival times of its states, [s]."""
    with _Client(host) as client:
        move = AsyncMove(MoveController.JOINT_IMPEDANCE, MoveGenerator.JOINT_POSITION, _DEVIATION, _DEVIATION)
        number, q, _ = client.receive()
        client.request(move)
        stamps = np.empty(count)
        for k in range(count):
            number, _, stamps[k] = client.receive()
            client.send(number, (*q[:3], q[3] + _displacement(k), *q[4:]))
        return stamps


def _time_connection(host: str) -> float:
    begin = time.perf_counter()
    with _Client(host) as client:
        client.receive()
        return time.perf_counter() - begin


class _Client:
    """A client of version 10 that reads and sends joint angles."""

    _Q = 596  # Place of the measured joint angles in a state.

    def __init__(self, host: str) -> None:
        self._host = host
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind(("127.0.0.1", 0))
        self._udp.settimeout(_TIMEOUT)
        self._udp.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._tcp = socket.create_connection((host, 1337), _TIMEOUT)
        self._count = 0
        self._peer: tuple[str, int] = (host, 0)
        self.request(Connect(VERSION_10.number, self._udp.getsockname()[1]))

    def request(self, request: Request) -> None:
        """Sends a request and reads its first answer."""
        payload = request.layout.pack([getattr(request, field.name) for field in request.layout.fields])
        number = VERSION_10.number_of(type(request))
        self._tcp.sendall(_HEADER.pack(number, self._count, _HEADER.size + len(payload)) + payload)
        self._count += 1
        if not self._tcp.recv(256):
            raise ConnectionLostError(f"bench: the controller at {self._host} closed the connection")

    def receive(self) -> tuple[int, tuple[float, ...], float]:
        """Returns number, joint angles and arrival time of the next state."""
        data, ancillary, _, self._peer = self._udp.recvmsg(4096, 64)
        seconds, nanoseconds = struct.unpack("qq", ancillary[0][2])
        (number,) = struct.unpack_from("<Q", data)
        return number, struct.unpack_from("<7f", data, self._Q), seconds + 1e-9 * nanoseconds

    def send(self, number: int, q: tuple[float, ...]) -> None:
        """Sends joint angles."""
        rest = (*(0.0,) * 7, *(0.0,) * 16, *(0.0,) * 6, 0.0, -1.0, False, False, *(0.0,) * 7, False)
        self._udp.sendto(_COMMAND.pack(number, *q, *rest), self._peer)

    def __enter__(self) -> _Client:
        return self

    def __exit__(self, *_: object) -> None:
        self._tcp.close()
        self._udp.close()
