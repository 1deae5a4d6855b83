"""Whether pages that only watch disturb the 1 kHz loop."""

from __future__ import annotations

import time

from rcilab.diagnostics.bench.browser import open_page, open_window, why_no_page
from rcilab.diagnostics.bench.loop import Streamed, stream, wait_for
from rcilab.diagnostics.bench.measure import Absent, Measurement
from rcilab.workbench.app import Workbench, WorkbenchConfig

_SPECTATORS = 3
_PATIENCE = 120.0  # [s] Four pages drawn on one processor.


def bench_spectators(seconds: float = 30.0) -> Measurement | Absent:
    """Streaming at 1 kHz while one page holds the controls and three watch, after the same with the holder alone.

    The number is the lateness of a cycle with spectators. The promise: they add no late cycle, but for those that fall
    together with a pause of the machine itself, and no lost one.
    """
    if (reason := why_no_page()) is not None:
        return Absent(name="spectators", note=reason)
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench, open_page(bench.url) as page:
        wait_for("the control process", lambda: bench.session.status().phase == "idle")
        wait_for("the page to open", lambda: bool(bench.server.get_clients()))
        settle = min(10.0, seconds)  # [s] The browser compiles shaders and uploads meshes: let it draw.
        time.sleep(settle)
        alone = stream(bench, bench.session.supervisor(), seconds)
        for _ in range(_SPECTATORS):
            open_window(page.context.browser, bench.url)
        wait_for("the spectators", lambda: len(bench.server.get_clients()) == 1 + _SPECTATORS, _PATIENCE)
        time.sleep(settle)
        watched = stream(bench, bench.session.supervisor(), seconds)
    return _compare(alone, watched)


def _compare(alone: Streamed, watched: Streamed) -> Measurement:
    unexplained = [found.late - found.explained for found in (alone, watched)]
    lateness, complete = watched.after.lateness, watched.pages == 1 + _SPECTATORS
    note = (
        f"{watched.duration:.0f} s each, {watched.after.scheduling}, light graphics drawn in software; with "
        f"{_SPECTATORS} spectators: {watched.tell_loop()}; {watched.tell_machine()}. The holder alone: "
        f"{alone.tell_loop()}; {alone.tell_machine()}. Late without a pause of the machine: {unexplained[1]} with "
        f"spectators, {unexplained[0]} without"
    ) + ("" if complete else "; A PAGE WENT AWAY")
    kept = unexplained[1] <= unexplained[0] and watched.lost <= alone.lost and complete
    return Measurement(
        name="spectators", median=lateness.p50, p99=lateness.p99, unit="us", target=1000.0, ok=kept, note=note
    )
