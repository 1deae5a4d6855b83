"""What a person at the page waits for: that it is there, that a drag shows, that a long recording follows the scrub."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any

import numpy as np
from websockets.sync.client import connect

from rcilab.bench.browser import find_chromium
from rcilab.bench.compute import motion_of
from rcilab.bench.measure import Measurement, summarise
from rcilab.bench.tab import Tab, open_tab
from rcilab.cycle_file import cycle_dtype
from rcilab.model import RobotModel, load_model
from rcilab.recording.run import Run, build_run
from rcilab.views.arm_view import ArmView
from rcilab.views.gate import Gate
from rcilab.views.guarded_server import GuardedServer, listen
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.app import Workbench, WorkbenchConfig
from rcilab.workbench.live import LIVE_PATH

_ROBOT = "xMatePro7"
_LOADS, _MOVES, _SEEKS = 3, 30, 100
_RECORDED = 60.0  # [s]
_MIRRORED = 3.0  # [s]
_RATE = 60.0  # [Hz]

_USABLE = """window.__viserMutable && __viserMutable.nodeRefFromName && __viserMutable.nodeRefFromName['/live']
  && __viserTestpoints.rendererInfo.render.frame > 1 && document.querySelectorAll('[role=slider]').length > 5
  && document.querySelectorAll('.rl-chip').length > 5"""
_SINCE_LOAD = """new Promise((done) => { const look = () => { if (READY)
  done(performance.now() - performance.getEntriesByType('navigation')[0].loadEventEnd); else setTimeout(look, 20); };
  look(); })""".replace("READY", _USABLE)
_HANDLE = """(() => { const m = __viserMutable, x = m.nodeRefFromName['NODE']; x.updateWorldMatrix(true, false);
  const v = m.camera.position.clone().set(0, SCALE, 0).applyMatrix4(x.matrixWorld).project(m.camera);
  const r = m.canvas.getBoundingClientRect();
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height]; })()"""
_WATCH = """(() => { const read = () => __viserMutable.nodeRefFromName['NODE'].matrixWorld.elements.join();
  let moved = 0; window.__late = []; let before = read(), frame = 0;
  addEventListener('pointermove', () => { if (!moved) moved = performance.now(); }, true);
  const look = () => { const now = read(), drawn = __viserTestpoints.rendererInfo.render.frame;
    if (now !== before && !frame) frame = drawn;
    if (frame && drawn > frame) {
      if (moved) __late.push(performance.now() - moved);
      moved = 0; frame = 0; before = now; }
    requestAnimationFrame(look); }; look(); })()"""


def bench_page_ready() -> Measurement:
    """From the browser's load event until the page can be used: arm drawn, controls and status there."""
    browser = find_chromium()
    if browser is None:
        return _without_browser("page_ready", "s")
    times: list[float] = []
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench:
        for _ in range(_LOADS):
            with open_tab(browser) as tab:
                tab.send("Page.enable")
                tab.send("Page.navigate", url=bench.url)
                tab.wait("the page to load", "document.readyState === 'complete' && location.protocol === 'http:'")
                times.append(1e-3 * float(tab.evaluate(_SINCE_LOAD)))
    return summarise("page_ready", times, "s", 2.0, f"{_LOADS} loads, light graphics, in {browser}, drawn in software")


def bench_page_drag() -> Measurement:
    """From the mouse on the target's handle to the pixels of the arm that follows, beside viser's own bare gizmo."""
    browser = find_chromium()
    if browser is None:
        return _without_browser("page_drag", "ms")
    bare = _drag_bare(browser)
    with Workbench(WorkbenchConfig(port=0, quality="light")) as bench, open_tab(browser) as tab:
        ours = _drag(tab, bench.url, "/target", "/candidate/joint1", 0.26)
    target = 1.3 * 1e3 * float(np.median(bare))
    note = f"{len(ours)} moves; viser alone with a gizmo and the same arm, solving nothing: {target / 1.3:.0f} ms"
    return summarise("page_drag", ours, "ms", target, note)


def _drag_bare(browser: str) -> list[float]:
    """Returns the same of a viser server that puts an arm into the pose of a gizmo and does nothing else, [s]."""
    model = load_model(_ROBOT)
    with _server() as (server, port):
        server.scene.configure_environment_map(None)
        arm = ArmView(ViserScene(server, shadows=False), "live", model)
        ArmView(ViserScene(server, shadows=False), "candidate", model, "candidate").show(model.home)
        arm.show(model.home)
        start = model.forward(model.home)
        gizmo = server.scene.add_transform_controls(
            "/target", scale=0.26, position=start.position, wxyz=start.wxyz, depth_test=False
        )
        follower = server.scene.add_frame("/follower", axes_length=0.1, axes_radius=0.005)

        @gizmo.on_update
        async def _(_event: object) -> None:
            follower.position = gizmo.position

        with open_tab(browser) as tab:
            return _drag(tab, f"http://127.0.0.1:{port}/", "/target", "/follower", 0.26)


