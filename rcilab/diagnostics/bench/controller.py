"""Computing time of a cycle of the virtual controller, and the regularity of its period."""

from __future__ import annotations

import math
import socket
import struct
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rcilab.control_process.launch import VirtualController, start_controller
from rcilab.core.arrays import Array
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import DeadlineError
from rcilab.core.fault import name_faults
from rcilab.core.spatial import Pose
from rcilab.core.state import ControllerMode, MotionGeneratorMode, RobotState
from rcilab.diagnostics.bench.compute import motion_of
from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor
from rcilab.diagnostics.bench.measure import Measurement, summarise, summarise_rate
from rcilab.diagnostics.host import probe_realtime
from rcilab.makers.driver import parse_address
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.realtime.scheduling import realtime_section
from rcilab.sim.controller_config import PLANT_KINDS, PlantKind
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

_ROBOT = "xMatePro7"
_DURATION = 5.0  # [s] of simulated motion.
_DEPTH = 0.05  # [m] that the tool goes down and up.
_TARGETS: dict[PlantKind, float] = {"ideal": 150.0, "mujoco": 250.0}  # [us]
_RATE_TARGET = 2.0  # [times real time] In lock-step.
_SPAN = 100  # [cycles] Of which the speed is measured.
_JITTER_TARGET = 100.0  # [us] Largest deviation of 99.9 % of the periods.
_TIMEOUT = 10.0  # [s]
_RECOVERY_TIME = 0.005  # [s] After a stall of a core, for which it can still delay a period.
_SO_TIMESTAMPNS = 35  # Linux, socket(7): the kernel adds the time of arrival to every datagram.

Command = Callable[[int, int], bytes]
"""`(message id, cycle) -> datagram`."""


def bench_controller_ideal() -> Measurement:
    """A cycle while every joint moves: command received and checked, plant advanced, state sent."""
    return _bench_plant("ideal")


def bench_controller_mujoco() -> Measurement:
    """The same with MuJoCo."""
    return _bench_plant("mujoco")


def _bench_plant(plant: PlantKind) -> Measurement:
    model = load_model(_ROBOT)
    return _measure(f"controller_{plant}", model, plant, rci.StartMove(0, 1), joint_commands(model, _DURATION))


def bench_controller_cartesian() -> Measurement:
    """The same while the tool is commanded, inverse kinematics included; with MuJoCo in the note."""
    model = load_model(_ROBOT)
    return _in_both_plants("controller_cartesian", model, rci.StartMove(1, 2), _line_commands(model, _DURATION))


def bench_controller_impedance() -> Measurement:
    """The same with Cartesian impedance, the most expensive mode; joint impedance and torque in the note."""
    model = load_model(_ROBOT)
    found = _in_both_plants("controller_impedance", model, rci.StartMove(3, 2), _line_commands(model, _DURATION))
    others: list[str] = []
    for start, commands in (
        (rci.StartMove(2, 1), joint_commands(model, _DURATION)),
        (rci.StartMove(4, 0), lambda message_id, cycle: rci.encode_command(rci.CommandPacket(message_id))),
    ):
        ideal, mujoco = (_measure("controller_impedance", model, plant, start, commands) for plant in PLANT_KINDS)
        others.append(f"{_mode_name(start)} {ideal.median:.0f} us, in MuJoCo {mujoco.median:.0f} us")
    return replace(found, note="; ".join((found.note, *others)))


def _in_both_plants(name: str, model: RobotModel, start: rci.StartMove, commands: Command) -> Measurement:
    found, other = (_measure(name, model, plant, start, commands) for plant in PLANT_KINDS)
    note = f"{found.note}; in MuJoCo {other.median:.0f} us, p99 {other.p99:.0f} us"
    return replace(found, note=note, ok=bool(found.ok and other.ok))


