"""A controller of each maker on this machine, all driven at the same time, each by the client library of its maker."""

from __future__ import annotations

import json
import os
import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from types import MappingProxyType
from typing import IO

from rcilab.control_process.launch import start_controller
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import ConnectionLostError
from rcilab.core.optional_deps import Extra, MissingExtraError, require_installed
from rcilab.diagnostics.bench.child_guard import guard, launch
from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise

ARMS = ("xMatePro7", "FR3", "xArm7", "RM75")
_LIBRARIES: MappingProxyType[str, Extra] = MappingProxyType(
    {"pylibfranka": "franka", "xarm": "xarm", "Robotic_Arm": "realman"}
)
"""Of the clients, and the extra of each; the xMate is driven by rcilab itself."""

_WARM_UP = 6.0  # [s] In which the clients start, on a busy machine.
_END_TIMEOUT = 60.0  # [s] Of a client, after the time is over.


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven:
    """A controller and its client, after both were driven."""

    name: str
    cpu: float
    """Processor time of the controller per second, after the warm-up."""
    growth: int
    """Of the resident memory of the controller, after the warm-up, [bytes]."""
    motions: int
    """Motions that the client executed, each to its end."""
    lost: int
    """Cycles of these motions without a command of their own, where the client streams."""


def bench_four_makers(seconds: float = 10.0) -> Measurement | Absent:
    """Processor time of a controller per simulated millisecond, while the arms of four makers move at the same time."""
    try:
        for library, extra in _LIBRARIES.items():
            require_installed(library, "this row", extra)
    except MissingExtraError as error:
        return Absent(name="four_makers", note=str(error))
    with CpuStallMonitor() as stalls:
        found = drive_together(_WARM_UP + seconds, _WARM_UP)
    arms = ", ".join(f"{arm.name} {1e6 * CYCLE_TIME * arm.cpu:.0f} us ({arm.lost} lost)" for arm in found)
    note = (
        f"{arms}; each driven by the library of its maker for {seconds:g} s; empty loops with the highest priority "
        f"were late by {1e3 * float(stalls.lateness.max()):.1f} ms at most"
    )
    return summarise("four_makers", [CYCLE_TIME * arm.cpu for arm in found], "us", None, note)


def drive_together(seconds: float, warm_up: float) -> list[Driven]:
    """Drives one arm of each maker, all at the same time; each client moves its arm there and back.

    Args:
        seconds: Duration, with the warm-up, [s].
        warm_up: Time from which on processor time and memory are measured, [s].

    Raises:
        ConnectionLostError: A controller did not start, or a client ended with an error; the message has its last line.
    """
    with ExitStack() as stack:
        controllers = []
        for name in ARMS:
            controllers.append(start_controller(name))
            stack.callback(controllers[-1].end)
        outputs: list[IO[str]] = []
        clients = []
        for controller in controllers:
            outputs.append(stack.enter_context(TemporaryFile("w+")))
            command = [sys.executable, "-m", "rcilab.diagnostics.bench.official_clients", controller.address or ""]
            clients.append(stack.enter_context(guard([*command, str(seconds)], output=outputs[-1])))
            launch(clients[-1])
        pids = [controller.pid or 0 for controller in controllers]
        time.sleep(warm_up)
        begin, before = time.monotonic(), [(_cpu_time(pid), _memory(pid)) for pid in pids]
        time.sleep(seconds - warm_up)
        elapsed, after = time.monotonic() - begin, [(_cpu_time(pid), _memory(pid)) for pid in pids]
        found = []
        for k, name in enumerate(ARMS):
            (cpu, memory), (last_cpu, last_memory) = before[k], after[k]
            result = _result(name, clients[k].wait(_END_TIMEOUT), outputs[k])
            found.append(Driven(name=name, cpu=(last_cpu - cpu) / elapsed, growth=last_memory - memory, **result))
        return found


def _result(name: str, code: int, output: IO[str]) -> dict[str, int]:
    """Returns what a client printed at its end."""
    output.seek(0)
    last = next((line for line in reversed(output.read().splitlines()) if line.strip()), "it printed nothing")
    if code != 0:
        raise ConnectionLostError(f"bench: the client of the {name} ended with an error: {last}")
    return json.loads(last)


def _cpu_time(pid: int) -> float:
    """Returns the processor time that a process has used, [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _memory(pid: int) -> int:
    """Returns the resident memory of a process, [bytes]."""
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGESIZE")
