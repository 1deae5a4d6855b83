"""Provoke a fault and look at it; let the check lead to its rows' moments, slow a plan down, and take it back."""

from __future__ import annotations

import numpy as np

from rcilab.app.goal.goal_actions import MoveJoint, SetLaw

_INK = """() => {
  const plot = document.querySelector("div:has(> .rl-under) + div canvas, div:has(> div > .rl-under) + div canvas");
  if (!plot || !plot.offsetParent || !plot.width) return 0;
  const pixels = plot.getContext("2d").getImageData(0, 0, plot.width, plot.height).data;
  return pixels.filter((value, place) => place % 4 === 3 && value > 0).length;
}"""
_LOOK = "() => [...document.querySelectorAll('.uplot-container')].map((at) => [at.offsetWidth, at.offsetHeight])"


def test_a_fault_is_provoked_beside_the_robot_and_shown_at_its_moment(page):
    page.open_tab("Learn")
    page.button("Torque jumps").click()
    page.wait(lambda: page.state.learn.provoking is not None or page.state.learn.show is not None, "work beside")
    page.wait(lambda: page.tab.get_by_text("fault 17, reported").is_visible(), "the fault on show", 40.0)
    assert page.status.phase == "idle", "the robot of the page has nothing to do with it"
    assert page.tab.get_by_text("kCommandTorqueDiscontinuity").count() >= 1
    page.wait(lambda: page.tab.evaluate(_INK) > 500, lambda: f"its own plot, not {page.tab.evaluate(_LOOK)}")
    page.button("Show as Python").last.click()
    page.wait(lambda: "fault_lab.provoke" in page.tab.locator(".rl-code pre:visible").inner_text(), "its script")
    page.button("Back to the fault lab").click()
    page.wait(lambda: page.button("Torque jumps").is_visible(), "the fault lab")
    page.button("First move").click()
    page.wait(lambda: page.tab.locator(".rl-next").is_visible(), "the first step of a lesson")
    page.bench.dispatcher.ask(MoveJoint(joint=0, angle=0.6))
    page.wait(lambda: page.tab.locator(".rl-done").count() == 1, "a step that ticks itself off")
    page.button("Leave the lesson").click()
    page.wait(lambda: page.state.learn.lesson is None, "the end of the lesson")
    page.wait(lambda: page.toast() != "", "what the step has to say")
    assert page.covered_tabs() == []


def test_a_row_leads_to_its_moment_and_a_slow_down_can_be_taken_back(page):
    page.bench.dispatcher.ask(SetLaw(law="jerk_limited"))  # The law that leaves torque rates out.
    page.plan_to(1, 40)
    page.open_tab("Check")
    page.wait(lambda: page.state.plan is not None and page.state.plan.complete, "a complete check")
    fast = page.state.plan
    row = page.tab.locator("[data-condition='joint.torque_rate']")
    row.focus()
    page.tab.keyboard.press("Enter")
    page.wait(lambda: page.state.check.row == "joint.torque_rate", "the row")
    found = next(row for row in fast.report.rows if row.id == "joint.torque_rate")
    assert np.isclose(page.state.playhead * fast.motion.duration, min(found.time, fast.motion.duration))
    page.button("Slow down to fit").click()
    page.wait(lambda: page.tab.get_by_text("slowed down as a whole").is_visible(), "by how much")
    assert all(row.ok for row in page.state.plan.report.rows)
    page.button("Undo slow-down").click()
    page.wait(lambda: page.state.plan is fast, "the fast plan")
    page.button("Explain").click()
    page.wait(lambda: page.tab.get_by_text("The robot would accept this motion").is_visible(), "the report in words")
