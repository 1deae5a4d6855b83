"""Push the arm as a person: choose MuJoCo, guide, drag a link with the mouse, hold the button, let go."""

from __future__ import annotations

import time

import numpy as np
import pytest

from browser.test_settings import choose
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand


@pytest.fixture
def physics(page):
    """The page with MuJoCo behind it, chosen by hand; the ideal arm comes back afterwards."""
    page.open_tab("Run")
    pid = page.status.controller_pid
    choose(page, "Destination", "virtual controller, MuJoCo (physics)")
    page.wait(lambda: page.status.controller_pid not in (None, pid), "another controller", 30.0)
    page.wait(lambda: page.status.phase == "idle" and bool(page.status.powered), "a powered, idle arm", 30.0)
    page.wait(lambda: "MuJoCo" in page.chip("where"), "the status line to name the plant")
    yield page
    page.bench.session.stop()
    page.wait(lambda: page.status.phase == "idle", "an idle arm")
    page.bench.dispatcher.ask(ChooseRobot(plant="ideal"))
    page.wait(lambda: page.state.plant == "ideal" and page.status.phase != "idle", "the ideal arm to come")
    page.wait(lambda: page.status.phase == "idle" and bool(page.status.powered), "a powered, idle arm", 30.0)


def has_followed(page, start: np.ndarray) -> bool:
    """Whether the arm has moved; guides anew where a busy machine kept the page silent for 2 s, which ends guiding."""
    if page.status.code == "idle.operator":
        page.bench.dispatcher.ask(RobotCommand(what="guide"))
        page.wait(lambda: page.status.code != "idle.operator", "a free arm")
    return bool(np.abs(page.status.q - start).max() > 0.05)


def test_a_guided_arm_is_pulled_by_the_mouse_and_pushed_by_the_button(physics):
    page = physics
    page.unfold("Guide by hand")
    page.unfold("Push the arm")
    page.button("Start guiding").click()
    page.wait(lambda: page.chip("phase") == "guided by hand", "a free arm")
    start = np.array(page.status.q)
    x, y = page.project("/live/joint1/joint2/joint3/joint4", (0.0, 0.0, 0.0))
    mouse = page.tab.mouse
    mouse.move(x, y)
    page.tab.wait_for_timeout(300)
    mouse.down()
    for step in range(1, 9):
        mouse.move(x + 10 * step, y)
        page.tab.wait_for_timeout(60)
    page.wait(lambda: page.state.push.acting is not None, "the pull")
    page.wait(lambda: has_followed(page, start), "the arm to follow the mouse")
    mouse.up()
    page.wait(lambda: page.state.push.acting is None, "the pull to end with the mouse")
    page.wait(lambda: page.shows("live", page.status.q, 1e-2), "the live arm where the arm is")
    before = np.array(page.status.q)
    page.button("Hold to push").scroll_into_view_if_needed()
    page.button("Hold to push").hover()
    mouse.down()
    page.wait(lambda: has_followed(page, before), "the arm to follow the push")
    page.tab.evaluate("window.dispatchEvent(new Event('blur'))")
    last = time.monotonic()

    def has_ended() -> bool:
        """Whether nothing acts for longer than any pause between two messages of a held button."""
        nonlocal last
        if page.state.push.acting is not None:
            last = time.monotonic()
        return time.monotonic() - last > 0.7

    page.wait(has_ended, "the push to end when the window loses the focus")
    mouse.up()
    page.button("Stop guiding").click()
    page.wait(lambda: page.status.code == "idle.guided", "the arm to be held again")
    assert not page.status.faults
