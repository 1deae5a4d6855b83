"""What is said about spectators: late cycles that the machine itself explains are not theirs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.control_process import SupervisorStatus
from rcilab.core.cycle_log import cycle_dtype
from rcilab.diagnostics.bench.cpu_stall_monitor import CpuStallMonitor
from rcilab.diagnostics.bench.loop import Streamed
from rcilab.diagnostics.bench.viewer_load import _compare


def streamed(late: int, explained: int, pages: int = 4) -> Streamed:
    """Streamed cycles of which the last few were late, the first of those while a core stood still."""
    rows = np.zeros(1000, cycle_dtype(7))
    rows["received_ns"] = rows["sent_ns"] = 1_000_000_000 * np.arange(1000)
    rows["lateness"][1000 - late :] = 2e-3
    watch = CpuStallMonitor()
    ends = 1000.0 - late + np.arange(explained)
    watch.pauses = np.stack([ends - 1e-3, ends], axis=1)
    return Streamed(
        duration=1.0, before=SupervisorStatus(), after=replace(SupervisorStatus(), late_cycles=late), success=1.0,
        pages=pages, rows=rows, stalls=watch,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("alone", "watched", "kept"),
    [
        (streamed(0, 0, 1), streamed(0, 0), True),
        (streamed(0, 0, 1), streamed(3, 3), True),
        (streamed(0, 0, 1), streamed(3, 2), False),
        (streamed(2, 1, 1), streamed(3, 2), True),
        (streamed(0, 0, 1), streamed(0, 0, pages=3), False),
    ],
)
def test_late_cycles_are_compared_without_those_of_the_machine(alone, watched, kept):
    found = _compare(alone, watched)
    assert found.ok is kept
    assert "3 spectators" in found.note
    assert "The operator page alone" in found.note
