"""Watches the machine's cores while something else runs on them: how often a core itself stood still.

On every core a loop that does nothing wakes up each millisecond under the highest priority there is. When it wakes up
late, nothing on that core ran in time: the hypervisor had taken the core away, or the kernel did not let go of it. No
program can be punctual there, so a control loop is blamed only for what is left.

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

SHORTEST_PAUSE = 2e-4  # [s] Later than this is a pause; a loop in Python wakes up within some 0.1 ms otherwise.

_PRIORITY = 99  # Above everything else, so that only the machine itself can hold it up.


class CpuStallMonitor:
    """One loop a core, from `with` to its end. Owned by one thread.

    Attributes:
        pauses: After the end: every pause as a row (begin, end), monotonic, shape (m, 2), [s].
        lateness: After the end: how late the empty loops woke up, shape (k,), [s].
        stolen: After the end: how long the hypervisor says it has kept the cores from us, all together, [s].
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
            loop.stdout.readline()  # It watches from now on.
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
        """Returns for each time, shape (k,), monotonic, [s], whether a core stood still then or up to `window` before.

        The beginning of a pause is known to one cycle only: it may have begun that much earlier.
        """
        ends = np.sort(self.pauses[:, 1])
        begins = self.pauses[np.argsort(self.pauses[:, 1]), 0] - CYCLE_TIME
        first = np.searchsorted(ends, times - window)
        latest = np.append(np.minimum.accumulate(begins[::-1])[::-1], np.inf)  # Earliest begin of any later pause.
        return latest[first] <= times


def _stolen_time() -> float:
    with open("/proc/stat", encoding="ascii") as file:
        return int(file.readline().split()[8]) / 100.0  # proc(5): in hundredths of a second.


def _watch(core: int) -> dict[str, list[float]]:
    os.sched_setaffinity(0, {core})
    enter_realtime(_PRIORITY)
    deadlines: list[float] = []
    wakes: list[float] = []
    print("watching", flush=True)
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
    print(json.dumps(_watch(int(sys.argv[1]))))
