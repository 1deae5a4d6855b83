"""A Franka arm on the page: what its interface has, in its maker's words; plan, check, execute, user stop."""

from __future__ import annotations

import numpy as np
import pytest

from browser.other_arm import switch_arm
from rcilab.app.goal.goal_actions import SetSpeed
from rcilab.app.view_actions import SetView

pytest.importorskip("pylibfranka", reason="the extra franka is not installed")


@pytest.fixture(scope="module")
def switched(opened):
    """The page with an FR3, chosen in its settings; afterwards with the arm of the other tests."""
    yield from switch_arm(opened, "Franka FR3")


@pytest.fixture
def fr3(switched, page):
    assert page.state.model.name == "FR3"
    return page


def headings(page) -> list[str]:
    return page.tab.locator("[aria-expanded]:visible").all_inner_texts()


def test_the_page_has_what_its_interface_has_and_nothing_of_another(fr3):
    page = fr3
    page.open_tab("Setup")
    table = page.tab.locator("table.rl-setup:visible")
    page.wait(lambda: "End effector (EE)" in table.inner_text(), "the parts of this arm")
    for shown in ("Load", "Joint stiffness", "Cartesian stiffness", "Collision thresholds"):
        assert shown in table.inner_text()
    foreign = ("Safety box", "Force-control frame", "Soft joint limits")
    root = page.tab.locator("#root")
    page.wait(lambda: not any(part in root.inner_text() for part in foreign), "no part of another interface")
    page.open_tab("Run")
    page.button("Plan from here").wait_for()
    assert page.button("Power off").count() == page.button("Power on").count() == 0
    page.wait(lambda: "User stop" in " ".join(headings(page)), "the user stop")
    for group in ("Guide by hand", "Digital outputs", "Restart", "gate"):
        assert group not in " ".join(headings(page))
    where = page.tab.locator(".rl-verdict:visible").first
    page.wait(lambda: "fci://" in where.inner_text(), "the address")
    assert "?" not in where.inner_text()  # Without the ports that clients find themselves.


def test_the_note_on_its_elbow_is_as_wide_as_its_group(fr3):
    page = fr3
    page.open_tab("Target")
    note = page.tab.locator(".rl-note:visible", has_text="does not move on a circle")
    note.wait_for()
    group = note.locator("xpath=ancestor::*[contains(@class, 'mantine-Paper-root')][1]")
    assert note.bounding_box()["width"] > 0.85 * group.bounding_box()["width"]


def test_a_plan_is_checked_by_its_conditions_and_executed(fr3, heard):
    page = fr3
    page.plan_to(1, -40.0 if page.status.q_c[0] > 0 else 40.0)
    page.open_tab("Check")
    verdict = page.tab.locator(".rl-verdict.rl-good:visible").first
    page.wait(lambda: "Passed" in verdict.inner_text(), "a green report")
    cards = " ".join(page.tab.locator(".rl-card:visible").all_inner_texts())
    for shown in ("joint_motion_generator_velocity_limits_violation", "dq_max(q)", "Franka's page"):
        assert shown in cards
    goal = np.array(page.state.goal.q)
    page.open_tab("Run")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: page.status.phase == "idle" and np.abs(page.status.q - goal).max() < 1e-6, "the arrival", 30)
    page.wait(lambda: page.state.recording is not None and page.state.recording.tracking is not None, "a recording")
    page.wait(lambda: page.shows("live", goal), "the live arm of the page at the goal")


def test_a_user_stop_ends_the_motion_and_the_arm_is_ready_once_it_is_released(fr3, heard):
    page = fr3
    page.bench.dispatcher.ask(SetSpeed(speed=0.05))
    page.plan_to(1, -40.0 if page.status.q_c[0] > 0 else 40.0)
    page.open_tab("Run")
    page.unfold("User stop")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: (page.status.motion_time or 0.0) > 0.1 and page.status.phase == "moving", "the arm on its way")
    page.button("User stop").click()
    page.wait(lambda: page.status.is_pressed and page.status.phase == "idle", "the stop")
    page.wait(lambda: "The user stop is pressed" in page.toast(), "what has stopped the arm")
    assert page.chip("phase") == "user stop pressed"
    verdicts = page.tab.locator(".rl-verdict:visible")
    page.wait(
        lambda: "the user stop was pressed" in " ".join(verdicts.all_inner_texts()),
        lambda: f"why: {verdicts.all_inner_texts()}",
    )
    page.button("Release").click()
    page.wait(lambda: page.status.phase == "idle" and bool(page.status.powered), "a ready arm without another button")
    page.button("Plan from here").click()
    page.wait(lambda: page.button("Execute").is_enabled(), "the way to go on")


def test_it_speaks_chinese(fr3):
    page = fr3
    page.bench.dispatcher.ask(SetView(name="language", value="zh"))
    page.open_tab("运行")
    page.wait(lambda: any(heading.startswith("用户停止") for heading in headings(page)), "the user stop")
    page.open_tab("配置")
    page.wait(lambda: "末端执行器 (EE)" in page.tab.locator("table.rl-setup:visible").inner_text(), "its parts")
