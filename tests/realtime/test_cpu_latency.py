from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from rcilab.realtime.cpu_latency import DEVICE, CpuLatencyLock, awake_cores

_AS_NOBODY = """
import os
from rcilab.realtime.cpu_latency import awake_cores
if os.geteuid() == 0:
    os.setuid(65534)
with awake_cores() as is_permitted:
    print(is_permitted)
"""


def holds() -> bool:
    """Whether this process has the device open."""
    return any(os.readlink(link) == DEVICE for link in Path("/proc/self/fd").iterdir() if link.is_symlink())


def test_the_hold_is_there_while_it_is_wanted_and_not_before_or_after() -> None:
    assert not holds()
    with awake_cores() as is_permitted:
        assert holds() == is_permitted
    assert not holds()


def test_a_hold_is_taken_once_and_let_go_once() -> None:
    cores = CpuLatencyLock()
    for on in (True, True, False, False, True, False):
        cores.switch(on)
        assert holds() == (on and bool(cores.is_permitted))
    assert cores.is_permitted is not None


def test_without_permission_nothing_happens() -> None:
    done = subprocess.run([sys.executable, "-c", _AS_NOBODY], check=True, stdout=subprocess.PIPE, text=True)
    assert done.stdout == "False\n"
