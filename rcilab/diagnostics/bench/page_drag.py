"""How long the pixels lag behind the mouse that drags the target."""

from __future__ import annotations

import time

import numpy as np

from rcilab.core.errors import DeadlineError
from rcilab.diagnostics.bench.bare import bare_page
from rcilab.diagnostics.bench.browser import find_chromium
from rcilab.diagnostics.bench.measure import Absent, Measurement, summarise
from rcilab.diagnostics.bench.tab import Tab, no_browser, open_tab
from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.app import Workbench, WorkbenchConfig

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
_PLACE = "__viserMutable.nodeRefFromName['/target'].matrixWorld.elements.join()"
_GRASPS, _GRASP = 5, 8.0  # [s] A page that is busy may see the mouse before the handle is under it: then once more.
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
    """From the mouse on the target's handle to the pixels of the arm that follows, beside viser's own bare gizmo."""
    browser = find_chromium()
    if browser is None:
        return no_browser("page_drag")
    bare: list[float] = []
    ours: list[float] = []
    for _ in range(_TURNS):
        bare += _drag_bare(browser)
        with Workbench(WorkbenchConfig(port=0, quality="light")) as bench, open_tab(browser) as tab:
            ours += _drag(tab, bench.url, "/candidate/joint1")
    theirs = 1e3 * float(np.median(bare))
    note = f"{len(ours)} moves; in turns with it viser alone with a gizmo and the same arm, solving nothing: "
    note += f"{theirs:.0f} ms"
    return summarise("page_drag", ours, "ms", _RATIO * theirs, note)


def _drag_bare(browser: str) -> list[float]:
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

        with open_tab(browser) as tab:
            return _drag(tab, url, "/follower")


def _drag(tab: Tab, url: str, follower: str) -> list[float]:
    """Returns how long each move of a drag took to show, [s]."""
    tab.open(url)
    tab.wait("the scene", _IS_THERE.replace("NODE", "/target"))
    time.sleep(3.0)  # Shaders are compiled and meshes uploaded while the first frames are drawn.
    x, y = _take_hold(tab)
    tab.wait("the arm that follows", _IS_THERE.replace("NODE", follower))
    tab.evaluate(_WATCH.replace("NODE", follower))
    for move in range(-_FIRST, _MOVES):
        if move == 0:
            time.sleep(_REST)
            tab.evaluate("__late.length = 0")
        seen = tab.evaluate("__late.length")
        tab.mouse("mouseMoved", x + 2.0 * (move % 15), y + 1.0 * (move % 15))
        tab.wait("the arm to follow the mouse", f"__late.length > {seen}")
        time.sleep(_PAUSE)
    tab.mouse("mouseReleased", x, y)
    return [1e-3 * float(one) for one in tab.evaluate("__late")]


def _take_hold(tab: Tab) -> tuple[float, float]:
    """Presses the mouse on the target's handle and returns where, once the target is seen to follow it, [px].

    Raises:
        DeadlineError: It never does.
    """
    for _ in range(_GRASPS):
        x, y = tab.evaluate(_HANDLE)  # Anew: the camera may have stepped back since.
        tab.mouse("mouseMoved", x, y)
        time.sleep(0.5)  # The gizmo notices the mouse on its next drawn frame.
        tab.mouse("mousePressed", x, y)
        before, deadline = tab.evaluate(_PLACE), time.monotonic() + _GRASP
        tab.mouse("mouseMoved", x + 3.0, y + 1.5)
        while time.monotonic() < deadline:
            if tab.evaluate(_PLACE) != before:
                return x, y
            time.sleep(0.1)
        tab.mouse("mouseReleased", x, y)
    raise DeadlineError(f"bench: the target did not follow the mouse in {_GRASPS} tries; look at `rcilab doctor`")
