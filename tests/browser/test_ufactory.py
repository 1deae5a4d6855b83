"""An xArm on the page: the parts of its interface by their names, its error codes, a motion, the emergency stop."""

from __future__ import annotations

import numpy as np
import pytest

from browser.other_arm import switch_arm
from browser.test_settings import choose
from rcilab.app.goal.goal_actions import SetSpeed
from rcilab.app.setup.configuration_state import pending_parts
from rcilab.app.view_actions import Seek, SetView

pytest.importorskip("xarm", reason="the extra xarm is not installed")


_CUT = """() => [...document.querySelectorAll('button *')].filter(
  (part) => part.offsetParent && part.innerText && part.scrollWidth > part.clientWidth
).map((part) => part.innerText)"""


@pytest.fixture(scope="module")
def switched(opened):
    """The page with an xArm7, chosen in its settings; afterwards with the arm of the other tests."""
    yield from switch_arm(opened, "UFACTORY xArm7")


@pytest.fixture
def xarm7(switched, page):
    assert page.state.model.name == "xArm7"
    return page


def headings(page) -> str:
    return " ".join(page.tab.locator("[aria-expanded]:visible").all_inner_texts())


def test_the_page_has_what_its_interface_has_by_its_names(xarm7):
    page = xarm7
    page.open_tab("Setup")
    table = page.tab.locator("table.rl-setup:visible")
    page.wait(lambda: "TCP offset" in table.inner_text(), "the parts of this arm")
    for shown in (
        "Safety boundary",
        "TCP load",
        "Reduced joint ranges",
        "Collision sensitivity",
        "Joint jerk 11459°/s³",
    ):
        assert shown in table.inner_text()
    page.wait(lambda: "Joint ranges of reduced mode" in headings(page), "the ranges")
    assert "At a soft limit" not in headings(page)
    choose(page, "Part", "TCP offset")
    page.group("rl-triples").locator("visible=true").locator(".mantine-TextInput-root input").nth(2).fill("120")
    page.wait(lambda: "The controller has: 0, 0, 120 mm" in table.inner_text(), "the offset at the controller")
    page.button("Undo").click()
    page.wait(lambda: page.state.setup.wanted.tool.position[2] == 0.0, "the offset as it was")
    page.wait(lambda: pending_parts(page.state, page.status) == (), "the controller to have it")
    choose(page, "Part", "choose …")
    page.open_tab("Run")
    page.wait(lambda: "Emergency stop: press, release" in headings(page), "the emergency stop")
    where = page.tab.locator(".rl-verdict:visible").first
    page.wait(lambda: "xarm://" in where.inner_text(), "the address")


def test_a_plan_is_checked_by_its_conditions_and_executed(xarm7, heard):
    page = xarm7
    page.plan_to(1, -40.0 if page.status.q_c[0] > 0 else 40.0)
    page.open_tab("Check")
    verdict = page.tab.locator(".rl-verdict.rl-good:visible").first
    page.wait(lambda: "Passed" in verdict.inner_text(), "a green report")
    cards = " ".join(page.tab.locator(".rl-card:visible").all_inner_texts())
    for shown in ("C23", "C60", "UFACTORY Studio"):
        assert shown in cards
    assert "every fifth row" in " ".join(page.tab.locator(".rl-note:visible").all_inner_texts())
    goal = np.array(page.state.goal.q)
    page.open_tab("Run")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: page.status.phase == "idle" and np.abs(page.status.q - goal).max() < 1e-5, "the arrival", 30)
    page.wait(lambda: page.state.recording is not None and page.state.recording.tracking is not None, "a recording")
    page.wait(lambda: page.shows("live", goal), "the live arm of the page at the goal")


def test_an_emergency_stop_stays_an_error_until_recover(xarm7, heard):
    page = xarm7
    page.bench.dispatcher.ask(SetSpeed(speed=0.05))
    page.plan_to(1, -40.0 if page.status.q_c[0] > 0 else 40.0)
    page.open_tab("Run")
    page.unfold("Emergency stop")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: (page.status.motion_time or 0.0) > 0.1 and page.status.phase == "moving", "the arm on its way")
    page.button("Emergency stop").click()
    page.wait(lambda: page.status.is_pressed and page.status.phase == "fault", "the stop")
    page.wait(lambda: page.chip("phase") == "emergency stop", "the stop in the header")
    facts = page.tab.locator(".rl-card.rl-bad:visible")
    page.wait(lambda: "C1" in " ".join(facts.all_inner_texts()), lambda: f"the error: {facts.all_inner_texts()}")
    page.button("Release").click()
    page.wait(lambda: page.button("Recover").is_enabled(), "the way out")
    page.button("Recover").click()
    page.wait(lambda: page.status.phase == "idle" and bool(page.status.powered), "a ready arm")
    page.button("Plan from here").click()
    page.wait(lambda: page.button("Execute").is_enabled(), "the way to go on")


def test_no_name_of_a_fault_is_cut_and_its_arm_is_drawn_at_the_end_of_the_record_too(xarm7):
    page = xarm7
    page.open_tab("Learn")
    page.wait(lambda: page.button("Servo tool speed").is_visible(), "its faults")
    assert page.tab.evaluate(_CUT) == []
    page.button("Servo tool speed").click()
    page.wait(lambda: page.state.learn.show is not None, "the fault on show", 40.0)
    page.bench.dispatcher.ask(Seek(playhead=1.0))
    end = page.state.learn.show.displayed.scene.motion.goal
    page.wait(lambda: page.state.playhead == 1.0 and page.shows("plan", end), "the arm at the end of the record")
    page.button("Back to the fault lab").click()
    page.wait(lambda: page.button("Servo tool speed").is_visible(), "the fault lab")


def test_it_speaks_chinese(xarm7):
    page = xarm7
    page.bench.dispatcher.ask(SetView(name="language", value="zh"))
    page.open_tab("配置")
    table = page.tab.locator("table.rl-setup:visible")
    page.wait(lambda: "TCP 偏移" in table.inner_text() and "安全边界" in table.inner_text(), "its parts")
    page.open_tab("学习")
    page.wait(lambda: page.button("伺服模式的工具速度").is_visible(), "its faults")
