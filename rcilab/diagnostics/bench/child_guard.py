"""Programs started by a benchmark that end together with it, also after Ctrl-C, SIGTERM or SIGKILL.

A guard is a small process in its own session that runs the program and holds one end of a pipe. The system closes the
other end when the benchmark ends for any reason; then the guard ends the program with all its child processes and
removes its directory.
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

_TIMEOUT = 10.0  # [s] Between SIGTERM and SIGKILL.


@contextmanager
def guard(
    command: Sequence[str], *, directory: str = "", output: IO[str] | None = None
) -> Iterator[subprocess.Popen[bytes]]:
    """Starts the guard of a program, which `launch` then starts; both end when the block is left.

    Args:
        command: The program and its arguments.
        directory: Directory of the program, removed after its end.
        output: Destination of its output; None discards it.

    Yields:
        The process of the guard; it ends together with the program, with the same exit code.

    Raises:
        ConnectionLostError: The guard did not start.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "rcilab.diagnostics.bench.child_guard", directory, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL if output is None else output,
        start_new_session=True,  # Signals to the process group of the benchmark, such as Ctrl-C, do not reach it.
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        if not process.stdout.readline():
            raise ConnectionLostError(f"bench: {command[0]} could not be started; check `rcilab doctor`")
        yield process
    finally:
        process.stdout.close()
        with suppress(BrokenPipeError):
            process.stdin.close()
        process.wait(3.0 * _TIMEOUT)


def launch(process: subprocess.Popen[bytes]) -> None:
    """Starts the program of a guard."""
    assert process.stdin is not None
    process.stdin.write(b"\n")
    process.stdin.flush()


def main(arguments: Sequence[str]) -> int:
    """Runs the guard with a directory, or "", and the command; returns the exit code of the program."""
    directory, *command = arguments
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    code = _run(command) if os.read(0, 1) else 0
    if directory:
        shutil.rmtree(directory, ignore_errors=True)
    return code


def _run(command: Sequence[str]) -> int:
    # Its own process group, so that its child processes can be ended with it.
    program = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, start_new_session=True)
    threading.Thread(target=_end_with_bench, args=(program,), daemon=True).start()
    code = program.wait()
    with suppress(ProcessLookupError):
        os.killpg(program.pid, signal.SIGKILL)  # Remaining child processes.
    return code


def _end_with_bench(program: subprocess.Popen[bytes]) -> None:
    os.read(0, 1)  # Returns when the other end is closed.
    for kind in (signal.SIGTERM, signal.SIGKILL):
        with suppress(ProcessLookupError):
            os.killpg(program.pid, kind)
        with suppress(subprocess.TimeoutExpired):
            program.wait(_TIMEOUT)
            return


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
