"""Plan, check, execute, stop: the robot really moves, and the page mirrors it."""

from __future__ import annotations

import numpy as np

from browser.page import close_toasts
from rcilab.app.goal.goal_actions import SetSpeed
from rcilab.i18n.translator import message


def test_plan_check_execute_and_the_arm_arrives(page):
    goal_deg = -40.0 if page.status.q_c[0] > 0 else 40.0
    page.plan_to(1, goal_deg)
    page.open_tab("Check")
    verdict = page.tab.locator(".rl-verdict.rl-good:visible").first
    page.wait(lambda: "Passed" in verdict.inner_text(), "a green report")
    assert page.tab.locator(".rl-card:visible").count() >= 9
    goal = np.array(page.state.goal.q)
    page.open_tab("Run")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: page.status.phase == "moving", "the arm to move")
    page.wait(
        lambda: page.status.phase == "idle" and np.abs(page.status.q - goal).max() < 1e-6, "the arm to arrive", 30
    )
    page.wait(lambda: page.shows("live", goal), "the live arm of the page at the goal")
    page.wait(
        lambda: page.state.recording is not None and page.state.recording.t[-1] > 0.9 * page.state.plan.motion.duration,
        "a recording",
    )
    assert not page.button("Execute").is_enabled(), "a certificate that was used up must not be pressable again"
    page.wait(lambda: "at the end of this plan" in page.tab.locator(".rl-why").inner_text(), "the reason")
    start = page.state.plan.motion.start
    page.button("Back to the start").click()
    page.wait(lambda: np.abs(page.state.plan.motion.goal - start).max() < 1e-9, "a plan back to the start")
    page.wait(lambda: page.button("Execute").is_enabled(), "the way back")
    page.wait(lambda: not page.button("Back to the start").is_visible(), "only the next step to be offered")


def test_a_page_that_is_loaded_anew_opens_its_tab_and_says_what_it_missed(page):
    page.open_tab("Check")
    page.wait(lambda: is_open(page, "Check"), "the tab to open")
    page.tab.wait_for_timeout(200)  # The page looks at its tabs every 50 ms.
    page.tab.goto("about:blank")
    page.bench.store.notify("warn", message("notice.stopped"))
    page.tab.goto(f"{page.bench.url}?fixedDpr=0.2")
    page.wait(lambda: "Stopped" in page.toast(), "what was said meanwhile")
    page.wait_until_drawn()
    close_toasts(page.tab)
    page.wait(lambda: is_open(page, "Check"), "the tab that was open")


def is_open(page, name: str) -> bool:
    tab = page.tab.get_by_role("tab", name=name)
    return tab.count() == 1 and tab.get_attribute("aria-selected") == "true"


def stop_in_mid_motion(page, press) -> None:
    start = np.array(page.status.q_c)
    page.bench.dispatcher.ask(SetSpeed(speed=0.05))
    page.plan_to(1, 60.0 if start[0] <= 0 else -60.0)
    goal = np.array(page.state.goal.q)
    page.open_tab("Run")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: page.status.phase == "moving" and abs(page.status.q[0] - start[0]) > 0.05, "the arm on its way")
    press()
    page.wait(lambda: page.status.phase == "idle", lambda: f"the arm to come to rest: {page.status}", 5.0)
    q = np.array(page.status.q_c)
    assert abs(q[0] - goal[0]) > 0.1, "the arm stopped short of the goal"
    assert not page.status.faults, "a controlled stop raises no fault"
    page.wait(lambda: page.shows("live", page.status.q), "the live arm where it stopped")
    page.button("Plan from here").click()
    page.wait(lambda: page.button("Execute").is_enabled(), "the way to go on")


def test_stop_brings_the_arm_to_rest_short_of_the_goal(page):
    stop_in_mid_motion(page, lambda: page.button("Stop").click())


def test_escape_does_the_same_even_while_a_text_field_has_the_focus(page):
    def press() -> None:
        page.tab.get_by_role("textbox").last.focus()
        page.tab.keyboard.press("Escape")

    stop_in_mid_motion(page, press)


def test_play_moves_only_the_translucent_arm(page):
    page.plan_to(2, float(np.degrees(page.status.q_c[1])) - 25.0)
    before = np.array(page.status.q_c)
    page.button("Play").click()
    page.wait(lambda: page.state.playhead > 0.3, "the preview to play")
    page.wait(lambda: page.state.playhead == 1.0 and not page.state.playing, "the preview to end")
    assert np.array_equal(page.status.q_c, before)


def test_a_click_in_a_plot_moves_the_timeline(page):
    page.plan_to(2, float(np.degrees(page.status.q_c[1])) - 25.0)
    over = page.tab.locator(".u-over").nth(1)

    def click_until_it_moves() -> bool:  # A plot is drawn anew for the new plan; a click on the old one is lost.
        box = over.bounding_box()
        if box is not None and page.state.playhead == 0.0:
            page.tab.mouse.click(box["x"] + box["width"] * 0.3, box["y"] + box["height"] / 2)
        return page.state.playhead > 0.0

    page.wait(click_until_it_moves, "the timeline to move")
    t = page.state.playhead * page.state.plan.motion.duration
    page.wait(lambda: page.shows("plan", page.state.plan.motion.at(t).q, 1e-4), "the plan's arm at that moment")
