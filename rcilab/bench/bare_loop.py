"""A 1 kHz loop that does nothing: how late this machine is by itself. `python -m rcilab.bench.bare_loop SECONDS`.

Whatever of the control loop's lateness this one shows too is the machine's: pauses of a virtual machine, other
real-time processes, the kernel. Prints the lateness of every cycle, [s], as one JSON list.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time

from rcilab.clock import CYCLE_TIME
from rcilab.realtime import enter_realtime

_PRIORITY = 60  # As the control process.


def measure_bare_loop(seconds: float) -> list[float]:
    """Returns the lateness of each cycle, [s], of an empty 1 kHz loop in a process of its own."""
    command = [sys.executable, "-m", "rcilab.bench.bare_loop", str(seconds)]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def stolen_time() -> float:
    """Returns how long the hypervisor has kept this machine's cores from running so far, all together, [s]."""
    with open("/proc/stat", encoding="ascii") as file:
        return int(file.readline().split()[8]) / 100.0  # proc(5): in hundredths of a second.


def _run(seconds: float) -> list[float]:
    enter_realtime(_PRIORITY)
    late = [0.0] * round(seconds / CYCLE_TIME)
    deadline = time.monotonic()
    for cycle in range(len(late)):
        deadline += CYCLE_TIME
        remaining = deadline - time.monotonic()
        if remaining > 0.0:
            time.sleep(remaining)
        late[cycle] = time.monotonic() - deadline
    return late


if __name__ == "__main__":
    print(json.dumps(_run(float(sys.argv[1]))))
