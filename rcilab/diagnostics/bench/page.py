"""Latency of a drag of the target on the page, and the 1 kHz loop with an open page."""

from __future__ import annotations

import math
import time
from contextlib import nullcontext

import numpy as np

from rcilab.app.goal.goal_actions import MoveTarget
from rcilab.diagnostics.bench.browser import open_page, why_no_page
from rcilab.diagnostics.bench.loop import Streamed, stream, wait_for
from rcilab.diagnostics.bench.measure import Measurement, summarise
from rcilab.diagnostics.host import find_chromium
from rcilab.workbench.app import Workbench, WorkbenchConfig

_DRAGS = 200
_POLL_INTERVAL = 5e-5  # [s] Part of the measured time.
_RADIUS = 0.05  # [m] Of the circle on which the target is dragged.


def bench_drag() -> Measurement:
    """From a drag of the target to the new arm pose, through the page's queue and dispatcher thread."""
    poses: list[float] = []
    plans: list[float] = []
    with Workbench(WorkbenchConfig(port=0)) as bench:
        wait_for("the control process", lambda: bench.session.status().phase == "idle")
        wait_for("the goal at the arm's position", lambda: bench.store.state.no_plan is not None)
        centre = bench.store.state.goal.target
        for step in range(_DRAGS):
            angle = math.tau * step / 50
            offset = (0.0, _RADIUS * math.cos(angle), _RADIUS * math.sin(angle))
            before = bench.store.state
            request = MoveTarget(position=tuple((centre.position + offset).tolist()), wxyz=tuple(centre.wxyz.tolist()))
            start = time.perf_counter()
            bench.dispatcher.ask(request)
            wait_for(
                "the new pose", lambda before=before: bench.store.state.goal is not before.goal, interval=_POLL_INTERVAL
            )
            poses.append(time.perf_counter() - start)
            wait_for(
                "the new plan", lambda before=before: bench.store.state.plan is not before.plan, interval=_POLL_INTERVAL
            )
            plans.append(time.perf_counter() - start)
    planned = f"{1e3 * np.median(plans):.1f} ms, p99 {1e3 * np.percentile(plans, 99):.1f} ms"
    return summarise("drag", poses, "ms", 10.0, f"{_DRAGS} drags on a circle; until planned and checked too: {planned}")


def bench_control_loop(seconds: float = 30.0) -> Measurement:
    """Streaming at 1 kHz with the page open in a real browser.

    The number is the lateness of a cycle. The target: no cycle later than 1 ms, none lost, success rate 1.
    """
    reason = why_no_page()
    with Workbench(WorkbenchConfig(port=0)) as bench:
        wait_for("the control process", lambda: bench.session.status().phase == "idle")
        with open_page(bench.url) if reason is None else nullcontext():
            if reason is None:
                wait_for("the page to open", lambda: bool(bench.server.get_clients()))
                time.sleep(min(10.0, seconds))  # The browser compiles shaders and uploads meshes first.
            return _evaluate(stream(bench, bench.session.robot(), seconds), reason)


def _evaluate(found: Streamed, reason: str | None) -> Measurement:
    lateness, after = found.after.lateness, found.after
    locked = ", memory locked" if after.memory_locked else ""
    if reason is not None:
        page = f"no page was open, so there is no target; {reason}"
    else:
        page = f"page open in {find_chromium()}" + ("" if found.pages else "; THE PAGE WAS CLOSED")
    note = (
        f"{found.duration:.1f} s, {lateness.cycles} cycles, {after.scheduling}{locked}; {found.describe_timing()}; "
        f"{page}; {found.describe_stalls()}"
    )
    return Measurement(
        name="control_loop", median=lateness.p50, p99=lateness.p99, unit="us", target=1000.0,
        ok=None if reason is not None else found.is_clean and found.pages > 0, note=note,
    )  # fmt: skip
