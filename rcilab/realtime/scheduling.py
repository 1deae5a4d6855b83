"""Real-time conditions from the operating system: SCHED_FIFO, locked memory, no garbage collection, awake cores.

All of them are optional. If the system refuses one, the process runs without it, and `Scheduling.warning` says in one
line what is missing and how to grant it.
"""

from __future__ import annotations

import ctypes
import gc
import logging
import os
import resource
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from rcilab.realtime.cpu_latency import awake_cores

PRIORITY = 60  # SCHED_FIFO, of 1 to 99: below the kernel's own threads' usual 90s, above ordinary drivers' 50.

_SLOWER_PRIORITY = 56  # Of a loop with a longer period than one cycle.

_LOCK_CURRENT, _LOCK_FUTURE, _LOCK_ON_FAULT = 1, 2, 4  # Linux, mlockall(2).
_CAP_IPC_LOCK = 14  # Linux, capabilities(7).

_log = logging.getLogger("rcilab.execution")
_warned = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Scheduling:
    """What the operating system granted."""

    policy: str
    """"SCHED_FIFO", or "normal"."""
    priority: int
    """Priority under SCHED_FIFO, 1 to 99; 0 when normal."""
    memory_locked: bool
    """Whether the memory of this process cannot be swapped out."""
    warning: str | None
    """One line: what was refused and how to grant it; None if everything was granted."""


def loop_priority(cycles: int) -> int:
    """Returns the priority of a control loop: the shorter its period, the higher (rate-monotonic scheduling).

    Args:
        cycles: Its period in cycles of 1 ms, at least 1.
    """
    return PRIORITY if cycles == 1 else _SLOWER_PRIORITY


def enter_realtime(priority: int) -> Scheduling:
    """Requests SCHED_FIFO, locked memory and a disabled garbage collector for this process; returns what was granted.

    Reference counting continues, so a loop that creates no reference cycles does not grow. Child processes start with
    ordinary scheduling.

    Args:
        priority: Priority under SCHED_FIFO, 1 to 99.
    """
    gc.disable()
    is_first = _enter_fifo(priority)
    is_locked = _lock_memory()
    return Scheduling(
        policy="SCHED_FIFO" if is_first else "normal",
        priority=priority if is_first else 0,
        memory_locked=is_locked,
        warning=_warning(is_first, is_locked),
    )


def leave_realtime() -> None:
    """Returns the process to ordinary scheduling, swappable memory and automatic garbage collection."""
    if os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    ctypes.CDLL(None).munlockall()
    gc.enable()


def set_thread_scheduling(thread: threading.Thread, *, like_caller: bool) -> None:
    """Gives another thread of this process the scheduling of the calling one, or an ordinary one, as far as allowed.

    Args:
        thread: A running thread; one that has ended is left alone.
        like_caller: Which of the two.
    """
    if not thread.is_alive() or thread.native_id is None:
        return
    ordinary = os.SCHED_OTHER, os.sched_param(0)
    policy, parameters = (os.sched_getscheduler(0), os.sched_getparam(0)) if like_caller else ordinary
    with suppress(OSError):
        os.sched_setscheduler(thread.native_id, policy, parameters)


@contextmanager
def realtime_section(enabled: bool = True, priority: int = PRIORITY) -> Iterator[None]:
    """Runs the body with all real-time conditions that the system grants; a missing one is logged once per process.

    Args:
        enabled: False has no effect: a loop in lock-step has no deadlines.
        priority: Priority under SCHED_FIFO, 1 to 99.
    """
    global _warned
    if not enabled:
        yield
        return
    scheduling = enter_realtime(priority)
    if scheduling.warning and not _warned:
        _warned = True
        _log.warning("%s", scheduling.warning)
    try:
        with awake_cores():
            yield
    finally:
        leave_realtime()


def _enter_fifo(priority: int) -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError:  # No permission, or a kernel or container that knows no SCHED_FIFO.
        return False
    return True


def _lock_memory() -> bool:
    # Under a finite limit a lock on future pages would make later allocations fail, so it is not even tried then.
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] != resource.RLIM_INFINITY and not _may_lock_all():
        return False
    flags = _LOCK_CURRENT | _LOCK_FUTURE | _LOCK_ON_FAULT
    return ctypes.CDLL(None, use_errno=True).mlockall(flags) == 0


def _may_lock_all() -> bool:
    for line in Path("/proc/self/status").read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("CapEff:"):
            return bool(int(line.split()[1], 16) >> _CAP_IPC_LOCK & 1)
    return False


def _warning(is_first: bool, is_locked: bool) -> str | None:
    if is_first and is_locked:
        return None
    refused = [name for name, granted in (("SCHED_FIFO", is_first), ("locked memory", is_locked)) if not granted]
    return (
        f"{' and '.join(refused)} not granted: cycles may be late under load; run as root, or raise this user's "
        "rtprio and memlock limits in /etc/security/limits.conf"
    )
