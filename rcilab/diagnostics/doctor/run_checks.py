"""All checks in order, the most basic first."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator

from rcilab.diagnostics.doctor import kernel, network, processor, software
from rcilab.diagnostics.doctor.finding import Finding
from rcilab.diagnostics.doctor.jitter import check_jitter
from rcilab.diagnostics.doctor.round_trip import check_controller, check_round_trip
from rcilab.diagnostics.doctor.system import System
from rcilab.diagnostics.host import BROWSERS, probe_realtime
from rcilab.makers.driver import RobotAddress


def run_checks(
    system: System,
    *,
    robot: RobotAddress | None = None,
    seconds: float = 0.0,
    progress: Callable[[float, float], None] = lambda spent, worst: None,
) -> Iterator[Finding]:
    """Yields the findings about this machine.

    Args:
        system: Files of the kernel.
        robot: Address of the robot; None: no robot.
        seconds: Duration of the jitter measurement, [s]; 0: no measurement.
        progress: Called about once per second with the elapsed time and the largest lateness so far, [s].
    """
    cores = len(os.sched_getaffinity(0))
    yield software.check_python(sys.version_info[:3])
    yield from software.check_packages("rcilab")
    yield software.check_browser(BROWSERS)
    yield software.check_address(software.CONTROLLER_ADDRESS)
    yield software.check_port(software.CONTROLLER_ADDRESS, software.CONTROLLER_PORT)
    yield kernel.check_kernel(system)
    yield kernel.check_preemption(system)
    fifo, locked = probe_realtime()
    yield kernel.check_fifo(fifo, system)
    yield kernel.check_memory_lock(locked, system)
    yield kernel.check_throttling(system)
    yield kernel.check_vendor_library(fifo, system)
    yield processor.check_cores(cores)
    yield processor.check_isolation(cores, system)
    yield processor.check_governor(system)
    yield processor.check_sleep(system)
    yield processor.check_clock(system)
    yield processor.check_hypervisor(system)
    yield network.check_buffers(system)
    yield network.check_softirq(system)
    is_for_real = False
    if robot is not None:
        finding, route = network.check_route(robot, system)
        yield finding
        if route is not None:
            is_for_real = not network.is_here(route)
            yield check_controller((route.host, robot.port), is_here=not is_for_real)
            yield check_round_trip(route.host)
    if seconds > 0.0:
        yield check_jitter(seconds, system, progress, is_for_real=is_for_real)
