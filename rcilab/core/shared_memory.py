"""Unnamed files in memory that processes share by an open descriptor: the system frees them with the last of them."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from rcilab.core.errors import UsageError

_MEMORY = Path("/dev/shm")  # Linux: files here are in memory. Elsewhere, or if it is full: the temp directory.
PAGE = 4096
"""[bytes] Alignment of regions in such a file."""


def open_shared_memory(size: int, user: str) -> int:
    """Returns the descriptor of a new unnamed file whose bytes are all allocated, so that no later write fails.

    Args:
        size: Size, [bytes].
        user: What needs it, for the error, such as "the control process".

    Raises:
        UsageError: Neither directory has enough space.
    """
    for directory in (_MEMORY, Path(tempfile.gettempdir())):
        if not directory.is_dir():
            continue
        try:
            with tempfile.TemporaryFile(dir=directory) as file:
                os.posix_fallocate(file.fileno(), 0, size)
                return os.dup(file.fileno())
        except OSError:  # Full or not writable: containers often limit /dev/shm to 64 MB.
            continue
    raise UsageError(
        f"{user} needs {size / 1e6:.0f} MB of shared memory, and neither {_MEMORY} nor {tempfile.gettempdir()} has "
        "enough space; free some"
    ).coded("no_memory", size=f"{size / 1e6:.0f}")


def whole_pages(size: int) -> int:
    """Returns a size rounded up to whole pages, [bytes]."""
    return -(-size // PAGE) * PAGE