@contextmanager
def _server() -> Iterator[tuple[Any, int]]:
    """Serves an empty page; yields viser's server and the port."""
    bound = listen("127.0.0.1", 0)
    port = bound.getsockname()[1]
    with GuardedServer(bound, Gate(host="127.0.0.1", port=port)) as guard:
        yield guard.viser, port


def _drag(tab: Tab, url: str, gizmo: str, follower: str, scale: float) -> list[float]:
    """Returns how long each move of a drag took to show, [s]."""
    tab.send("Page.navigate", url=url)
    there = "".join(f" && __viserMutable.nodeRefFromName['{name}']" for name in (gizmo, follower))
    tab.wait("the scene", f"!!(window.__viserMutable && __viserMutable.nodeRefFromName{there})")
    time.sleep(3.0)  # Shaders are compiled and meshes uploaded while the first frames are drawn.
    x, y = tab.evaluate(_HANDLE.replace("NODE", gizmo).replace("SCALE", str(0.9 * scale)))
    tab.evaluate(_WATCH.replace("NODE", follower))
    tab.mouse("mouseMoved", x, y)
    time.sleep(0.5)
    tab.mouse("mousePressed", x, y)
    for move in range(_MOVES):
        tab.mouse("mouseMoved", x + 2.0 * (move % 15), y + 1.0 * (move % 15))
        time.sleep(0.3)
    tab.mouse("mouseReleased", x, y)
    return [1e-3 * late for late in tab.evaluate("window.__late") or [float("nan")]]


def bench_mirror() -> Measurement:
    """What it costs this process, in processor time a second, to keep the arm on one page at 60 Hz."""
    model = load_model(_ROBOT)
    with _server() as (server, port):
        arm = ArmView(ViserScene(server), "live", model)
        origin = {"Origin": f"http://127.0.0.1:{port}"}
        protocol: Any = [f"viser-v{version('viser')}"]
        with connect(
            f"ws://127.0.0.1:{port}/", additional_headers=origin, subprotocols=protocol, max_size=None
        ) as link:
            link.recv(timeout=10.0)
            idle = _processor_time(lambda step: None)
            moving = _processor_time(lambda step: arm.show(model.home + 0.3 * np.sin(0.1 * step + np.arange(model.n))))
    costs = [max(busy - still, 0.0) / _MIRRORED for busy, still in zip(moving, idle, strict=True)]
    note = f"{_RATE:.0f} poses a second of an {_ROBOT}, one page connected; 50 ms a second are 5 % of a core"
    return summarise("mirror", costs, "ms", 50.0, note)


def _processor_time(act) -> list[float]:  # type: ignore[no-untyped-def]
    times: list[float] = []
    for _ in range(3):
        before, start = time.process_time(), time.monotonic()
        for step in range(int(_RATE * _MIRRORED)):
            act(step)
            time.sleep(max(0.0, start + (step + 1) / _RATE - time.monotonic()))
        times.append(time.process_time() - before)
    return times


def bench_scrub() -> Measurement:
    """From a click in a plot of a recording of 60 s to the cursor that every page draws, the arm moved before it."""
    run = recorded(load_model(_ROBOT), _RECORDED)
    times: list[float] = []
    with Workbench(WorkbenchConfig(port=0, quality="light", replay=run)) as bench:
        origin = {"Origin": f"http://127.0.0.1:{bench.port}"}
        with connect(f"ws://127.0.0.1:{bench.port}{LIVE_PATH}", additional_headers=origin, compression=None) as link:
            link.recv(timeout=30.0)
            for place in np.random.default_rng(1).uniform(0.02, 0.98, _SEEKS).tolist():
                start = time.perf_counter()
                link.send(json.dumps({"kind": "seek", "place": place}))
                while "cursor" not in json.loads(link.recv(timeout=30.0)):
                    pass
                times.append(time.perf_counter() - start)
    longest = f"{1e3 * max(times):.0f} ms at most"
    return summarise("scrub", times, "ms", 70.0, f"{_SEEKS} places in {run.duration:.0f} s of 7 joints; {longest}")


def recorded(model: RobotModel, seconds: float) -> Run:
    """Returns a recording of a motion of about this length, made up: measured is what was planned a cycle before."""
    plan = motion_of(model, seconds)
    cycles = np.zeros(len(plan.times), cycle_dtype(model.n))
    late = np.maximum(np.arange(len(cycles)) - 1, 0)
    cycles["message_id"], cycles["t"] = np.arange(1, len(cycles) + 1), plan.times
    cycles["command"], cycles["q_c"], cycles["q"], cycles["dq"] = plan.q, plan.q[late], plan.q[late], plan.dq[late]
    cycles["tau"] = model.torque(plan.q, plan.dq, plan.ddq).full[late]
    cycles["success_rate"] = 1.0
    return build_run(cycles, plan=plan, model=model)


def _without_browser(name: str, unit: str) -> Measurement:
    return Measurement(
        name=name, median=float("nan"), p99=float("nan"), unit="s" if unit == "s" else "ms", target=None, ok=None,
        note="NO BROWSER FOUND, so nothing was measured: install Chromium",
    )  # fmt: skip
