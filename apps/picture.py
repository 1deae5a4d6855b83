"""The README's picture and film, taken of the real page in Chromium, with a virtual arm.

    python apps/picture.py still apps/workbench.png
    python apps/picture.py film apps/workbench.webp

Needs Chromium and `pip install -e '.[test]'`. Without a graphics card a film takes some minutes: the mouse moves
on when a frame is there, and each is shown equally long, so that dragging looks as it does on a faster machine.
"""

from __future__ import annotations

import argparse
import io
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Locator, Page, sync_playwright

from rcilab.app.goal.goal_actions import MoveJoint, PoseGoal, SetSpeed
from rcilab.app.request import TypeField
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand
from rcilab.app.setup.setup_actions import SetSetup
from rcilab.app.view_actions import Seek
from rcilab.views.elbow_view import OUTWARD
from rcilab.workbench.app import Workbench, WorkbenchConfig

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
VIEW, FILM = (1280, 800), (960, 600)  # [px]
STEP = 100  # [ms] A frame of a movement is shown so long.
START = (-40.0, 25.0, 0.0, 95.0, 0.0, 60.0, 0.0)  # [deg]
GOAL = (-52.0, 35.0, -14.0, 78.0, 18.0, 55.0, 10.0)  # [deg]
BOX = {"xmin": -450, "ymin": -480, "zmin": 0, "xmax": 800, "ymax": 600, "zmax": 1050}  # [mm]
ARROW = 0.9 * 0.26  # [m] Where the tips of the target's handles are.
DRAWN = """() => window.__viserMutable?.nodeRefFromName?.['/target'] && __viserTestpoints.rendererInfo.render.frame > 3
  && +getComputedStyle(__viserMutable.canvas).opacity > 0.98"""
PLACE = """([name, offset]) => {
  const m = __viserMutable, node = m.nodeRefFromName[name], r = m.canvas.getBoundingClientRect();
  node.updateWorldMatrix(true, false);
  const v = m.camera.position.clone().set(...offset).applyMatrix4(node.matrixWorld).project(m.camera);
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height];
}"""
RENDERED = """async (count) => {
  const info = __viserTestpoints.rendererInfo.render, from = info.frame, end = performance.now() + 4000;
  while (info.frame < from + count && performance.now() < end) await new Promise((done) => requestAnimationFrame(done));
}"""
DRESS = """() => {
  const hand = document.createElement('div'), word = document.createElement('div');
  hand.innerHTML = '<svg width="26" height="34" viewBox="0 0 13 17"><path d="M1 1v12l3-3 2 5 2.4-1-2-4.8H11z" '
    + 'fill="#111" stroke="#fff" stroke-width="1"/></svg>';
  hand.style.cssText = 'position:fixed;z-index:1000001;pointer-events:none;left:-60px;transform-origin:0 0';
  word.id = 'word';
  word.style.cssText = 'position:fixed;z-index:1000000;pointer-events:none;left:654px;bottom:16px;display:none;'
    + 'transform:translateX(-50%);padding:6px 15px;border-radius:18px;background:#0f1c2ee8;color:#fff;'
    + 'font:600 14px/1.3 system-ui,sans-serif;white-space:nowrap';
  document.body.append(hand, word);
  addEventListener('pointermove', (event) => {
    hand.style.left = event.clientX + 'px';
    hand.style.top = event.clientY + 'px';
  }, true);
  for (const [kind, size] of [['pointerdown', 0.8], ['pointerup', 1]])
    addEventListener(kind, () => { hand.style.transform = `scale(${size})`; }, true);
}"""
SAY = """(text) => {
  const word = document.getElementById('word');
  word.textContent = text;
  word.style.display = '';
}"""


