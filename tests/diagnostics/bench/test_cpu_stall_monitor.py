"""The watch on the machine's cores: what it finds, and what it says about a moment."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np
import pytest

from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor


def _with_pauses(*pauses: tuple[float, float]) -> CpuStallMonitor:
    watch = CpuStallMonitor()
    watch.pauses = np.array(pauses).reshape(-1, 2)
    return watch


def test_a_moment_inside_or_shortly_after_a_pause_is_explained() -> None:
    watch = _with_pauses((10.0, 10.004), (20.0, 20.001))
    moments = np.array([9.99, 10.002, 10.011, 10.013, 20.0005, 30.0])
    assert watch.explains(moments, 8e-3).tolist() == [False, True, True, False, True, False]


def test_a_long_pause_that_ends_after_a_short_one_is_not_overlooked() -> None:
    watch = _with_pauses((5.003, 5.0035), (5.0, 5.02))  # On two cores.
    assert watch.explains(np.array([5.015]), 1e-3).tolist() == [True]


def test_without_pauses_nothing_is_explained() -> None:
    assert not _with_pauses().explains(np.array([1.0, 2.0]), 1.0).any()


_HOLD = """
import os, time
os.sched_setaffinity(0, {core})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(99))
end = time.monotonic() + 0.03
while time.monotonic() < end:
    pass
"""


def test_a_core_that_something_else_holds_is_seen() -> None:
    """Real loops on real cores; what holds one has their own priority, so it is not interrupted."""
    core = min(os.sched_getaffinity(0))
    with CpuStallMonitor() as watch:
        time.sleep(0.5)
        begin = time.monotonic()
        held = subprocess.run([sys.executable, "-c", _HOLD.format(core={core})], check=False).returncode
        end = time.monotonic()
    if held != 0:
        pytest.skip("SCHED_FIFO is not permitted here")
    inside = watch.pauses[(watch.pauses[:, 1] > begin) & (watch.pauses[:, 0] < end)]
    assert (inside[:, 1] - inside[:, 0]).max() > 0.01
    assert watch.stolen >= 0.0
