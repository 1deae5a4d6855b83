"""Which processes are ours."""

from __future__ import annotations

import os
from contextlib import suppress
from multiprocessing import resource_tracker

from rcilab.control_process import fork_server


def processes(of: str = "self") -> set[str]:
    """Returns the ids of our processes, whichever thread started them.

    Without the fork server and multiprocessing's resource tracker: both stay until this process ends.
    """
    found: set[str] = set()
    for task in os.listdir(f"/proc/{of}/task"):
        with (
            suppress(FileNotFoundError),  # The thread has ended since.
            open(f"/proc/{of}/task/{task}/children", encoding="ascii") as file,
        ):
            found |= set(file.read().split())
    server = str(fork_server._server._forkserver_pid)
    if server in found:
        found |= processes(server)
    return found - {server, str(resource_tracker._resource_tracker._pid)}
