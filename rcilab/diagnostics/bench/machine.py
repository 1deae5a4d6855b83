"""Description of the measured machine."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from rcilab.diagnostics.host import probe_realtime

PACKAGES = ("rcilab", "numpy", "pin", "ruckig", "mujoco", "viser")


def describe_machine() -> dict[str, Any]:
    """Returns CPU, cores, load, versions, and whether a loop gets SCHED_FIFO and locked memory."""
    fifo, locked = probe_realtime()
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


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.machine()
