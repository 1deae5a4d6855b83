"""What the workbench makes a person or a robot wait for: a drag of the target, and the 1 kHz loop beside the page."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rcilab.bench.browser import find_chromium, open_page
from rcilab.bench.compute import motion_of
from rcilab.bench.core_watch import CoreWatch
from rcilab.bench.measure import Measurement, summarise
from rcilab.conformance.check import check
from rcilab.errors import DeadlineError
from rcilab.supervisor import Supervisor, SupervisorStatus
from rcilab.supervisor.lateness import LATE_AFTER
from rcilab.workbench import requests
from rcilab.workbench.app import Workbench, WorkbenchConfig

_DRAGS = 200
_RADIUS = 0.05  # [m] of the circle on which the target is dragged
_PATIENCE = 60.0  # [s]
_MEMORY = 8e-3  # [s] For how long after a slip of the robot's clock a cycle counts as late (client.recorder).
_LOOK = 5e-5  # [s] How often the state is looked at; it is part of what is measured.


def bench_drag() -> Measurement:
    """From a drag of the target to the new arm pose, through the page's own mailbox and consumer thread."""
    poses: list[float] = []
    plans: list[float] = []
    with Workbench(WorkbenchConfig(port=0)) as bench:
        _wait("the control process", lambda: bench.session.status().phase == "idle")
        _wait("the goal to stand where the arm is", lambda: bench.store.state.no_plan is not None)
        centre = bench.store.state.goal.target
        for step in range(_DRAGS):
            angle = math.tau * step / 50
            offset = (0.0, _RADIUS * math.cos(angle), _RADIUS * math.sin(angle))
            before = bench.store.state
            request = requests.MoveTarget(
                position=tuple((centre.position + offset).tolist()), wxyz=tuple(centre.wxyz.tolist())
            )
            start = time.perf_counter()
            bench.conductor.ask(request)
            _wait("the new pose", lambda before=before: bench.store.state.goal is not before.goal)
            poses.append(time.perf_counter() - start)
            _wait("the new plan", lambda before=before: bench.store.state.plan is not before.plan)
            plans.append(time.perf_counter() - start)
    planned = f"{1e3 * np.median(plans):.1f} ms, p99 {1e3 * np.percentile(plans, 99):.1f} ms"
    return summarise("drag", poses, "ms", 10.0, f"{_DRAGS} drags on a circle; until planned and checked too: {planned}")


def bench_control_loop(seconds: float = 30.0) -> Measurement:
    """Streaming at 1 kHz for a while with the page open in a real browser: how late, how many lost.

    The number is the lateness of a cycle. The promise: no cycle later than 1 ms, none lost, success rate 1.
    """
    browser = find_chromium()
    with Workbench(WorkbenchConfig(port=0)) as bench:
        _wait("the control process", lambda: bench.session.status().phase == "idle")
        with open_page(bench.url, browser) if browser else nullcontext():
            if browser:
                _wait("the page to open", lambda: bool(bench.server.get_clients()))
                time.sleep(min(10.0, seconds))  # The browser compiles shaders and uploads meshes: let it draw.
            return _stream(bench, bench.session.supervisor(), seconds, browser)


def _stream(bench: Workbench, supervisor: Supervisor, seconds: float, browser: str | None) -> Measurement:
    supervisor.reconnect().wait(_PATIENCE)  # Counters start with the connection.
    _wait("the connection", lambda: supervisor.status().phase == "idle")
    supervisor.power_on().wait(_PATIENCE)
    model, before = bench.store.state.model, supervisor.status()
    assert before.q_c is not None
    motion = motion_of(model, seconds, before.q_c)
    certificate = check(motion, model, start=before.q_c).require().certificate
    assert certificate is not None  # A report that is ok has one.
    reader = supervisor.open_reader()
    reader.drain()
    rows: list[NDArray[np.void]] = []
    # The bench is at the controls: a page that is drawn in software can be silent for longer than an operator may be.
    supervisor.set_operator_present(True)
    success, fewest_pages = 1.0, len(bench.server.get_clients())
    with CoreWatch() as watch:
        ticket = supervisor.execute(motion, certificate)
        while not ticket.done:
            supervisor.set_operator_present(True)
            status = supervisor.status()
            if status.motion_time:
                success = min(success, status.success_rate)
            fewest_pages = min(fewest_pages, len(bench.server.get_clients()))
            rows.append(reader.drain())
            time.sleep(0.1)
        ticket.wait(0.0)
        after = supervisor.status()
    rows.append(reader.drain())
    found = _judge(before, after, motion.duration, success, fewest_pages, browser)
    return replace(found, note=f"{found.note}; {_describe_machine(watch, np.concatenate(rows))}")


def _describe_machine(watch: CoreWatch, rows: NDArray[np.void]) -> str:
    """Returns in words what the machine itself did meanwhile, and how many of the late cycles it explains."""
    late = rows[rows["lateness"] > LATE_AFTER]
    moments = 1e-9 * np.where(late["sent_ns"] > 0, late["sent_ns"], late["received_ns"])
    # A late cycle began at its due time, and a slip of the robot's clock is counted for some cycles afterwards.
    explained = watch.explains(moments, late["lateness"] + _MEMORY)
    chance = watch.explains(1e-9 * rows["received_ns"], _MEMORY).mean()
    long = watch.pauses[:, 1] - watch.pauses[:, 0]
    return (
        f"the machine by itself: a core stood still for more than 1 ms {int((long > LATE_AFTER).sum())} times, "
        f"{1e3 * long.max(initial=0.0):.1f} ms at most; {explained.sum()} of {len(late)} late cycles fall together "
        f"with such or a shorter pause (any cycle: {chance:.0%}); the hypervisor says that it kept "
        f"{1e3 * watch.stolen:.0f} ms"
    )


def _judge(
    before: SupervisorStatus,
    after: SupervisorStatus,
    duration: float,
    success: float,
    pages: int,
    browser: str | None,
) -> Measurement:
    late, lost = after.late_cycles - before.late_cycles, after.lost_cycles - before.lost_cycles
    lateness = after.lateness
    note = (
        f"{duration:.1f} s, {lateness.cycles} cycles, {after.scheduling}"
        f"{', memory locked' if after.memory_locked else ''}; p50 {lateness.p50:.0f}, p99 {lateness.p99:.0f}, "
        f"p99.9 {lateness.p999:.0f}, max {lateness.max:.0f} us; {late} late by more than 1 ms, {lost} lost, "
        f"success rate {success:.4f}; "
    ) + (f"page open in {browser}" if browser else "NO BROWSER FOUND, so no page was open and nothing is promised")
    if browser and pages < 1:
        note += "; THE PAGE WENT AWAY"
    kept = late == 0 and lost == 0 and success >= 1.0
    return Measurement(
        name="control_loop", median=lateness.p50, p99=lateness.p99, unit="us", target=1000.0,
        ok=kept and pages > 0 if browser else None, note=note,
    )  # fmt: skip


def _wait(what: str, condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + _PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            raise DeadlineError(f"bench: waited {_PATIENCE:g} s for {what}; look at `rcilab doctor`, then try again")
        time.sleep(_LOOK)
