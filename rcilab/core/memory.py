"""Detection of low memory for a thread, a mapping or an array, which Python reports by several errors."""

from __future__ import annotations

import errno
from collections.abc import Generator
from contextlib import contextmanager

from rcilab.core.errors import UsageError

OUT_OF_MEMORY = "there is not enough free memory for this; close other programs or raise ulimit -v"


def is_starved(error: BaseException) -> bool:
    """Returns whether an error means that memory is short."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, ImportError):  # glibc's text for a library that cannot be mapped; it is not translated.
        return "failed to map segment" in str(error) or "cannot allocate memory" in str(error).lower()
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM
    return type(error) is RuntimeError and "start new thread" in str(error)  # CPython has no class for it.


@contextmanager
def memory_needed() -> Generator[None]:
    """Turns an error that means low memory into a `UsageError`.

    Raises:
        UsageError: Memory is short.
    """
    try:
        yield
    except (MemoryError, ImportError, OSError, RuntimeError) as error:
        if not is_starved(error):
            raise
        raise UsageError(OUT_OF_MEMORY).coded("starved") from error
