"""Real-time conditions for as long as a loop runs inside somebody else's process."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from rcilab.realtime.cpu_latency import awake_cores
from rcilab.realtime.scheduling import enter_realtime, leave_realtime

PRIORITY = 60  # SCHED_FIFO, of 1 to 99: below the kernel's own threads' usual 90s, above ordinary drivers' 50.

_log = logging.getLogger("rcilab.execution")
_warned = False


@contextmanager
def punctual(wanted: bool = True) -> Iterator[None]:
    """Runs the body under SCHED_FIFO with a still garbage collector on cores that do not sleep, as far as permitted.

    Where it does not, one line says so, once a process.

    Args:
        wanted: False changes nothing: a loop in lock-step has no deadlines.
    """
    global _warned
    if not wanted:
        yield
        return
    scheduling = enter_realtime(PRIORITY)
    if scheduling.warning and not _warned:
        _warned = True
        _log.warning("%s", scheduling.warning)
    try:
        with awake_cores():
            yield
    finally:
        leave_realtime()
