"""Cost of the controller's own record, per cycle."""

from __future__ import annotations

import time

import numpy as np

from rcilab.core.cycle_ring import CycleRing
from rcilab.core.state import ControllerMode
from rcilab.diagnostics.bench.controller import joint_commands
from rcilab.diagnostics.bench.measure import Measurement, summarise
from rcilab.makers.rokae import wire as rci
from rcilab.makers.rokae.controller.rci_controller import RciController
from rcilab.model.robot_model import load_model
from rcilab.sim.arm_command import ArmCommand
from rcilab.sim.cycle_capture import CycleCapture
from rcilab.sim.plants import build_plant
from rcilab.sim.virtual_arm import VirtualArm

_ROBOT = "xMatePro7"
_CYCLES = 5000


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
