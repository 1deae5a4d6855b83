"""Where the maker's client library looks for a controller on its own machine before it tries any address."""

from __future__ import annotations

from pathlib import Path


def unix_socket_path(port: int) -> Path:
    """Returns the path of the Unix-domain socket of a port: fixed in the client library, whatever TMPDIR is."""
    return Path(f"/tmp/xarmcontroller_uds_{port}")