def bench_state_period(seconds: float = 10.0) -> Measurement:
    """Deviation of the time between two states from 1 ms, free-running and moving, by the kernel's time stamps.

    The target is for 99.9 % of the periods, and only if the controller gets SCHED_FIFO.
    """
    return measure_period("state_period", start_controller(_ROBOT), seconds)[0]


def measure_period(name: str, controller: VirtualController, seconds: float) -> tuple[Measurement, int | None]:
    """Returns the row of `bench_state_period` for a controller and the number of late cycles; ends the controller.

    The number is None if the motion was stopped by a fault. The client has the priority of one that controls an arm.

    Args:
        name: Name of the row.
        controller: A free-running controller without a client.
        seconds: Duration of the motion, [s].
    """
    commands = joint_commands(load_model(_ROBOT), seconds)
    try:
        assert controller.address is not None
        address = parse_address(controller.address)
        with CpuStallMonitor() as stalls, realtime_section():
            stamps, faults = _stream(address.host, address.port, commands, round(seconds / CYCLE_TIME))
    finally:
        controller.end()
    deviation = np.abs(np.diff(stamps) - CYCLE_TIME)
    found = summarise(name, deviation, "us", _JITTER_TARGET)
    p999, largest = 1e6 * float(np.quantile(deviation, 0.999)), 1e6 * float(deviation.max())
    has_fifo = probe_realtime()[0]
    irregular = stamps[1:][1e6 * deviation > _JITTER_TARGET]
    late = int((deviation > CYCLE_TIME).sum())
    note = (
        f"|period - 1 ms| of {len(stamps)} states while moving; p99.9 {p999:.0f}, max {largest:.0f} us; {late} off by "
        f"more than 1 ms, {len(irregular)} by more than {_JITTER_TARGET:g} us, "
        f"{int(stalls.explains(irregular, _RECOVERY_TIME).sum())} of them after one of {len(stalls.pauses)} stalls "
        "of a core; lateness of an empty loop with the highest priority: p99.9 "
        f"{1e6 * float(np.quantile(stalls.lateness, 0.999)):.0f} us"
    )
    if not has_fifo:
        note += "; SCHED_FIFO NOT PERMITTED, so there is no target"
    if faults:
        note += f"; THE MOTION WAS STOPPED BY {faults}"
    ok = p999 <= _JITTER_TARGET and not faults if has_fifo else None
    return replace(found, note=note, ok=ok), None if faults else late


def bench_lockstep() -> Measurement:
    """Speed of a whole motion in lock-step: a client over sockets, which answers each state at once."""
    model = load_model(_ROBOT)
    commands = joint_commands(model, _DURATION)
    rates: list[Measurement] = []
    for plant in PLANT_KINDS:
        controller = start_controller(_ROBOT, plant, lockstep=True)
        try:
            assert controller.address is not None
            address = parse_address(controller.address)
            stamps, faults = _stream(address.host, address.port, commands, round(_DURATION / CYCLE_TIME))
        finally:
            controller.end()
        rates.append(summarise_rate("lockstep", np.diff(stamps[::_SPAN]) / _SPAN, _RATE_TARGET))
        if faults:
            return replace(rates[-1], ok=False, note=f"THE MOTION WAS STOPPED BY {faults}")
    found, other = rates
    return replace(
        found,
        note=f"{_ROBOT}, {_DURATION:g} s of motion and a client in Python; median of spans of {_SPAN} cycles, and what "
        f"99 % of them exceed; in MuJoCo {other.median:.1f} times",
    )


def joint_commands(model: RobotModel, duration: float) -> Command:
    """Returns the commands of a motion of all joints from the home pose; after its end they are constant."""
    rows = [(*row, *[0.0] * (7 - model.n)) for row in motion_of(model, duration, model.home).q.tolist()]

    def command(message_id: int, cycle: int) -> bytes:
        return rci.encode_command(rci.CommandPacket(message_id, rows[min(cycle, len(rows) - 1)]))

    return command


