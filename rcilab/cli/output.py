"""What commands print where the reader may have gone, as in `rcilab check FILE --model NAME | head -1`."""

from __future__ import annotations

import os
import sys


def show(content: object) -> None:
    """Prints on stdout; once the reader has gone the rest is dropped, and the exit code still says what was found."""
    try:
        print(content, flush=True)
    except BrokenPipeError:
        drop_output()


def drop_output() -> None:
    """Sends what is still to be written on stdout nowhere; otherwise Python complains about the pipe as it ends."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
