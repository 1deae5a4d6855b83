"""Latency from the mouse that drags the target to the pixels."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.errors import DeadlineError
from rcilab.diagnostics.bench.browser import open_page, wait_on_page, why_no_page
from rcilab.diagnostics.bench.empty_page import bare_page
from rcilab.diagnostics.bench.loop import wait_for
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.app import Workbench, WorkbenchConfig

if TYPE_CHECKING:
    from playwright.sync_api import Page

_ROBOT = "xMatePro7"
_TURNS, _MOVES = 3, 10  # Both pages alternate, so that drift of the machine's speed affects both.
_FIRST = 4  # Moves that are not counted: the arm that follows is drawn for the first time, with its own shaders.
_REST = 3.0  # [s] After these moves.
_PAUSE = 0.3  # [s] Between the change on the page and the next move.
_SCALE = 0.26  # [m] Size of the target's handles on the page.
_RATIO = 1.3
_HANDLE = """(() => { const m = __viserMutable, x = m.nodeRefFromName['/target']; x.updateWorldMatrix(true, false);
  const v = m.camera.position.clone().set(0, SCALE, 0).applyMatrix4(x.matrixWorld).project(m.camera);
  const r = m.canvas.getBoundingClientRect();
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height]; })()""".replace(
    "SCALE", str(0.9 * _SCALE)
)
_IS_THERE = "!!window.__viserMutable?.nodeRefFromName?.['NODE']"
_POSITION = "__viserMutable.nodeRefFromName['/target'].matrixWorld.elements.join()"
_GRASPS = 5  # Attempts: a busy page may receive the mouse event before the handle is under the mouse.
_GRASP_TIMEOUT = 8.0  # [s] For the target to follow; several times the delay with software rendering.
_WATCH = """(() => { const read = () => __viserMutable.nodeRefFromName['NODE'].matrixWorld.elements.join();
  let moved = 0; window.__late = []; let before = read(), frame = 0;
  addEventListener('pointermove', () => { if (!moved) moved = performance.now(); }, true);
  const look = () => { const now = read(), drawn = __viserTestpoints.rendererInfo.render.frame;
    if (now !== before && !frame) frame = drawn;
    if (frame && drawn > frame) {
      if (moved) __late.push(performance.now() - moved);
      moved = 0; frame = 0; before = now; }
    requestAnimationFrame(look); }; look(); })()"""


def bench_page_drag() -> Measurement | Absent:
    """From the mouse on the target's handle to the pixels of the arm, compared with a plain gizmo of viser."""
    if (reason := why_no_page()) is not None:
        return Absent(name="page_drag", note=reason)
    bare: list[float] = []
    ours: list[float] = []
    for _ in range(_TURNS):
        bare += _drag_bare()
        with Workbench(WorkbenchConfig(port=0, quality="light")) as bench, open_page(bench.url) as page:
            wait_for("the control process", lambda bench=bench: bench.session.status().phase == "idle")
            ours += _drag(page, "/candidate/joint1")
    theirs = 1e3 * float(np.median(bare))
    note = f"{len(ours)} moves; alternating with it viser alone with a gizmo and the same arm, without inverse "
    note += f"kinematics: {theirs:.0f} ms"
    return summarise("page_drag", ours, "ms", _RATIO * theirs, note)


def _drag_bare() -> list[float]:
    """Returns the latencies of a viser server that only moves a frame with a gizmo, [s]."""
    model = load_model(_ROBOT)
    with bare_page() as (server, url):
        server.scene.configure_environment_map(None)
        ArmView(ViserScene(server, shadows=False), "live", model, "live").show(model.home)
        ArmView(ViserScene(server, shadows=False), "candidate", model, "candidate").show(model.home)
        start = model.forward(model.home)
        gizmo = server.scene.add_transform_controls(
            "/target", scale=_SCALE, position=start.position, wxyz=start.wxyz, depth_test=False
        )
        follower = server.scene.add_frame("/follower", axes_length=0.1, axes_radius=0.005)

        @gizmo.on_update
        async def _(_event: object) -> None:
            follower.position = gizmo.position

        with open_page(url) as page:
            return _drag(page, "/follower")


def _drag(page: Page, follower: str) -> list[float]:
    """Returns the latency of each move of a drag, [s]."""
    wait_on_page(page, "the scene", _IS_THERE.replace("NODE", "/target"))
    time.sleep(3.0)  # Shaders are compiled and meshes uploaded while the first frames are drawn.
    x, y = _grasp(page)
    wait_on_page(page, "the arm that follows", _IS_THERE.replace("NODE", follower))
    page.evaluate(_WATCH.replace("NODE", follower))
    for move in range(-_FIRST, _MOVES):
        if move == 0:
            time.sleep(_REST)
            page.evaluate("__late.length = 0")
        seen = page.evaluate("__late.length")
        page.mouse.move(x + 2.0 * (move % 15), y + 1.0 * (move % 15))
        wait_on_page(page, "the arm to follow the mouse", f"__late.length > {seen}")
        time.sleep(_PAUSE)
    page.mouse.up()
    return [1e-3 * float(one) for one in page.evaluate("__late")]


def _grasp(page: Page) -> tuple[float, float]:
    """Presses the mouse on the target's handle until the target follows it, and returns the position, [px].

    The target also moves to the arm's position when the robot is connected; therefore it has to follow two moves.

    Raises:
        DeadlineError: It does not follow.
    """
    for _ in range(_GRASPS):
        x, y = _find_handle(page)
        page.mouse.move(x, y)
        time.sleep(0.5)  # The gizmo notices the mouse on its next drawn frame.
        page.mouse.down()
        if all(_follows(page, x + step, y + 0.5 * step) for step in (3.0, 6.0)):
            return x, y
        page.mouse.up()
    raise DeadlineError(f"bench: the target did not follow the mouse in {_GRASPS} tries; check `rcilab doctor`")


def _find_handle(page: Page) -> tuple[float, float]:
    """Waits until the target's handle and the camera are stationary and returns the position of the handle, [px]."""
    before, now = None, page.evaluate(_HANDLE)
    while now != before:
        time.sleep(0.5)
        before, now = now, page.evaluate(_HANDLE)
    return now[0], now[1]


def _follows(page: Page, x: float, y: float) -> bool:
    """Moves the mouse and returns whether the target moves in response."""
    before, deadline = page.evaluate(_POSITION), time.monotonic() + _GRASP_TIMEOUT
    page.mouse.move(x, y)
    while time.monotonic() < deadline:
        if page.evaluate(_POSITION) != before:
            return True
        time.sleep(0.1)
    return False
