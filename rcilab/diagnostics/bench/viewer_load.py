"""Effect of spectator pages on the 1 kHz loop."""

from __future__ import annotations

import time

from rcilab.diagnostics.bench.browser import open_page, open_window, why_no_page
from rcilab.diagnostics.bench.loop import Streamed, stream, wait_for
from rcilab.diagnostics.bench.measure import Absent, Measurement
from rcilab.workbench.app import Workbench, WorkbenchConfig

_SPECTATORS = 3
_TIMEOUT = 120.0  # [s] Four pages are rendered on one processor.


def bench_spectators(seconds: float = 30.0) -> Measurement | Absent:
    """Streaming at 1 kHz with one operator page and three spectators, after the same with the operator page alone.

    The number is the lateness of a cycle with spectators. The target: spectators add no lost cycle, and no late one
    except those that coincide with a stall of the machine.
    """
    if (reason := why_no_page()) is not None:
        return Absent(name="spectators", note=reason)
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench, open_page(bench.url) as page:
        wait_for("the control process", lambda: bench.session.status().phase == "idle")
        wait_for("the page to open", lambda: bool(bench.server.get_clients()))
        settle = min(10.0, seconds)  # [s] The browser compiles shaders and uploads meshes first.
        time.sleep(settle)
        alone = stream(bench, bench.session.robot(), seconds)
        for _ in range(_SPECTATORS):
            open_window(page.context.browser, bench.url)
        wait_for("the spectators", lambda: len(bench.server.get_clients()) == 1 + _SPECTATORS, _TIMEOUT)
        time.sleep(settle)
        shared = stream(bench, bench.session.robot(), seconds)
    return _compare(alone, shared)


def _compare(alone: Streamed, shared: Streamed) -> Measurement:
    unexplained = [found.late - found.explained for found in (alone, shared)]
    lateness, complete = shared.after.lateness, shared.pages == 1 + _SPECTATORS
    note = (
        f"{shared.duration:.0f} s each, {shared.after.scheduling}, light graphics drawn in software; with "
        f"{_SPECTATORS} spectators: {shared.describe_timing()}; {shared.describe_stalls()}. The operator page alone: "
        f"{alone.describe_timing()}; {alone.describe_stalls()}. Late without a stall of the machine: {unexplained[1]} "
        f"with spectators, {unexplained[0]} without"
    ) + ("" if complete else "; A PAGE WAS CLOSED")
    is_met = unexplained[1] <= unexplained[0] and shared.lost <= alone.lost and complete
    return Measurement(
        name="spectators", median=lateness.p50, p99=lateness.p99, unit="us", target=1000.0, ok=is_met, note=note
    )
