"""Runs that may be long or short: streaming, motion after motion, noise. Each judges itself; see `tests/endurance`."""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from tests.peers import programs, wire
from tests.peers.arena import Process, arena
from tests.peers.fuzz import FrameFuzzer, Watcher, datagrams, good_client_works
from tests.peers.robot import PATIENCE, Output, Robot
from tests.peers.wire import State

GROWTH = 1_000_000  # [bytes] What memory may grow by.
_PRIORITY = 57  # Below every controller's.
_BATCH = 50  # Datagrams between two looks at the state.
PATIENT = {"start_sleep": 0.0, "receive_timeout": PATIENCE, "first_timeout": PATIENCE}


@contextmanager
def realtime() -> Iterator[None]:
    """Asks for SCHED_FIFO for the calling thread, as the vendor's library does, and gives it back."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(_PRIORITY))
    except OSError:
        yield
        return
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def stream(plant: str, seconds: float, *, lockstep: bool = False, warm_up: float = 1.0) -> None:
    """Streams a swing of every joint; nothing may be lost, no error bit set, and memory may not grow after warm-up.

    Running free both ends are at the mercy of the machine. The play-out is as deep as it can be: virtual machines were
    seen to stand still for 60 ms.
    """
    options = ["--plant", plant, *(["--lockstep"] if lockstep else ["--prefill", "100"])]
    with Process(*options) as controller:
        robot = Robot(controller.host, controller.port, **({**PATIENT, "start_sleep": 0.0} if lockstep else _vendor()))
        with robot, realtime():
            programs.prepare(robot, factor=0.8)
            robot.record_states = False
            worst, grown = _swing(robot, controller, seconds, warm_up)
            last = robot.receive_fresh_state()
    assert worst == 1.0, f"commands were lost: success rate {worst}"
    assert not last.errors
    assert grown < GROWTH, f"the controller grew by {grown} bytes"


def _vendor() -> dict[str, float]:
    # The library asks for 1 ms; a kernel with a tick of 250 Hz, as most have, makes 4 to 8 ms of it.
    return {"start_sleep": 1.0, "receive_timeout": 0.006, "first_timeout": PATIENCE}


def _swing(robot: Robot, controller: Process, seconds: float, warm_up: float) -> tuple[float, int]:
    robot.start_move(wire.JOINT_POSITION, wire.JOINT)
    init: list[float] = []
    worst, memory = 1.0, 0

    def callback(state: wire.State, t: float) -> Output:
        nonlocal worst, memory
        if not init:
            init.extend(state.q)
        if abs(t - warm_up) < programs.CYCLE / 2:
            memory = controller.memory()
        worst = min(worst, state.success_rate[0])
        delta = programs.swing(0.1, 2.5, t)
        return Output(q=tuple(q + delta for q in init), finished=t >= seconds)

    robot.control(programs.timed(callback))
    return worst, controller.memory() - memory


def run_motions(plant: str, count: int, *, warm_up: int = 10) -> None:
    """Starts and stops motions, one after the other; none may get stuck and this process may not grow."""
    with arena(plant=plant, mode_delay=0.001) as place, place.connect() as robot:
        robot.set_motor_power(1)
        robot.record_states = False
        threads = _threads()
        for number in range(count):
            if number == warm_up:
                memory = _own_memory()
            _small_motion(robot, number)
        grown = _own_memory() - memory
        state = robot.receive_fresh_state()
        assert (state.controller_mode, state.robot_mode) == (wire.OTHER, wire.ROBOT_IDLE)
        assert not state.errors
        assert _threads() <= threads  # Those of earlier tests may end meanwhile.
        assert grown < GROWTH, f"{count} motions made the process grow by {grown} bytes"


def _small_motion(robot: Robot, number: int) -> None:
    robot.start_move(wire.JOINT_POSITION, wire.JOINT)
    start = robot.receive_fresh_state().q_c
    joint = number % robot.axes

    def callback(state: wire.State, t: float) -> Output:
        q = list(start)
        q[joint] += programs.swing(1e-4, 0.04, t)
        return Output(q=tuple(q), finished=t > 0.04)

    robot.control(programs.timed(callback))


def fuzz_frames(count: int, seed: int, *, batch: int = 500) -> None:
    """Sends fuzzed frames; every answer and every state must be sound, and the next good client must work."""
    watcher = Watcher()
    try:
        options = ["--lockstep", "--client", f"127.0.0.1:{watcher.port}"]
        with Process(*options) as controller, FrameFuzzer((controller.host, controller.port), seed) as fuzzer:
            for _ in range(count // batch):
                fuzzer.send(batch)
                watcher.look()
            fuzzer.close()
            assert controller.process.poll() is None
    finally:
        watcher.close()


def fuzz_frames_then_work(count: int, seed: int) -> None:
    """Sends fuzzed frames to a controller that a good client then uses."""
    with Process("--lockstep") as controller:
        with FrameFuzzer((controller.host, controller.port), seed) as fuzzer:
            fuzzer.send(count)
        good_client_works(controller.host, controller.port, **PATIENT)


def fuzz_datagrams(count: int, seed: int) -> None:
    """Sends fuzzed datagrams to a resting controller; its state must stay the same, and a good client must work."""
    with Process("--lockstep") as controller:
        with _observer(controller) as robot:
            before = robot.receive_fresh_state()
            noise = datagrams(seed, min(count, 20_000))
            for start in range(0, count, _BATCH):
                for number in range(start, start + _BATCH):
                    robot.send_raw(noise[number % len(noise)])
                assert robot.receive_fresh_state().data[8:] == before.data[8:]
        good_client_works(controller.host, controller.port, **PATIENT)


def _observer(controller: Process) -> Robot:
    robot = Robot(controller.host, controller.port, **PATIENT)  # type: ignore[arg-type]
    robot.record_states = False
    return robot


def run_program(plant: str, name: str, seconds: float) -> None:
    """Runs a program as slowly as the vendor's client does: at 1 kHz, a second of sleep after each StartMove.

    The play-out is deep enough for a machine that pauses; a torque loop would ring then.
    """
    prefill = "10" if name == "torque" else "50"
    with (
        Process("--plant", plant, "--prefill", prefill) as controller,
        Robot(controller.host, controller.port, **_vendor()) as robot,
    ):  # type: ignore[arg-type]
        with realtime():
            programs.prepare(robot, factor=0.2)
            robot.states.clear()
            getattr(programs, name)(robot, seconds)
        last = robot.receive_fresh_state()
        assert not last.errors
        assert min(state.success_rate[0] for state in robot.states) > 0.99
        assert np.ptp([state.q for state in robot.states[:: len(robot.states) // 500]], axis=0).max() > 5e-3
        time.sleep(0.01)


def run_drag(plant: str, name: str, space: int, kind: int, seconds: float) -> None:
    """Leads the arm by hand at 1 kHz, the hand through the simulation port of the controller."""
    with (
        Process("--plant", plant) as controller,
        Robot(controller.host, controller.port, **_vendor()) as robot,  # type: ignore[arg-type]
        socket.create_connection((controller.host, controller.world_port)) as hand,
    ):

        def push(wrench: list[float]) -> None:
            hand.sendall(json.dumps({"request": "push", "wrench": wrench}).encode() + b"\n")
            assert json.loads(hand.recv(4096))["ok"]

        with realtime():
            programs.prepare(robot, factor=0.2)
            robot.states.clear()
            seen = programs.led_by_hand(robot, seconds, space, kind, push)
        require_led(seen, name)


def require_led(seen: Sequence[State], name: str) -> None:
    """A drag was one: in its mode, without a fault, and the tool went where the drag lets it and nowhere else."""
    assert all(state.robot_mode == wire.ROBOT_GUIDING and not state.errors for state in seen)
    T = np.reshape([state.pos_m for state in seen], (-1, 4, 4))
    way = np.linalg.norm(T[:, :3, 3] - T[0, :3, 3], axis=1).max()
    turn = np.arccos(np.clip((np.einsum("kij,ij->k", T[:, :3, :3], T[0, :3, :3]) - 1.0) / 2.0, -1.0, 1.0)).max()
    if name == "rotation":
        assert way < 8e-3  # 16 N against the stiffest spring there is, 3000 N/m.
    else:
        assert way > 0.02
    if name == "translation":
        assert turn < 0.03
    else:
        assert turn > 0.02


def _own_memory() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def _threads() -> int:
    return len(os.listdir("/proc/self/task"))
