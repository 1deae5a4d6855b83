"""Measures a row in a process of its own, for no longer than it may take: what hangs or dies stops no other row."""

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
_PATIENCE = 240.0  # [s] Several times what the slowest row takes on a busy machine; streaming is added to it.


def measure_apart(name: str, seconds: float) -> Measurement | Absent:
    """Returns what a row found, or why it found nothing.

    Args:
        name: One of `rows.ROWS`.
        seconds: How long a row that streams is to do so, [s].
    """
    limit = _PATIENCE + 3.0 * seconds
    with tempfile.TemporaryDirectory(prefix="rcilab-bench-") as place, tempfile.TemporaryFile("w+") as output:
        file = Path(place) / "row.json"
        command = [sys.executable, *_MEASURE, name, str(seconds), str(file)]
        try:
            with guard(command, output=output) as process:
                launch(process)
                code = process.wait(limit)
        except subprocess.TimeoutExpired:
            return Absent(name=name, ok=False, note=f"NO NUMBER: it was ended after {limit:.0f} s without an answer")
        if not file.exists():
            return Absent(name=name, ok=False, note=f"NO NUMBER: {_last_line(output) or f'exit code {code}'}")
        found = json.loads(file.read_text(encoding="utf-8"))
    if found["median"] is None:
        return Absent(name=found["name"], note=found["note"], ok=found["ok"])
    return Measurement(**found)


def _last_line(output: IO[str]) -> str:
    """Returns the last line of what was output: the message of an error, by the custom of Python."""
    output.seek(0)
    return next((line.strip() for line in reversed(output.read().splitlines()) if line.strip()), "")
