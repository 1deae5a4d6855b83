"""Programs that a bench starts and that end with it, whatever ends it: its own end, Ctrl-C, SIGTERM or SIGKILL.

A guard stands between: a small process in a session of its own that runs the program and holds one end of a pipe. The
system closes the other end when the bench ends, however that happens; then the guard ends the program with all its
helpers and removes its directory.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import IO

from rcilab.core.errors import ConnectionLostError

_PATIENCE = 10.0  # [s] Between asking a program to end and ending it.


@contextmanager
def guard(
    command: Sequence[str], *, directory: str = "", output: IO[str] | None = None
) -> Iterator[subprocess.Popen[bytes]]:
    """Holds a program ready to run until the block is left: `launch` starts it.

    Args:
        command: The program and its arguments.
        directory: What it may fill, and is removed after it.
        output: Where its output goes; nowhere when absent.

    Yields:
        The guard's process; it ends when the program does, with its exit code.

    Raises:
        ConnectionLostError: The guard did not start.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "rcilab.diagnostics.bench.child_guard", directory, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL if output is None else output,
        start_new_session=True,  # What is sent to our group, such as Ctrl-C, is not for it.
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        if not process.stdout.readline():
            raise ConnectionLostError(f"bench: {command[0]} could not be started; look at `rcilab doctor`")
        yield process
    finally:
        process.stdout.close()
        with suppress(BrokenPipeError):
            process.stdin.close()
        process.wait(3.0 * _PATIENCE)


def launch(process: subprocess.Popen[bytes]) -> None:
    """Starts the program of a guard."""
    assert process.stdin is not None
    process.stdin.write(b"\n")
    process.stdin.flush()


def main(arguments: Sequence[str]) -> int:
    """Runs the guard: a directory, or nothing, and the command; returns the program's exit code."""
    directory, *command = arguments
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    code = _run(command) if os.read(0, 1) else 0
    if directory:
        shutil.rmtree(directory, ignore_errors=True)
    return code


def _run(command: Sequence[str]) -> int:
    # A group of its own: its helpers end with it, and nothing else does.
    program = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, start_new_session=True)
    threading.Thread(target=_end_with_bench, args=(program,), daemon=True).start()
    code = program.wait()
    with suppress(ProcessLookupError):
        os.killpg(program.pid, signal.SIGKILL)  # Helpers that it left behind.
    return code


def _end_with_bench(program: subprocess.Popen[bytes]) -> None:
    os.read(0, 1)  # Returns when the other end is closed.
    for kind in (signal.SIGTERM, signal.SIGKILL):
        with suppress(ProcessLookupError):
            os.killpg(program.pid, kind)
        with suppress(subprocess.TimeoutExpired):
            program.wait(_PATIENCE)
            return


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