def _line_commands(model: RobotModel, duration: float) -> Command:
    home, psi = model.forward(model.home), model.arm_angle(model.home)
    numbers: list[tuple[float, ...]] = []
    for cycle in range(round(duration / CYCLE_TIME)):
        depth = _DEPTH / 2.0 * (1.0 - math.cos(math.tau * cycle * CYCLE_TIME / 2.5))
        numbers.append(Pose(position=home.position - (0.0, 0.0, depth), wxyz=home.wxyz).as_row_major())

    def command(message_id: int, cycle: int) -> bytes:
        pose = numbers[min(cycle, len(numbers) - 1)]
        return rci.encode_command(rci.CommandPacket(message_id, T_base_tool_c=pose, psi_valid=True, psi_c=psi))

    return command


def _measure(name: str, model: RobotModel, plant: PlantKind, start: rci.StartMove, command: Command) -> Measurement:
    cycle = RciController(VirtualArm(model, build_plant(plant, model), prefill=0), mode_delay=0)
    cycle.handle(rci.SetMotorPower(1))
    resting = _times(cycle, lambda message_id, k: None, 1000)
    cycle.handle(start)
    while cycle.state.controller_mode is ControllerMode.OTHER and cycle.state.message_id < 2000:
        cycle.step()
    moving = _times(cycle, command, round(_DURATION / CYCLE_TIME))
    note = f"{_ROBOT}, {_mode_name(start)}, {_DURATION:g} s of motion; at rest {1e6 * np.median(resting):.0f} us"
    found = summarise(name, moving, "us", _TARGETS[plant], note)
    if cycle.state.controller_mode is ControllerMode.OTHER:
        return replace(found, ok=False, note=f"{note}; THE MOTION DID NOT RUN: {cycle.reason or 'refused'}")
    return found


def _mode_name(start: rci.StartMove) -> str:
    return ControllerMode(start.controller_mode).name.lower().replace("_", " ")


def _times(cycle: RciController, command: Callable[[int, int], bytes | None], count: int) -> Array:
    """Returns the time of each cycle, from the bytes of the command to those of the state, shape (count,), [s]."""
    times = np.empty(count)
    for k in range(count):
        datagram = command(cycle.state.message_id, k)
        start = time.perf_counter_ns()
        if datagram is not None:
            cycle.receive(rci.decode_command(datagram, cycle.model.n))
        rci.encode_state(cycle.step())
        times[k] = 1e-9 * (time.perf_counter_ns() - start)
    return times


def _stream(host: str, port: int, command: Command, count: int) -> tuple[Array, str]:
    """Runs a motion with a minimal client; returns the arrival times of the states, [s], and the faults of the last."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp,
        socket.create_connection((host, port), timeout=_TIMEOUT) as tcp,
    ):
        udp.bind(("127.0.0.1", 0))
        udp.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        udp.settimeout(_TIMEOUT)
        requests = rci.Connect(udp.getsockname()[1]), rci.SetMotorPower(1), rci.StartMove(0, 1)
        for number, request in enumerate(requests):
            tcp.sendall(rci.encode_request(request, number))
            tcp.recv(rci.HEADER.size + 1)
        state, _ = _receive(udp)
        deadline = time.monotonic() + _TIMEOUT
        while state.motion_generator_mode is MotionGeneratorMode.IDLE:
            if time.monotonic() > deadline:
                raise DeadlineError(f"bench: the controller at {host}:{port} did not start the motion; try again")
            state, _ = _receive(udp)
        stamps, offset = np.empty(count), time.monotonic() - time.time()
        for k in range(count):
            udp.sendto(command(state.message_id, k), (host, port))
            state, stamps[k] = _receive(udp)
        return stamps + offset, name_faults(state.faults)


def _receive(udp: socket.socket) -> tuple[RobotState, float]:
    data, ancillary, _, _ = udp.recvmsg(2048, 64)
    seconds, nanoseconds = struct.unpack("qq", ancillary[0][2])
    return rci.decode_state(data, 7), seconds + 1e-9 * nanoseconds
