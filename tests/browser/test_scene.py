"""The scene as a person meets it: the elbow's handle under the mouse, a way to stand looked at and taken."""

from __future__ import annotations

import numpy as np

from rcilab.views.elbow_view import OUTWARD


def test_dragging_the_elbow_turns_it_and_leaves_the_tool(page):
    page.wait(lambda: page.state.scene.elbow is not None, "the elbow's circle")
    target = page.state.goal.target
    elbow = page.state.scene.elbow
    goal_place = elbow.circle.points(elbow.psi + 0.7, OUTWARD)[0] - elbow.circle.points(elbow.psi, OUTWARD)[0]
    page.wait(lambda: page.is_drawn("/elbow/handle"), "the handle")
    page.drag(page.project("/elbow/handle", (0, 0, 0)), page.project("/elbow/handle", tuple(goal_place)))
    page.wait(lambda: abs(page.state.goal.psi - elbow.psi) > 0.4, "the elbow to follow the mouse")
    goal = page.state.goal
    assert goal.target.is_close(target, 1e-9)
    assert page.state.model.forward(goal.q).is_close(target, 1e-6)
    page.wait(lambda: page.shows("candidate", page.state.goal.q), "the candidate arm with its elbow there")


def test_a_way_to_stand_is_seen_under_the_mouse_and_taken_with_enter(page):
    page.open_tab("Target")
    page.pose_field("y").fill("-250")
    rows = page.tab.get_by_role("option")
    page.wait(lambda: rows.count() > 1, "more than one way to stand")
    before = np.array(page.state.goal.q)
    other = page.tab.locator('[role="option"][aria-selected="false"]').first
    place = int(other.get_attribute("data-branch"))
    q = np.array(page.state.goal.reach.solutions[place])
    other.hover()
    page.wait(lambda: page.shows("candidate", q), "the way under the mouse in the scene")
    assert np.array_equal(page.state.goal.q, before)
    other.focus()
    page.tab.keyboard.press("Enter")
    page.wait(lambda: np.abs(page.state.goal.q - q).max() < 1e-6, "the way to be taken")
