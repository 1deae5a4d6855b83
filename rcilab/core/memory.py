"""Detection of low memory for a thread, a mapping or an array, which Python reports by several errors."""

from __future__ import annotations

import errno
from collections.abc import Generator
from contextlib import contextmanager

from rcilab.core.errors import UsageError

OUT_OF_MEMORY = "there is not enough free memory for this; close other programs or raise ulimit -v"


def is_out_of_memory(error: BaseException) -> bool:
    """Returns whether an error means that not enough memory is free."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, ImportError):  # glibc's text for a library that cannot be mapped; it is not translated.
        return "failed to map segment" in str(error) or "cannot allocate memory" in str(error).lower()
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM
    return type(error) is RuntimeError and "start new thread" in str(error)  # CPython has no exception class for it.


@contextmanager
def memory_needed() -> Generator[None]:
    """Raises a `UsageError` for an error that means that not enough memory is free.

    Raises:
        UsageError: There is not enough free memory.
    """
    try:
        yield
    except (MemoryError, ImportError, OSError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        raise UsageError(OUT_OF_MEMORY).coded("starved") from error
