"""Unnamed files in memory that processes share by an open descriptor: the system frees them with the last of them."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
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
        OSError: The process has too many open files.
        UsageError: Neither directory has enough space.
    """
    for directory in _directories():
        if not directory.is_dir():
            continue
        try:
            with tempfile.TemporaryFile(dir=directory) as file:
                os.posix_fallocate(file.fileno(), 0, size)
                return os.dup(file.fileno())
        except OSError as error:  # Full or not writable: containers often limit /dev/shm to 64 MB.
            if error.errno in (errno.EMFILE, errno.ENFILE):
                raise
    raise UsageError(
        f"{user} needs {size / 1e6:.0f} MB of shared memory, and neither {_MEMORY} nor {tempfile.gettempdir()} has "
        "enough space; free some"
    ).coded("no_memory", size=f"{size / 1e6:.0f}")


def _directories() -> Iterator[Path]:
    yield _MEMORY
    yield Path(tempfile.gettempdir())


def whole_pages(size: int) -> int:
    """Returns a size rounded up to whole pages, [bytes]."""
    return -(-size // PAGE) * PAGE
