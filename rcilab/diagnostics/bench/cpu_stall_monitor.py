"""Monitoring of the cores of this machine during a measurement, for stalls of a whole core.

On every core an empty loop wakes up each millisecond with the highest priority. If it wakes up late, no program on that
core could run in time: the hypervisor had taken the core away, or the kernel was busy. Late cycles of a control loop
that coincide with such a stall are not its fault.

`python -m rcilab.diagnostics.bench.cpu_stall_monitor CORE` is one of those loops; it runs until its standard input
ends.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import time
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from rcilab.core.clock import CYCLE_TIME
from rcilab.realtime.scheduling import enter_realtime

SHORTEST_PAUSE = 2e-4  # [s] A longer delay is a stall; normally a loop in Python wakes up within about 0.1 ms.

_PRIORITY = 99  # Above all other processes, so that only the machine itself can delay it.


class CpuStallMonitor:
    """Runs one loop per core inside its `with` block. Owned by one thread.

    Attributes:
        pauses: After the block: every stall as a row (begin, end), monotonic, shape (m, 2), [s].
        lateness: After the block: lateness of the empty loops, shape (k,), [s].
        stolen: After the block: time for which the hypervisor took the cores, sum over all, [s].
    """

    def __init__(self) -> None:
        self.pauses: NDArray[np.float64] = np.empty((0, 2))
        self.lateness: NDArray[np.float64] = np.empty(0)
        self.stolen = 0.0
        self._loops: list[subprocess.Popen[str]] = []

    def __enter__(self) -> CpuStallMonitor:
        self.stolen = -_stolen_time()
        for core in sorted(os.sched_getaffinity(0)):
            command = [sys.executable, "-m", "rcilab.diagnostics.bench.cpu_stall_monitor", str(core)]
            self._loops.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        for loop in self._loops:
            assert loop.stdout is not None
            loop.stdout.readline()  # The loop has started.
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        found = [json.loads(loop.communicate()[0]) for loop in self._loops]
        deadlines, wakes = (np.concatenate([loop[key] for loop in found]) for key in ("deadlines", "wakes"))
        self.lateness = wakes - deadlines
        self.pauses = np.column_stack((deadlines, wakes))[self.lateness > SHORTEST_PAUSE]
        self.stolen += _stolen_time()

    def explains(self, times: NDArray[np.float64], window: NDArray[np.float64] | float) -> NDArray[np.bool_]:
        """Returns for each time, shape (k,), monotonic, [s], whether a core was stalled then or up to `window` before.

        The beginning of a stall is known to within one cycle: it may have begun one cycle earlier.
        """
        ends = np.sort(self.pauses[:, 1])
        begins = self.pauses[np.argsort(self.pauses[:, 1]), 0] - CYCLE_TIME
        first = np.searchsorted(ends, times - window)
        latest = np.append(np.minimum.accumulate(begins[::-1])[::-1], np.inf)  # Earliest begin of any later stall.
        return latest[first] <= times


def _stolen_time() -> float:
    with open("/proc/stat", encoding="ascii") as file:
        return int(file.readline().split()[8]) / 100.0  # proc(5): in hundredths of a second.


def _run_loop(core: int) -> dict[str, list[float]]:
    os.sched_setaffinity(0, {core})
    enter_realtime(_PRIORITY)
    deadlines: list[float] = []
    wakes: list[float] = []
    print("started", flush=True)
    deadline = time.monotonic()
    while True:
        deadline += CYCLE_TIME
        if select.select([sys.stdin], [], [], max(deadline - time.monotonic(), 0.0))[0]:
            return {"deadlines": deadlines, "wakes": wakes}
        now = time.monotonic()
        deadlines.append(deadline)
        wakes.append(now)
        if now - deadline > SHORTEST_PAUSE:
            deadline = now


if __name__ == "__main__":
    print(json.dumps(_run_loop(int(sys.argv[1]))))
