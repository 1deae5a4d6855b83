"""Cost of the controller's own record: per cycle, and with a page that watches it."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from rcilab.control_process.launch import start_controller
from rcilab.core.cycle_ring import CycleRing
from rcilab.core.errors import ConnectionLostError
from rcilab.core.state import ControllerMode
from rcilab.diagnostics.bench.browser import open_page, why_no_page
from rcilab.diagnostics.bench.controller import joint_commands, measure_period
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.model.robot_model import load_model
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.cycle_capture import CycleCapture
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

_ROBOT = "xMatePro7"
_CYCLES = 5000
_WARM_UP = 6.0  # [s] The browser compiles shaders and uploads meshes first.


def bench_record() -> Measurement:
    """Recording of one cycle of a moving arm: the row of the state, and the command when it arrives."""
    model = load_model(_ROBOT)
    controller = RciController(VirtualArm(model, build_plant("ideal", model), prefill=0), mode_delay=0)
    ring = CycleRing.create(model.n, {})
    capture = CycleCapture(ring, controller)
    record_command, spent = controller.arm.on_command, 0

    def timed(command: ArmCommand) -> None:
        nonlocal spent
        start = time.perf_counter_ns()
        record_command(command)
        spent += time.perf_counter_ns() - start

    controller.arm.on_command = timed
    controller.handle(rci.SetMotorPower(1))
    controller.handle(rci.StartMove(0, 1))
    while controller.state.controller_mode is ControllerMode.OTHER:
        controller.step()
        capture.write()
    commands, times = joint_commands(model, 1e-3 * _CYCLES), np.empty(_CYCLES)
    for k in range(_CYCLES):
        spent = 0
        controller.receive(rci.decode_command(commands(controller.state.message_id, k), model.n))
        controller.step()
        start = time.perf_counter_ns()
        capture.write()
        times[k] = 1e-9 * (spent + time.perf_counter_ns() - start)
    rows = ring.open_reader().last(_CYCLES)
    note = (
        f"{_ROBOT}, {int((rows['played'] != 0).sum())} of {_CYCLES} cycles with their command, every field of the state"
    )
    ring.close()
    return summarise("record", times, "us", 10.0, note)


def bench_watching(seconds: float = 10.0) -> Measurement | Absent:
    """`state_period` while every motion is recorded in a file and a page in a real browser watches.

    The target: no more cycles are off by more than 1 ms than without the page, which is measured before and after.
    """
    if (reason := why_no_page()) is not None:
        return Absent(name="watching", note=reason)
    with tempfile.TemporaryDirectory() as folder:
        options = ("--record", folder)

        def alone() -> tuple[Measurement, int | None]:
            return measure_period("watching", start_controller(_ROBOT, options=options), seconds)

        before, late_before = alone()
        controller = start_controller(_ROBOT, options=options)
        assert controller.world_address is not None
        with _watching_page(controller.world_address) as url, open_page(url):
            time.sleep(_WARM_UP)
            found, late = measure_period("watching", controller, seconds)
        _, late_after = alone()
    note = f"{found.note}; WITHOUT THE PAGE, BEFORE: {before.note}; AFTER: {late_after} off by more than 1 ms"
    most = max((count for count in (late_before, late_after) if count is not None), default=0)
    is_clean = None if found.ok is None else late is not None and late <= most
    return replace(found, note=note, target=None, ok=is_clean)


@contextmanager
def _watching_page(address: str) -> Iterator[str]:
    """Serves `rcilab watch ADDRESS` in a process of its own; yields its address for a browser."""
    command = [
        sys.executable,
        "-m",
        "rcilab.cli",
        "watch",
        address,
        "--port",
        "0",
        "--no-browser",
        "--quality",
        "light",
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        found = re.search(r"http\S+", process.stdout.readline())
        if found is None:
            raise ConnectionLostError("bench: `rcilab watch` did not start")
        yield found[0]
    finally:
        process.terminate()
        process.wait()
