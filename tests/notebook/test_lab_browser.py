"""A person in JupyterLab: runs a notebook with `Lab(model)`, moves a slider, sees the arm move, executes, stops."""

from __future__ import annotations

import os
import re
import shutil
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rcilab
from rcilab.notebook.browser_watchdog import PAGE_GONE
from tests.notebook.jupyter_servers import serving
from tests.waiting import wait_for

FLAGS = (
    "--no-sandbox --no-first-run --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader "
    # A graphics processor would have to be imitated: it is kept to what cannot do without, the scenes.
    "--disable-gpu-rasterization --disable-gpu-compositing "
    "--disable-background-networking --disable-component-update --disable-sync --disable-default-apps "
    "--disable-background-timer-throttling --disable-renderer-backgrounding --disable-backgrounding-occluded-windows"
).split()
FLAGS.append("--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE localhost")
CELL = """import rcilab
from rcilab.notebook import Lab
model = rcilab.load_model("xMatePro7")
lab = Lab(model, height=240)
lab"""
SESSION = """robot = rcilab.simulate(model)
robot.power_on()
motion = rcilab.plan_joint(model, robot.state.q_c, model.home + 0.5, speed=0.005)"""
MOVE = """run = robot.execute(motion)
with open("ended", "w") as file:
    file.write(str(run.stopped))"""
LESSON = "01_first_motion.zh.ipynb"
PRO7 = rcilab.load_model("xMatePro7")
TOOL = "/".join(["meshcat", "arm", *(f"joint{i}" for i in range(1, 8)), "flange", "tool"])
WORLD = """(path) => {
  let node = viewer.scene_tree;
  for (const part of path.split("/")) node = node && node.children[part];
  if (!node) return null;
  node.object.updateWorldMatrix(true, false);
  return node.object.matrixWorld.clone().transpose().elements;
}"""


def find_chromium() -> str | None:
    found = (shutil.which(name) for name in ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"))
    return next((path for path in found if path), None)


@pytest.fixture(scope="module")
def jupyter(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[dict[str, Any], Path]]:
    """A JupyterLab that `rcilab lab` has opened on a notebook with one cell, as it tells about itself; its folder."""
    import nbformat

    folder = tmp_path_factory.mktemp("lab")
    (folder / "notes").mkdir()
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    note = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)], metadata=kernel)
    nbformat.write(note, folder / "notes" / "lab.ipynb")
    shutil.copy(Path(__file__).parents[2] / "notebooks" / LESSON, folder / "notes")
    with serving([sys.executable, "-m", "rcilab.cli", "lab", str(folder / "notes")], folder) as server:
        yield server, folder


def address(server: dict[str, Any], place: str) -> str:
    return f"{server['url']}{place}?token={server['token']}"


@pytest.fixture(scope="module")
def page(jupyter: tuple[dict[str, Any], Path]) -> Iterator[Any]:
    path = find_chromium()
    if path is None:
        reason = "no Chromium found: install it (Debian: apt install chromium) to run the browser tests"
        pytest.fail(reason) if os.environ.get("CI") == "true" else pytest.skip(reason)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=FLAGS)
        context = browser.new_context(viewport={"width": 1280, "height": 1000})
        context.set_default_timeout(40_000)
        outside: list[str] = []

        def note(request: Any) -> None:
            if not re.match(r"(https?://127\.0\.0\.1|https?://localhost|data:|blob:)", request.url):
                outside.append(request.url)

        context.on("request", note)  # To stop each and let it go on would cost the page its cache.
        tab = context.new_page()
        tab.goto(address(jupyter[0], "lab/tree/lab.ipynb"))
        yield tab
        context.close()
        browser.close()
        assert outside == [], f"JupyterLab asked for something beyond this machine: {outside}"


def run_all(page: Any) -> None:
    """Presses Run, Run All Cells, until the cell runs: JupyterLab drops what is asked before it has a kernel."""
    page.get_by_text("(ipykernel) | Idle").wait_for()
    prompt = page.locator(".jp-CodeCell .jp-InputPrompt").first

    def is_asked() -> bool:
        return prompt.inner_text().strip() not in ("", "[ ]:")

    def begun() -> bool:
        page.keyboard.press("Escape")
        page.get_by_role("menuitem", name="Run", exact=True).click()
        entry = page.get_by_text("Run All Cells", exact=True)
        if entry.is_visible():
            entry.click()
            with suppress(AssertionError):
                wait_for(is_asked, what="the cell to run", timeout=3.0, tab=page)
        return is_asked()

    wait_for(begun, what="the cell to run", timeout=40.0, tab=page)


def tool_in_scene(page: Any) -> np.ndarray | None:
    """Pose of the solid arm's tool, in its base, as the scene inside the notebook has it; None while it loads."""
    scene = next((frame for frame in page.frames if "/static/" in frame.url and "127.0.0.1" in frame.url), None)
    if scene is None or not scene.evaluate("() => typeof viewer !== 'undefined' && !!viewer.scene_tree"):
        return None
    base, tool = (scene.evaluate(WORLD, path) for path in ("meshcat/arm", TOOL))
    if base is None or tool is None:
        return None
    return np.linalg.inv(np.array(base).reshape(4, 4)) @ np.array(tool).reshape(4, 4)


def shows(page: Any, q: np.ndarray) -> bool:
    found = tool_in_scene(page)
    return found is not None and float(np.abs(found - PRO7.forward(q).matrix).max()) < 1e-4


def button(page: Any, name: str) -> Any:
    return page.locator(".rl-root button:visible", has_text=re.compile(rf"^\s*{name}\s*$"))


