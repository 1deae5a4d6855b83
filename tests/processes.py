"""Which processes are ours."""

from __future__ import annotations

import os
from contextlib import suppress

from rcilab.control_process import forked


def processes(of: str = "self") -> set[str]:
    """Returns the ids of our processes, whichever thread started them, without the fork server: it stays for others."""
    found: set[str] = set()
    for task in os.listdir(f"/proc/{of}/task"):
        with (
            suppress(FileNotFoundError),  # A thread has ended meanwhile.
            open(f"/proc/{of}/task/{task}/children", encoding="ascii") as file,
        ):
            found |= set(file.read().split())
    server = forked._server
    if server is not None and str(server.pid) in found:
        found -= {str(server.pid)}
        found |= processes(str(server.pid))
    return found
