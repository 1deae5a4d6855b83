"""Latency of seeking in a long recording: in Python, and in a browser."""

from __future__ import annotations

import json
import time

import numpy as np
from websockets.sync.client import connect

from rcilab.app.control_lock_actions import PageOpened
from rcilab.core.cycle_log import cycle_dtype
from rcilab.core.errors import RcilabError
from rcilab.diagnostics.bench.browser import open_page, wait_on_page, why_no_page
from rcilab.diagnostics.bench.compute import motion_of
from rcilab.diagnostics.bench.loop import wait_for
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.model.robot_model import RobotModel, load_model
from rcilab.recording.run import Run, build_run
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.live import LIVE_PATH

_ROBOT = "xMatePro7"
_RECORDED = 60.0  # [s]
_SEEKS = 100
_SCRUB_TIME = 8.0  # [s] From one end of the recording to the other and back.
_MOVE_TIME = 0.04  # [s] Between two moves of the mouse.
_STALL = 500.0  # [ms] A longer pause between two frames is visible as a freeze.
_PAGE = 1  # Client id of the page that seeks; it needs the control lock.
_READY = """!!window.__viserMutable?.nodeRefFromName?.['/live/joint1']
  && __viserTestpoints.rendererInfo.render.frame > 3 && document.querySelectorAll('.u-over .rl-cursor').length > 3"""
_SLIDER = """(() => { const strip = document.querySelector('div:has(> div > .rl-strip)');
  const track = strip?.querySelector('.mantine-Slider-trackContainer'); if (!track) return null;
  const r = track.getBoundingClientRect(); return [r.left, r.right, (r.top + r.bottom) / 2]; })()"""
_WATCH = """(() => { window.__changes = { arm: [performance.now()], cursor: [performance.now()] };
  const seen = {}, arm = __viserMutable.nodeRefFromName['/live/joint1'];
  const note = (what, now) => {
    if (seen[what] !== undefined && seen[what] !== now) __changes[what].push(performance.now());
    seen[what] = now; };
  let drawn = -1, pose = '';
  const look = () => { const frame = __viserTestpoints.rendererInfo.render.frame;
    if (frame !== drawn) { drawn = frame; pose = arm.quaternion.toArray().join(); }
    note('arm', pose); note('cursor', document.querySelector('.u-over .rl-cursor').style.left);
    requestAnimationFrame(look); };
  look(); })()"""


def bench_scrub() -> Measurement:
    """From a click in a plot of a 60 s recording to the new cursor on every page, after the arm was moved."""
    run = recorded(load_model(_ROBOT), _RECORDED)
    times: list[float] = []
    with Workbench(WorkbenchConfig(port=0, quality="light", replay=run)) as bench:
        origin = {"Origin": f"http://127.0.0.1:{bench.port}"}
        with connect(f"ws://127.0.0.1:{bench.port}{LIVE_PATH}", additional_headers=origin, compression=None) as link:
            bench.dispatcher.ask(PageOpened(page=_PAGE))
            link.send(json.dumps({"kind": "hello", "page": _PAGE, "key": bench.live.introduce(_PAGE)}))
            wait_for("the controls", lambda: bench.store.state.control_lock.holder == _PAGE, 30.0)
            for position in np.random.default_rng(1).uniform(0.02, 0.98, _SEEKS).tolist():
                start = time.perf_counter()
                link.send(json.dumps({"kind": "seek", "share": position}))
                while "cursor" not in (message := json.loads(link.recv(timeout=30.0))):
                    if "beat" in message:
                        link.send('{"kind": "here"}')
                times.append(time.perf_counter() - start)
    longest = f"{1e3 * max(times):.0f} ms at most"
    return summarise("scrub", times, "ms", 70.0, f"{_SEEKS} positions in {run.duration:.0f} s of 7 joints; {longest}")


def bench_page_scrub() -> Measurement | Absent:
    """Time between two frames while the slider of a 60 s recording is dragged to its end and back.

    The number is the time from one new frame of the arm to the next; the target is for the longest.
    """
    if (reason := why_no_page()) is not None:
        return Absent(name="page_scrub", note=reason)
    run = recorded(load_model(_ROBOT), _RECORDED)
    with Workbench(WorkbenchConfig(port=0, quality="light", replay=run)) as bench, open_page(bench.url) as page:
        wait_on_page(page, "the recording on the page", _READY)
        time.sleep(3.0)  # Shaders are compiled and meshes uploaded while the first frames are drawn.
        left, right, y = wait_on_page(page, "the slider of the timeline", _SLIDER)
        page.mouse.move(left, y)
        page.mouse.down()
        page.evaluate(_WATCH)
        start = time.monotonic()
        while (share := (time.monotonic() - start) / _SCRUB_TIME) < 1.0:
            x = left + (right - left) * (1.0 - abs(1.0 - 2.0 * share))
            page.mouse.move(x, y)
            time.sleep(_MOVE_TIME)
        page.mouse.up()
        changes = page.evaluate("__changes")
    arm, cursor = (1e-3 * np.diff(changes[what]) for what in ("arm", "cursor"))
    if len(arm) < 2 or len(cursor) < 2:
        raise RcilabError("bench: nothing followed the slider of the timeline")
    found = summarise("page_scrub", arm, "ms", None)
    longest = 1e3 * max(arm.max(), cursor.max())
    note = (
        f"{run.duration:.0f} s of 7 joints scrubbed in {_SCRUB_TIME:.0f} s, light graphics drawn in software: "
        f"{len(arm)} frames of the arm, {1e3 * arm.max():.0f} ms between two at most; {len(cursor)} positions of the "
        f"cursor in the plots, {1e3 * cursor.max():.0f} ms at most; the target is for the longest"
    )
    return Measurement(
        name="page_scrub",
        median=found.median,
        p99=found.p99,
        unit="ms",
        target=_STALL,
        ok=bool(longest <= _STALL),
        note=note,
    )


def recorded(model: RobotModel, seconds: float) -> Run:
    """Returns a synthetic recording of a motion of about this duration: measured values lag the plan by one cycle."""
    plan = motion_of(model, seconds)
    cycles = np.zeros(len(plan.times), cycle_dtype(model.n))
    late = np.maximum(np.arange(len(cycles)) - 1, 0)
    cycles["message_id"], cycles["t"] = np.arange(1, len(cycles) + 1), plan.times
    cycles["command"], cycles["q_c"], cycles["q"], cycles["dq"] = plan.q, plan.q[late], plan.q[late], plan.dq[late]
    cycles["tau"] = model.torque(plan.q, plan.dq, plan.ddq).full[late]
    cycles["success_rate"] = 1.0
    return build_run(cycles, plan=plan, model=model)