def turn_joint_1(page: Any, handle: Any) -> np.ndarray:
    """Brings the joint from home to 30 degrees by the keys of its slider, and returns where the arm is seen then."""
    for key in (*["PageUp"] * 11, *["ArrowRight"] * 5):  # Five steps of half a degree, and one.
        handle.press(key)  # Wherever a cell that still runs has taken the focus to.
    goal = PRO7.home.copy()
    goal[0] = np.radians(30.0)
    wait_for(lambda: shows(page, goal), what="the arm where the slider put it", timeout=40.0, tab=page)
    return goal


@pytest.fixture(scope="module")
def goal(page: Any) -> np.ndarray:
    """Where a person has put joint 1 by its slider; the arm is connected and powered, and a plan is slow (1 %)."""
    run_all(page)
    page.locator(".rl-title").wait_for()
    wait_for(lambda: shows(page, PRO7.home), what="the arm at home in the scene", timeout=40.0, tab=page)
    assert page.locator(".Toastify__toast").count() == 0  # Nothing has popped up.
    found = turn_joint_1(page, page.locator(".widget-tab .noUi-handle:visible").first)
    page.get_by_role("tab", name="Run", exact=True).click()
    button(page, "Connect").click()
    button(page, "Power on").click()
    page.locator(".rl-chip", has_text=re.compile("^ready$")).wait_for()
    page.get_by_role("tab", name="Plan", exact=True).click()
    field = page.locator(".widget-tab input[type=text]:visible").first
    field.fill("1")
    field.press("Enter")
    return found


def test_jupyterlab_starts_on_loopback_and_serves_the_directory(jupyter: tuple[dict[str, Any], Path]) -> None:
    server, folder = jupyter
    assert server["hostname"] == "127.0.0.1"
    assert Path(server["root_dir"]) == folder / "notes"
    with urllib.request.urlopen(address(server, "lab"), timeout=20) as page:
        assert b"JupyterLab" in page.read()


@pytest.mark.browser
def test_a_person_runs_the_lab_moves_a_slider_executes_and_stops(page: Any, goal: np.ndarray) -> None:
    button(page, "Plan there").click()
    page.locator(".rl-chip", has_text="Passed").wait_for()
    page.get_by_role("tab", name="Run", exact=True).click()
    button(page, "Execute").click()
    page.locator(".rl-chip", has_text=re.compile("^moving$")).wait_for()
    wait_for(lambda: not shows(page, PRO7.home), what="the solid arm on its way", timeout=40.0, tab=page)
    button(page, "Stop").first.click()
    page.get_by_text("Stopped before its end").wait_for()
    assert not shows(page, goal)


@pytest.mark.browser
def test_a_tab_that_is_closed_stops_what_panel_and_cell_move_but_not_one_without_timers(
    page: Any, goal: np.ndarray, jupyter: tuple[dict[str, Any], Path]
) -> None:
    from jupyter_client.blocking.client import BlockingKernelClient

    client = BlockingKernelClient(connection_file=str(next((jupyter[1] / "runtime").glob("kernel-*.json"))))
    client.load_connection_file()
    client.start_channels()
    client.execute_interactive(SESSION, timeout=60)
    page.get_by_role("tab", name="Plan", exact=True).click()
    button(page, "Plan there").click()
    page.get_by_role("tab", name="Run", exact=True).click()
    button(page, "Execute").click()
    page.locator(".rl-chip", has_text=re.compile("^moving$")).wait_for()
    client.execute(MOVE)
    page.evaluate("window.setTimeout = window.setInterval = window.requestAnimationFrame = () => 0")  # As if hidden.
    time.sleep(4.0)  # Longer than a page may be silent.
    ended = jupyter[1] / "notes" / "ended"
    assert not ended.exists()
    page.close()
    deadline = time.monotonic() + 20.0
    while not ended.exists() or ended.read_text() != PAGE_GONE:
        assert time.monotonic() < deadline, "the cell's arm goes on although nobody is there"
        time.sleep(0.1)
    told = {
        "phase": "lab.state.status.phase",
        "left": "lab.state.now.plan.motion.duration - lab.state.status.motion_time",
    }
    while True:
        reply = client.execute_interactive("", user_expressions=told, timeout=30)
        phase, left = (reply["content"]["user_expressions"][name]["data"]["text/plain"] for name in told)
        if phase == "'idle'":
            break
        assert time.monotonic() < deadline, "the arm goes on although nobody is there"
        time.sleep(0.2)
    client.execute_interactive("lab.close(); robot.close()", timeout=30)  # What runs on would slow down the next test.
    client.stop_channels()
    assert float(left) > 2.0  # It was to go on so long.


@pytest.mark.browser
def test_the_first_lesson_runs_in_its_language_and_its_slider_moves_the_arm(
    page: Any, jupyter: tuple[dict[str, Any], Path]
) -> None:
    tab = page.context.new_page()
    tab.set_viewport_size({"width": 1280, "height": 2600})  # Cells out of sight are not there.
    tab.goto(address(jupyter[0], f"lab/workspaces/lesson/tree/{LESSON}"))
    run_all(tab)
    handle = tab.locator(".widget-hslider .noUi-handle").first
    handle.wait_for()
    label = tab.locator(".widget-hslider .widget-label").first
    wait_for(lambda: label.inner_text() == "关节 1", what="its label, which is drawn after it", tab=tab)
    wait_for(lambda: shows(tab, PRO7.home), what="the arm at home in the preview", timeout=40.0, tab=tab)
    turn_joint_1(tab, handle)
    wait_for(
        lambda: tab.get_by_text("(ipykernel) | Idle").count() == 1, what="the end of the lesson", timeout=40.0, tab=tab
    )
    assert tab.locator("[data-mime-type='application/vnd.jupyter.stderr']").count() == 0
    tab.close()
