"""The virtual controller of an xArm7: time to its answers, lateness of its reports, and start-up times."""

from __future__ import annotations

import math
import selectors
import socket
import struct
import time
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from rcilab.control_process.launch import start_controller
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import ConnectionLostError
from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor
from rcilab.diagnostics.bench.measure import Measurement, summarise
from rcilab.makers.ufactory.bounds import CLIENT_PORT
from rcilab.makers.ufactory.driver.address import parse_address
from rcilab.makers.ufactory.driver.links import Endpoint, find_arm
from rcilab.makers.ufactory.wire.frame import HEADER_SIZE, PRIVATE
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.reports import REPORTS, RICH
from rcilab.realtime.scheduling import realtime_section

_ROBOT = "xArm7"
_SERVO_PERIOD = 0.004  # [s] The interface takes up to 250 Hz.
_AMPLITUDE = 0.05  # [rad]
_SINE_PERIOD = 2.5  # [s]
_CLIENTS = 10  # At the report ports.
_LATE = 0.005  # [s] A report that follows the one before it by this much more than its period is late.
_LARGEST_P99 = 1e-3  # [s] From a request to its answer.
_LONGEST_START = 2.0  # [s] Of `rcilab controller`.
_STARTS = 5
_CONNECTIONS = 3
_TIMEOUT = 10.0  # [s]
_HEADER = struct.Struct(">HHHB")
_ALL_JOINTS = 8


def bench_xarm_answer(seconds: float = 10.0) -> Measurement:
    """From a request of mode 1 to its answer, at 250 Hz while the arm moves."""
    controller = start_controller(_ROBOT)
    try:
        assert controller.address is not None
        with CpuStallMonitor() as stalls, realtime_section():
            times = _stream(_endpoint(controller.address), round(seconds / _SERVO_PERIOD))
    finally:
        controller.end()
    found = summarise("xarm_answer", times, "ms", 0.3)
    p99 = float(np.percentile(times, 99))
    note = f"set_servo_angle_j at 250 Hz, p99 target {1e3 * _LARGEST_P99:g} ms, max {1e3 * times.max():.2f} ms; "
    return replace(found, note=note + _control_row(stalls), ok=bool(found.ok and p99 <= _LARGEST_P99))


def bench_xarm_reports(seconds: float = 10.0) -> Measurement:
    """Lateness of reports at ten clients at once, of all four report ports; the target is the largest."""
    controller = start_controller(_ROBOT)
    try:
        assert controller.address is not None
        with CpuStallMonitor() as stalls, realtime_section():
            lateness = _listen(_endpoint(controller.address), seconds)
    finally:
        controller.end()
    found = summarise("xarm_reports", lateness, "ms", None)
    late = int(np.count_nonzero(lateness > _LATE))
    note = (
        f"{_CLIENTS} clients, {len(lateness)} reports, {late} later than {1e3 * _LATE:g} ms (target 0), max "
        f"{1e3 * lateness.max():.1f} ms; {_control_row(stalls)}"
    )
    return replace(found, note=note, ok=late == 0)


def bench_xarm_connect() -> Measurement:
    """From the connection of a client to its first report; in the note, the start of `rcilab controller`."""
    starts: list[float] = []
    times: list[float] = []
    for _ in range(_STARTS):
        begin = time.perf_counter()
        controller = start_controller(_ROBOT)
        try:
            starts.append(time.perf_counter() - begin)
            assert controller.address is not None
            times += [_time_connection(_endpoint(controller.address)) for _ in range(_CONNECTIONS)]
        finally:
            controller.end()
    ready = float(np.median(starts))
    note = f"`rcilab controller` ready after {ready:.2f} s (target {_LONGEST_START:g} s)"
    found = summarise("xarm_connect", times, "s", None, note)
    return replace(found, ok=ready <= _LONGEST_START)


def _control_row(stalls: CpuStallMonitor) -> str:
    return (
        f"{len(stalls.pauses)} stalls of a core; lateness of an empty loop with the highest priority: p99 "
        f"{1e3 * float(np.quantile(stalls.lateness, 0.99)):.2f}, max {1e3 * float(stalls.lateness.max()):.2f} ms"
    )


def _endpoint(address: str) -> Endpoint:
    return find_arm(parse_address(address), _TIMEOUT)[1]


def _stream(endpoint: Endpoint, count: int) -> Array:
    """Moves joint 4 by servo targets; returns the time to each answer, [s]."""
    times = np.empty(count)
    with endpoint.connect(CLIENT_PORT, _TIMEOUT) as link:
        _ask(link, Function.MOTION_ENABLE, struct.pack("2B", _ALL_JOINTS, 1))
        _ask(link, Function.SET_MODE, b"\1")
        _ask(link, Function.SET_STATE, b"\0")
        q = struct.unpack("<7f", _ask(link, Function.GET_JOINTS, b""))
        begin = time.perf_counter()
        for k in range(count):
            time.sleep(max(0.0, begin + k * _SERVO_PERIOD - time.perf_counter()))
            moved = _AMPLITUDE / 2.0 * (1.0 - math.cos(2.0 * math.pi * k * _SERVO_PERIOD / _SINE_PERIOD))
            target = struct.pack("<10f", *q[:3], q[3] + moved, *q[4:], 0.0, 0.0, 0.0)
            sent = time.perf_counter()
            _ask(link, Function.SERVO_JOINT, target)
            times[k] = time.perf_counter() - sent
    return times


def _ask(link: socket.socket, function: Function, payload: bytes) -> bytes:
    """Returns the payload of the answer to a request."""
    link.sendall(_HEADER.pack(1, PRIVATE[0], 1 + len(payload), function) + payload)
    answer = link.recv(4096)
    if len(answer) < HEADER_SIZE + 2:
        raise ConnectionLostError("bench: the controller closed the connection")
    return answer[HEADER_SIZE + 2 :]


def _listen(endpoint: Endpoint, seconds: float) -> Array:
    """Returns by how much more than its period each report follows the one before it, at ten clients, [s]."""
    arrivals: dict[int, list[float]] = {client: [] for client in range(_CLIENTS)}
    layouts = [REPORTS[client % len(REPORTS)] for client in range(_CLIENTS)]
    with ExitStack() as stack, selectors.DefaultSelector() as selector:
        for client, layout in enumerate(layouts):
            link = stack.enter_context(endpoint.connect(layout.port, _TIMEOUT))
            link.recv(layout.size, socket.MSG_WAITALL)  # The one at connection has no period.
            selector.register(link, selectors.EVENT_READ, client)
        deadline = time.perf_counter() + seconds
        while (left := deadline - time.perf_counter()) > 0.0:
            for key, _ in selector.select(left):
                link = key.fileobj
                assert isinstance(link, socket.socket)
                link.recv(layouts[key.data].size, socket.MSG_WAITALL)
                arrivals[key.data].append(time.perf_counter())
    periods = (np.diff(times) - CYCLE_TIME * layouts[client].period for client, times in arrivals.items())
    return np.maximum(np.concatenate(list(periods)), 0.0)


def _time_connection(endpoint: Endpoint) -> float:
    begin = time.perf_counter()
    with endpoint.connect(CLIENT_PORT, _TIMEOUT) as link, endpoint.connect(RICH.port, _TIMEOUT) as reports:
        _ask(link, Function.GET_VERSION, b"")
        reports.recv(RICH.size, socket.MSG_WAITALL)
        return time.perf_counter() - begin
