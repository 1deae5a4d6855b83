"""Start-up times: the import, and `rcilab` until its page is served."""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from typing import IO

import numpy as np

from rcilab.core.errors import ConnectionLostError, DeadlineError
from rcilab.diagnostics.bench.child_guard import guard, launch
from rcilab.diagnostics.bench.measure import Measurement, summarise

_RUNS = 5
_IMPORTS = 11
_TIMEOUT = 60.0  # [s]
_POLL = 0.01  # [s]


def bench_import() -> Measurement:
    """`import rcilab` in a fresh interpreter, without the start of the interpreter."""
    codes = ("pass", "import rcilab", "import rcilab; rcilab.load_model('xMatePro7')")
    rounds = np.array(
        [[_time_python(code) for code in codes] for _ in range(_IMPORTS)]
    )  # Alternating, because the machine's speed varies.
    start, _, loaded = np.median(rounds, axis=0)
    note = f"fresh interpreter, without its own {1e3 * start:.0f} ms; with load_model {1e3 * (loaded - start):.0f} ms"
    return summarise("import", np.maximum(rounds[:, 1] - start, 0.0), "ms", 150.0, note)


def bench_start() -> Measurement:
    """`rcilab` from the command until its page is served, with all processes started."""
    times, sizes = zip(*(_time_page() for _ in range(_RUNS)), strict=True)
    note = f"`rcilab --no-browser`, {_RUNS} fresh processes, until GET / returns 200; page of {sizes[0] / 1e3:.0f} kB"
    return summarise("start", times, "s", 3.0, note)


def free_port() -> int:
    """Returns a free TCP port on 127.0.0.1."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _time_python(code: str) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True)
    return time.perf_counter() - start


def _time_page() -> tuple[float, int]:
    """Returns the time until the page is served, [s], and its size, [bytes]."""
    port = free_port()
    with tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        command = [sys.executable, "-m", "rcilab.cli", "--no-browser", "--port", str(port)]
        with guard(command, output=output) as process:
            start = time.perf_counter()
            launch(process)
            page = _wait_for_page(f"http://127.0.0.1:{port}/", process, output)
            return time.perf_counter() - start, len(page)


def _wait_for_page(url: str, process: subprocess.Popen[bytes], output: IO[str]) -> bytes:
    deadline = time.monotonic() + _TIMEOUT
    while time.monotonic() < deadline:
        try:
            with urllib.request.urlopen(url, timeout=_TIMEOUT) as answer:
                return answer.read()
        except urllib.error.URLError:
            time.sleep(_POLL)
        if process.poll() is not None:
            output.seek(0)
            raise ConnectionLostError(f"rcilab ended with exit code {process.returncode}: {output.read().strip()}")
    raise DeadlineError(f"rcilab served no page at {url} within {_TIMEOUT:g} s")
