"""The page as a person meets it, and the few looks behind it that a test needs (viser's unofficial test hooks)."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from rcilab.app.goal.goal_actions import PoseGoal, SetLaw, SetSpeed
from rcilab.app.view_actions import SetView
from tests.waiting import wait_for

_PROJECT = """([name, offset]) => {
  const m = __viserMutable, node = m.nodeRefFromName[name];
  node.updateWorldMatrix(true, false);
  const v = m.camera.position.clone().set(...offset).applyMatrix4(node.matrixWorld).project(m.camera);
  const r = m.canvas.getBoundingClientRect();
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height];
}"""
_RELATIVE = """([root, node]) => {
  const n = __viserMutable.nodeRefFromName, a = n[root], b = n[node];
  if (!a || !b) return null;
  a.updateWorldMatrix(true, false); b.updateWorldMatrix(true, false);
  return a.matrixWorld.clone().invert().multiply(b.matrixWorld).transpose().elements;
}"""
_DRAWN = """() => window.__viserMutable && __viserMutable.nodeRefFromName
  && __viserMutable.nodeRefFromName['/live'] && __viserMutable.nodeRefFromName['/mark']
  && __viserTestpoints.rendererInfo.render.frame > 3"""

_COVERED = """() => [...document.querySelectorAll('#root [role=tab]')].filter((tab) => {
  const r = tab.getBoundingClientRect();
  return !tab.contains(document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2));
}).map((tab) => tab.textContent)"""


def close_toasts(tab) -> None:
    """Closes viser's notice about software rendering, which covers the top left of the scene."""
    tab.evaluate("document.querySelectorAll('.mantine-Notification-closeButton').forEach((button) => button.click())")


