"""Measures a row in a separate process with a timeout, so that a hang or crash does not stop the other rows."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import IO

from rcilab.diagnostics.bench.child_guard import guard, launch
from rcilab.diagnostics.bench.measure import Absent, Measurement

_MEASURE = ("-m", "rcilab.diagnostics.bench.rows")
_TIMEOUT = 240.0  # [s] Several times the slowest row on a busy machine, without its streaming.


def measure_isolated(name: str, seconds: float) -> Measurement | Absent:
    """Returns the measurement of a row, or why it failed.

    Args:
        name: One of `rows.ROWS`.
        seconds: Duration of streaming, for a row that streams, [s].
    """
    limit = _TIMEOUT + 3.0 * seconds
    with tempfile.TemporaryDirectory(prefix="rcilab-bench-") as directory, tempfile.TemporaryFile("w+") as output:
        file = Path(directory) / "row.json"
        command = [sys.executable, *_MEASURE, name, str(seconds), str(file)]
        try:
            with guard(command, output=output) as process:
                launch(process)
                code = process.wait(limit)
        except subprocess.TimeoutExpired:
            return Absent(name=name, ok=False, note=f"NO NUMBER: it was ended after {limit:.0f} s without a result")
        if not file.exists():
            return Absent(name=name, ok=False, note=f"NO NUMBER: {_last_line(output) or f'exit code {code}'}")
        found = json.loads(file.read_text(encoding="utf-8"))
    if found["median"] is None:
        return Absent(name=found["name"], note=found["note"], ok=found["ok"])
    return Measurement(**found)


def _last_line(output: IO[str]) -> str:
    """Returns the last line of the output, which in a traceback is the message of the error."""
    output.seek(0)
    return next((line.strip() for line in reversed(output.read().splitlines()) if line.strip()), "")