class Camera:
    """One page, a mouse that is seen, and the frames that were taken."""

    def __init__(self, bench: Workbench, tab: Page) -> None:
        self.bench, self.tab = bench, tab
        self.ask = bench.dispatcher.ask
        self.frames: list[Image.Image] = []
        self.times: list[int] = []
        self.hand = (690.0, 700.0)

    def wait(self, condition: Callable[[], object], seconds: float = 40.0) -> None:
        """Waits for something behind the page."""
        for _ in range(int(20 * seconds)):
            if condition():
                return
            self.tab.wait_for_timeout(50)
        raise TimeoutError("the page or its arm did not get there; try again on a machine with less to do")

    def settle(self, frames: int = 2) -> None:
        """Lets the page draw."""
        self.tab.evaluate(RENDERED, frames)

    def take(self, time: int = STEP) -> None:
        """Takes a frame, to be shown so long, [ms]."""
        shot = Image.open(io.BytesIO(self.tab.screenshot(type="jpeg", quality=94)))
        self.frames.append(shot.convert("RGB").resize(FILM, Image.Resampling.LANCZOS))
        self.times.append(time)

    def say(self, words: str) -> None:
        """Writes a caption below the arm."""
        self.tab.evaluate(SAY, words)

    def glide(self, end: tuple[float, float], steps: int, *, drawn: int = 0) -> None:
        """Moves the mouse, a frame a step; `drawn`: how many pictures of the scene each step waits for."""
        start = self.hand
        for step in range(1, steps + 1):
            share = step / steps
            share = share * share * (3.0 - 2.0 * share)
            self.hand = (start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share)
            self.tab.mouse.move(*self.hand)
            if drawn:
                self.tab.wait_for_timeout(60)
                self.settle(drawn)
            self.take()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Holds the mouse button down."""
        self.tab.wait_for_timeout(500)  # The handles notice the mouse on their next drawn frame.
        self.tab.mouse.down()
        yield
        self.tab.mouse.up()

    def hover(self, control: Locator, steps: int = 3) -> None:
        """Goes to a control."""
        box = control.bounding_box()
        assert box is not None
        self.glide((box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]), steps)

    def press(self, control: Locator) -> None:
        """Goes to a control and clicks it."""
        self.hover(control)
        self.tab.mouse.down()
        self.tab.mouse.up()
        self.tab.wait_for_timeout(300)

    def spot(self, node: str, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> tuple[float, float]:
        """Where the page sees a point of the scene, [px]."""
        x, y = self.tab.evaluate(PLACE, [node, list(offset)])
        return x, y

    def tab_named(self, name: str) -> Locator:
        """One of the eight tabs."""
        return self.tab.get_by_role("tab", name=name, exact=True)

    def go(self, degrees: tuple[float, ...]) -> None:
        """Brings the arm to where the film begins."""
        self.pose(degrees)
        self.ask(RobotCommand(what="execute", page=self.bench.store.state.control_lock.holder))
        self.wait(lambda: self.bench.store.state.recording is not None and self.idle)
        self.ask(PoseGoal(name="here"))
        self.wait(lambda: self.bench.store.state.plan is None)

    def pose(self, degrees: tuple[float, ...]) -> None:
        """Sets the goal, and waits for its plan."""
        for joint, angle in enumerate(degrees):
            self.ask(MoveJoint(joint=joint, angle=angle / 57.29577951308232))
        self.wait(lambda: self._reached(degrees))

    def _reached(self, degrees: tuple[float, ...]) -> bool:
        plan = self.bench.store.state.plan
        return plan is not None and max(abs(plan.motion.goal * 57.29577951308232 - degrees)) < 1e-6

    @property
    def idle(self) -> bool:
        """Whether the arm stands there, ready."""
        status = self.bench.session.status()
        return status.phase == "idle" and bool(status.powered)


def still(camera: Camera, path: Path) -> None:
    """The arm, its goal, a path that leaves the safety box, and what the check says about it."""
    ask, state = camera.ask, camera.bench.store
    ask(SetSetup(name="box", value=True))
    ask(SetSetup(name="active", value=True))
    for face, playhead in BOX.items():
        ask(TypeField(field=f"setup.box.{face}", text=str(playhead)))
    camera.pose(GOAL)
    camera.wait(lambda: state.state.plan is not None and not state.state.plan.report.ok)
    ask(Seek(playhead=0.45))
    camera.tab_named("Check").click()
    camera.tab.wait_for_timeout(1500)
    camera.settle(4)
    camera.tab.screenshot(path=path)


def drag(camera: Camera) -> None:
    """The target by its arrows: along, out of reach, and back."""
    camera.say("Drag the target: the arm, its path and the plots follow")
    camera.take(900)
    camera.glide(camera.spot("/target", (0.0, ARROW, 0.0)), 4, drawn=1)
    end = camera.spot("/target", (0.0, ARROW + 0.38, 0.0))
    with camera.held():
        camera.glide(end, 8, drawn=1)
    camera.take(700)
    camera.glide(camera.spot("/target", (ARROW, 0.0, 0.0)), 3, drawn=1)
    here, beyond = camera.spot("/target", (ARROW, 0.0, 0.0)), camera.spot("/target", (ARROW - 0.3, 0.0, 0.0))
    with camera.held():
        camera.glide(beyond, 5, drawn=1)
        camera.say("Out of reach: it says why, and how far")
        camera.take(1500)
        camera.glide(here, 3, drawn=1)
    camera.settle()
    camera.take(500)


def turn(camera: Camera) -> None:
    """The elbow on its circle, and the other ways to stand."""
    camera.say("Seven axes: slide the elbow on its circle")
    elbow = camera.bench.store.state.scene.elbow
    assert elbow is not None
    goal = [tuple(point) for point in elbow.circle.points(elbow.psi + np.linspace(0.0, 0.6, 3), OUTWARD)]
    camera.glide(camera.spot("/elbow_handle"), 4, drawn=1)
    places = [camera.spot("/live", point) for point in goal[1:]]
    with camera.held():
        for playhead in places:
            camera.glide(playhead, 3, drawn=1)
    camera.take(600)
    camera.say("Every branch of the inverse, before it is chosen")
    for row in (1, 2):
        camera.hover(camera.tab.locator(".rl-branch").nth(row))
        camera.settle()
        camera.take(700)


def scrub(camera: Camera) -> None:
    """The plan in time."""
    camera.say("The plan in time, with its limits as bands")
    thumb = camera.tab.get_by_role("slider", name="Time [%]")
    camera.hover(thumb)
    box = thumb.bounding_box()
    assert box is not None
    with camera.held():
        camera.glide((box["x"] + 250.0, box["y"] + 6.0), 9, drawn=1)
    camera.take(300)


def run(camera: Camera) -> None:
    """Check, Execute, plan against actual."""
    bench = camera.bench
    camera.ask(SetSpeed(speed=0.02))  # So slow that frames are drawn on the way.
    camera.press(camera.tab_named("Check"))
    camera.say("The check: every condition with its bound and its source")
    camera.take(1800)
    camera.press(camera.tab_named("Run"))
    camera.say("Execute at 1 kHz, on a virtual controller or on the arm")
    camera.take(500)
    camera.press(camera.tab.get_by_role("button", name="Execute", exact=True))
    camera.wait(lambda: bench.session.status().phase == "moving")
    while bench.session.status().phase == "moving":
        camera.take(2 * STEP)
    camera.wait(lambda: bench.store.state.recording is not None and bench.store.state.recording.tracking is not None)
    camera.tab.wait_for_timeout(800)
    camera.settle()
    camera.say("Afterwards: plan against actual, error by error")
    camera.take(2400)


def fault(camera: Camera) -> None:
    """One of the fault lab."""
    learn = camera.bench.store
    camera.press(camera.tab_named("Learn"))
    camera.say("Twenty faults to provoke, each with cause and remedy")
    camera.take(600)
    camera.press(camera.tab.get_by_role("button", name="Joint jerk sent", exact=True))
    camera.wait(lambda: learn.state.learn.provoking is None and learn.state.learn.show is not None)
    camera.tab.wait_for_timeout(800)
    camera.settle()
    camera.take(2600)


def film(camera: Camera, path: Path) -> None:
    """Drag, look, check, execute, compare."""
    begin(camera)
    for chapter in CHAPTERS:
        chapter(camera)
    first, *others = camera.frames
    first.save(path, save_all=True, append_images=others, duration=camera.times, loop=0, quality=62, method=5)


def begin(camera: Camera) -> None:
    """Brings arm and page to where the film begins."""
    camera.ask(ChooseRobot(plant="mujoco"))
    camera.wait(lambda: camera.bench.store.state.plant == "mujoco" and camera.idle)
    camera.go(START)
    camera.tab.evaluate(DRESS)
    camera.tab_named("Target").click()
    camera.tab.mouse.move(*camera.hand)
    camera.tab.evaluate("document.getElementById('rl-toast').className = ''")  # That the arm has come here is no news.
    camera.settle(3)


CHAPTERS = (drag, turn, scrub, run, fault)


@contextmanager
def opened(quality: str, sharpness: float) -> Iterator[Camera]:
    """Starts a workbench of its own and a Chromium that looks at it; `sharpness` is of the scene."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    with Workbench(WorkbenchConfig(port=0, quality=quality)) as bench, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=FLAGS)
        tab = browser.new_page(viewport={"width": VIEW[0], "height": VIEW[1]})
        tab.add_init_script("localStorage.setItem('rcilab.stop', 'said')")
        tab.goto(f"{bench.url}?fixedDpr={sharpness}")
        tab.wait_for_function(DRAWN, timeout=120_000)
        tab.evaluate("document.querySelectorAll('.mantine-Notification-closeButton').forEach((one) => one.click())")
        camera = Camera(bench, tab)
        camera.wait(lambda: bench.store.state.control_lock.holder is not None and bench.session.status().powered)
        yield camera
        browser.close()


def main() -> int:
    """Takes one of them."""
    parser = argparse.ArgumentParser(description="Take the README's picture or film of the real page.")
    parser.add_argument("what", choices=("still", "film"))
    parser.add_argument("path", type=Path)
    parser.add_argument("--quality", choices=("full", "light"), default="full", help="light: no shadows, sooner there")
    arguments = parser.parse_args()
    with opened(arguments.quality, FILM[0] / VIEW[0] if arguments.what == "film" else 1.0) as camera:
        {"still": still, "film": film}[arguments.what](camera, arguments.path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
