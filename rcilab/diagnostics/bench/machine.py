"""The machine that was measured: without it a number means nothing."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGES = ("rcilab", "numpy", "pin", "ruckig", "mujoco", "viser")

_PRIORITY = 80  # The highest that any of our processes asks for: the controller.


def describe_machine() -> dict[str, Any]:
    """Returns cpu, cores, load, versions, and whether SCHED_FIFO and locked memory are in force for our loops."""
    fifo, locked = ask_realtime()
    return {
        "name": "machine",
        "cpu": _cpu_name(),
        "cores": len(os.sched_getaffinity(0)),
        "load": round(os.getloadavg()[0], 2),
        "kernel": f"{platform.system()} {platform.release()}",
        "sched_fifo": fifo,
        "memory_locked": locked,
        "python": platform.python_version(),
        "versions": {name: metadata.version(name) for name in PACKAGES},
    }


def ask_realtime() -> tuple[bool, bool]:
    """Returns whether a control process gets SCHED_FIFO and locked memory, tried in a process that then ends."""
    code = (
        "from rcilab.realtime.scheduling import enter_realtime\n"
        f"s = enter_realtime({_PRIORITY}); print(s.policy, s.memory_locked)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    policy, locked = answer.stdout.split()
    return policy == "SCHED_FIFO", locked == "True"


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.machine()
