"""The machine that was measured: without it a number means nothing."""

from __future__ import annotations

import os
import platform
import threading
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGES = ("rcilab", "numpy", "pin", "ruckig", "mujoco", "viser")

_PRIORITY = 50


def describe_machine() -> dict[str, Any]:
    """Returns cpu, cores, memory, versions and whether a loop of ours may run under SCHED_FIFO."""
    return {
        "name": "machine",
        "cpu": _cpu_name(),
        "cores": len(os.sched_getaffinity(0)),
        "load": round(os.getloadavg()[0], 2),
        "kernel": f"{platform.system()} {platform.release()}",
        "sched_fifo": may_run_fifo(),
        "python": platform.python_version(),
        "versions": {name: metadata.version(name) for name in PACKAGES},
    }


def may_run_fifo() -> bool:
    """Returns whether this process may schedule a thread first-in first-out, tried in a thread that then ends."""
    answers: list[bool] = []

    def ask() -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
            answers.append(True)
        except OSError:
            answers.append(False)

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    return answers[0]


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.machine()
