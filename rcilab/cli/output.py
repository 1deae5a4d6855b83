"""Output of commands, robust to closed pipes (as in `rcilab check FILE | head`) and closed streams."""

from __future__ import annotations

import errno
import io
import os
import select
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import TextIO

from rcilab.cli.signal_handlers import handled_signals
from rcilab.core.errors import plain_text

_UNWRITABLE = {errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG, errno.EBADF}


def prepare_streams() -> None:
    """Makes the standard streams accept any text, and replaces closed ones (`>&-`).

    Characters that a stream cannot encode are escaped. The file descriptor of a closed stream is occupied: a file with
    this descriptor would receive messages for the user. A closed stdout is treated like a closed pipe.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        stream = getattr(sys, name)
        if stream is None:
            null = os.open(os.devnull, os.O_RDWR)  # Takes the lowest free descriptor, which is that of this stream.
            setattr(sys, name, _ClosedStream() if number == 1 else os.fdopen(null, "w" if number else "r"))
        elif number and hasattr(stream, "reconfigure"):
            with suppress(OSError):  # A stream that can also be read, such as a socket, cannot be reconfigured.
                stream.reconfigure(errors="backslashreplace")


def show(content: object) -> None:
    """Prints on stdout; after the pipe is closed, output is dropped and the exit status is not affected."""
    try:
        print(content, flush=True)
    except BrokenPipeError:
        drop_output()


def drop_output() -> None:
    """Redirects stdout to the null device; otherwise Python reports the closed pipe when it ends."""
    if isinstance(sys.stdout, _ClosedStream):
        sys.stdout = open(os.devnull, "w")  # Open until the process ends.
        return
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, sys.stdout.fileno())
    os.close(null)


def drop_unread_output() -> None:
    """Drops pending output if its reader does not read; otherwise the end of the process would wait for the reader."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # Closed, or not a file.
            if not select.select([], [stream.fileno()], [], 0.0)[1]:
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, stream.fileno())
                os.close(nowhere)


def print_interruptibly(line: str, stream: TextIO | None = None, *, unless: Callable[[], bool] | None = None) -> None:
    """Prints a line where handlers of signals only request the end; alone they would not end a write that is not read.

    After such a request the rest of the line is dropped if it is not read.

    Args:
        line: The line.
        stream: Stream; None: stdout.
        unless: Returns whether the end was requested already: then nothing is printed.
    """

    def on_signal(number: int, frame: FrameType | None) -> None:
        handlers[number](number, frame)
        raise _InterruptedWriteError

    target = stream or sys.stdout
    found = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    handlers = {int(number): handler for number, handler in found.items() if callable(handler)}
    try:
        with handled_signals(dict.fromkeys(handlers, on_signal)):
            if unless is not None and unless():
                return
            target.write(f"{line}\n")
            target.flush()
    except _InterruptedWriteError:
        drop_unread_output()


class _InterruptedWriteError(Exception):
    """A signal came during a write."""


def is_unwritable(error: OSError) -> bool:
    """Returns whether writing to an open stream failed, for example because the disk is full."""
    return error.filename is None and error.errno in _UNWRITABLE


def one_line_each(text: str) -> str:
    """Returns text for a terminal, with control characters escaped in every line."""
    return "\n".join(map(plain_text, text.splitlines()))


class _ClosedStream(io.TextIOBase):
    """Replaces a closed stdout."""

    def write(self, text: str) -> int:
        raise BrokenPipeError(errno.EPIPE, "the output is closed")
