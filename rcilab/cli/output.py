"""What commands print, where the reader may have gone (as in `rcilab check FILE | head`) or takes nothing."""

from __future__ import annotations

import errno
import io
import os
import sys
from contextlib import suppress

from rcilab.core.errors import plain_text

_UNWRITABLE = {errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG, errno.EBADF}


def prepare_streams() -> None:
    """Makes the standard streams fit for any text, and stands in for those that were closed (`>&-`).

    What the encoding of a stream does not have is printed with its escapes. The number of a closed stream goes to
    nothing else: a file that got it would take what is meant for a person. A closed stdout counts as a reader that
    has gone.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        stream = getattr(sys, name)
        if stream is None:
            nowhere = os.open(os.devnull, os.O_RDWR)  # The lowest free number: this one.
            setattr(sys, name, _Gone() if number == 1 else os.fdopen(nowhere, "w" if number else "r"))
        elif number and hasattr(stream, "reconfigure"):
            with suppress(OSError):  # A stream that is read as well, such as a socket, cannot be changed any more.
                stream.reconfigure(errors="backslashreplace")


def show(content: object) -> None:
    """Prints on stdout; once the reader has gone the rest is dropped, and the exit code still says what was found."""
    try:
        print(content, flush=True)
    except BrokenPipeError:
        drop_output()


def drop_output() -> None:
    """Sends what is still to be written on stdout nowhere; otherwise Python complains about the pipe as it ends."""
    if isinstance(sys.stdout, _Gone):
        sys.stdout = open(os.devnull, "w")  # For as long as this process lives.
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


def is_unwritable(error: OSError) -> bool:
    """Returns whether this is about writing to a stream that is open already, as to a full disk."""
    return error.filename is None and error.errno in _UNWRITABLE


def one_line_each(text: str) -> str:
    """Returns text for a terminal: what would act on it is shown with its escapes, line by line."""
    return "\n".join(map(plain_text, text.splitlines()))


class _Gone(io.TextIOBase):
    """Stands for a stdout that is closed."""

    def write(self, text: str) -> int:
        raise BrokenPipeError(errno.EPIPE, "the output is closed")