class BenchPage:
    """One browser page on a workbench."""

    def __init__(self, tab, bench) -> None:
        self.tab, self.bench = tab, bench
        self.problems: list[str] = []
        """What the page's own script threw."""

    @property
    def state(self):
        return self.bench.store.state

    @property
    def status(self):
        return self.bench.session.status()

    def wait(self, condition: Callable[[], bool], what: str, timeout: float = 15.0) -> None:
        wait_for(condition, what=what, timeout=timeout, tab=self.tab)

    def wait_until_drawn(self) -> None:
        self.tab.wait_for_function(_DRAWN, timeout=40_000)

    def start_afresh(self) -> None:
        """Puts robot and settings into the state a test starts from, past the page."""
        ask = self.bench.dispatcher.ask
        if self.status.phase == "fault":
            self.bench.session.robot().recover().wait(10.0)
        self.wait(lambda: self.status.phase == "idle" and bool(self.status.powered), "a powered, idle arm", 30.0)
        ask(SetView(name="language", value="en"))
        ask(SetSpeed(speed=0.5))
        ask(SetLaw(law="torque_rate_limited"))

        while True:  # Again when a slider of the last test has only now told what it had to.
            before = self.state.goal
            ask(PoseGoal(name="here"))
            self.wait(lambda before=before: self.state.goal is not before, "the goal to be posed")
            if self.state.plan is None:
                break
        self.wait(lambda: self.state.language == "en", "the page's own language")
        self.wait(lambda: self.status.phase == "idle", "an idle arm")
        self.wait(lambda: self.state.control_lock.holder is not None, "the controls in this page's hand")
        if not self.rows().is_visible():
            self.open_tab("Jog")
        self.wait(lambda: self.alerts() == [], "no complaint of an earlier test")

    def wait_for_arm(self, name: str) -> None:
        """Waits until an arm that was chosen is ready and in the scene."""
        self.wait(lambda: self.state.model.name == name, "the other model", 30)
        self.wait(lambda: self.status.phase == "idle" and bool(self.status.powered), "a ready arm", 30)
        self.wait(lambda: self.shows("live", self.status.q), "the arm in the scene", 30)

    def open_tab(self, name: str) -> None:
        self.tab.get_by_role("tab", name=name).click()

    def covered_tabs(self) -> list[str]:
        """The tabs in whose middle something else would take a click."""
        return self.tab.evaluate(_COVERED)

    def unfold(self, title: str) -> None:
        """Opens a group whose title begins so, where it is folded."""
        head = self.tab.locator("[aria-expanded]:visible", has_text=re.compile(f"^{title}")).first
        if head.get_attribute("aria-expanded") == "false":
            head.click()

    def button(self, name: str):
        return self.tab.get_by_role("button", name=name, exact=True)

    def group(self, mark: str):
        """The groups of controls that begin with a mark of ours, found from the mark upwards.

        From above, as `div:has(> div > .mark)`, playwright looks into every element of the page: 60 ms of it, not 3.
        """
        return self.tab.locator(f".{mark}").locator("xpath=../..")

    def rows(self):
        """The sliders and typed numbers of the Jog tab."""
        return self.group("rl-joints").first

    def slider(self, joint: int):
        return self.rows().get_by_role("slider").nth(joint - 1)

    def joint_field(self, joint: int):
        return self.rows().locator(".mantine-TextInput-root input").nth(joint - 1)

    def pose_field(self, name: str):
        place = ("x", "y", "z", "roll", "pitch", "yaw").index(name)
        fields = self.group("rl-trios").locator("visible=true").first  # Of the tab that is open.
        return fields.locator(".mantine-TextInput-root input").nth(place)

    def alerts(self) -> list[str]:
        return self.tab.locator(".rl-problem").all_inner_texts()

    def chip(self, name: str) -> str:
        return self.tab.locator(f"[data-id={name}] b").inner_text()

    def toast(self) -> str:
        return (
            self.tab.locator("#rl-toast.rl-shown").inner_text()
            if self.tab.locator("#rl-toast.rl-shown").count()
            else ""
        )

    def tool_pose(self, arm: str) -> np.ndarray | None:
        """Pose of an arm's tool in its base as the page's scene holds it, (4, 4)."""
        n = self.state.model.n
        return self.pose_in(f"/{arm}", f"/{arm}" + "".join(f"/joint{i}" for i in range(1, n + 1)) + "/flange/tool")

    def pose_in(self, root: str, node: str) -> np.ndarray | None:
        """Pose of a node in another one as the page's scene holds it, (4, 4); None while one of them is missing."""
        numbers = self.tab.evaluate(_RELATIVE, [root, node])
        return None if numbers is None else np.array(numbers).reshape(4, 4)

    def shows(self, arm: str, q: np.ndarray, tolerance: float = 1e-5) -> bool:
        """Whether the page's scene has this arm in this pose, by our own forward kinematics."""
        pose = self.tool_pose(arm)
        return pose is not None and float(np.abs(pose - self.state.model.forward(q).matrix).max()) < tolerance

    def is_drawn(self, node: str) -> bool:
        """Whether the page's scene has this node."""
        return bool(self.tab.evaluate("name => !!__viserMutable.nodeRefFromName[name]", node))

    def project(self, node: str, offset: tuple[float, float, float]) -> tuple[float, float]:
        """Where on the page a point of a node is, [px], once neither it nor the camera moves."""
        at = [0.0, 0.0]

        def rests() -> bool:
            before, at[:] = list(at), self.tab.evaluate(_PROJECT, [node, list(offset)])
            return abs(at[0] - before[0]) + abs(at[1] - before[1]) < 0.5

        self.wait(rests, f"{node} to stand still on the page")
        return at[0], at[1]

    def frame(self) -> int:
        """How many frames of the scene have been drawn."""
        return self.tab.evaluate("__viserTestpoints.rendererInfo.render.frame")

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8) -> None:
        mouse = self.tab.mouse
        mouse.move(*start)
        drawn = self.frame()
        self.wait(lambda: self.frame() >= drawn + 2, "frames in which the gizmo notices the mouse")
        mouse.down()
        for step in range(1, steps + 1):
            share = step / steps
            mouse.move(start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share)
            self.tab.wait_for_timeout(60)
        mouse.up()

    def type_joint(self, joint: int, text: str) -> None:
        self.joint_field(joint).fill(text)
        self.joint_field(joint).press("Enter")

    def plan_to(self, joint: int, degrees: float) -> None:
        """Poses one joint of the goal by typing, and waits for the plan."""
        self.open_tab("Jog")
        self.type_joint(joint, str(degrees))
        wanted = np.radians(degrees)
        self.wait(
            lambda: self.state.plan is not None and abs(self.state.plan.motion.goal[joint - 1] - wanted) < 1e-9,
            f"a plan to joint {joint} = {degrees} deg",
        )
