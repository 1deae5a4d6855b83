"""Too little memory for a thread, a mapping or an array: Python and the kernel have several errors for it."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager

from rcilab.errors import UsageError

STARVED = "there is not enough free memory for this; close other programs or raise ulimit -v"


def is_starved(error: BaseException) -> bool:
    """Returns whether an error says that memory is short, for whatever was asked."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, ImportError):  # glibc's words for a library that cannot be mapped; they are not translated.
        return "failed to map segment" in str(error) or "cannot allocate memory" in str(error).lower()
    if isinstance(error, OSError):
        return error.errno == errno.ENOMEM
    return type(error) is RuntimeError and "start new thread" in str(error)  # CPython has no class for it.


@contextmanager
def memory_needed() -> Iterator[None]:
    """Makes an error of ours out of any that says that memory is short.

    Raises:
        UsageError: Memory is short.
    """
    try:
        yield
    except (MemoryError, ImportError, OSError, RuntimeError) as error:
        if not is_starved(error):
            raise
        raise UsageError(STARVED).coded("starved") from error
