"""How long the pixels lag behind the mouse that drags the target."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from rcilab.core.errors import DeadlineError
from rcilab.diagnostics.bench.bare import bare_page
from rcilab.diagnostics.bench.browser import open_page, wait_on_page, why_no_page
from rcilab.diagnostics.bench.loop import wait_for
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.app import Workbench, WorkbenchConfig

if TYPE_CHECKING:
    from playwright.sync_api import Page

_ROBOT = "xMatePro7"
_TURNS, _MOVES = 3, 10  # In turns: the machine's speed drifts, and both should have the same of it.
_FIRST = 4  # Moves that do not count: the arm that follows is drawn for the first time, with shaders of its own.
_REST = 3.0  # [s] After them.
_PAUSE = 0.3  # [s] From what one move has changed to the next move.
_SCALE = 0.26  # [m] As the target's handles of the page.
_RATIO = 1.3
_HANDLE = """(() => { const m = __viserMutable, x = m.nodeRefFromName['/target']; x.updateWorldMatrix(true, false);
  const v = m.camera.position.clone().set(0, SCALE, 0).applyMatrix4(x.matrixWorld).project(m.camera);
  const r = m.canvas.getBoundingClientRect();
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height]; })()""".replace(
    "SCALE", str(0.9 * _SCALE)
)
_IS_THERE = "!!window.__viserMutable?.nodeRefFromName?.['NODE']"
_POSITION = "__viserMutable.nodeRefFromName['/target'].matrixWorld.elements.join()"
_GRASPS = 5  # A busy page may receive the mouse before the handle is under it: then it is tried again.
_GRASP_TIMEOUT = 8.0  # [s] For the target to follow; several times what a page drawn in software takes.
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
    """From the mouse on the target's handle to the pixels of the arm that follows, next to viser's own bare gizmo."""
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
    note = f"{len(ours)} moves; in turns with it viser alone with a gizmo and the same arm, solving nothing: "
    note += f"{theirs:.0f} ms"
    return summarise("page_drag", ours, "ms", _RATIO * theirs, note)


def _drag_bare() -> list[float]:
    """Returns the same of a viser server that moves a frame with a gizmo and does nothing else, [s]."""
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
    """Returns how long each move of a drag took to show, [s]."""
    wait_on_page(page, "the scene", _IS_THERE.replace("NODE", "/target"))
    time.sleep(3.0)  # Shaders are compiled and meshes uploaded while the first frames are drawn.
    x, y = _take_hold(page)
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


def _take_hold(page: Page) -> tuple[float, float]:
    """Presses the mouse on the target's handle and returns where, once the target follows it, [px].

    The target moves by itself once, to where the arm stands when the robot connects: that is not the mouse, so it has
    to follow two moves.

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
    raise DeadlineError(f"bench: the target did not follow the mouse in {_GRASPS} tries; look at `rcilab doctor`")


def _find_handle(page: Page) -> tuple[float, float]:
    """Returns where the target's handle is, [px], once neither it nor the camera moves."""
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
