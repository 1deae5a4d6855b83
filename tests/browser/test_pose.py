"""Posing the arm by hand: what the page shows agrees with our own forward kinematics."""

from __future__ import annotations

import numpy as np


def test_page_opens_and_the_arm_stands_where_the_controller_has_it(page):
    page.wait(lambda: page.shows("live", page.status.q), "the live arm in the controller's pose")
    assert page.chip("model") == "xMatePro7"
    assert page.chip("where") == "virtual controller, ideal arm"
    page.wait(lambda: page.chip("rate").endswith("Hz"), "a state rate in the bar")


def test_dragging_a_joint_slider_poses_the_candidate_and_not_the_robot(page):
    before = np.array(page.status.q_c)
    box = page.slider(1).bounding_box()
    start = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.drag(start, (start[0] + 60, start[1]))
    page.wait(lambda: page.state.goal.q[0] > before[0] + 0.2, "joint 1 of the goal to follow the slider")
    page.wait(lambda: page.shows("candidate", page.state.goal.q), "the candidate arm in the goal's pose")
    assert np.array_equal(page.status.q_c, before)
    assert page.shows("live", before)


def test_arrow_keys_on_a_slider_pose_the_candidate(page):
    before = float(page.state.goal.q[3])
    value = lambda: float(page.slider(4).get_attribute("aria-valuenow"))  # noqa: E731
    page.wait(lambda: abs(value() - np.degrees(before)) < 0.06, "the slider to stand where the goal is")
    page.slider(4).focus()
    for _ in range(5):
        page.tab.keyboard.press("ArrowRight")
    page.wait(lambda: abs(page.state.goal.q[3] - before - np.radians(0.5)) < 1e-3, "five steps of 0.1 deg")


def test_a_typed_negative_fraction_keeps_its_sign(page):
    field = page.joint_field(3)
    field.click()
    page.tab.keyboard.press("Control+a")
    page.tab.keyboard.type("-0.25", delay=60)
    page.wait(lambda: abs(np.degrees(page.state.goal.q[2]) + 0.25) < 1e-9, "joint 3 at -0.25 deg")
    page.wait(lambda: field.input_value() == "-0.25", "the field to show -0.25")


def test_enter_and_leaving_a_field_say_that_the_number_is_complete(page):
    for joint, key in ((1, "Enter"), (2, "Tab")):
        before = dict(page.state.entered)
        page.joint_field(joint).fill("12")
        page.joint_field(joint).press(key)
        page.wait(lambda before=before: page.state.entered != before, f"{key} to be heard")
        page.wait(lambda joint=joint: abs(np.degrees(page.state.goal.q[joint - 1]) - 12.0) < 1e-9, "12 deg")


def test_numbers_typed_without_any_pause_between_fields_all_count(page):
    page.open_tab("Target")
    page.pose_field("x").click()
    page.tab.keyboard.press("ControlOrMeta+a")
    page.tab.keyboard.type("412")
    for number in ("23", "500", "175"):  # viser alone would hear of "4" and of nothing typed into y.
        page.tab.keyboard.press("Tab")
        page.tab.keyboard.type(number)
    page.wait(
        lambda: np.allclose(
            [*page.state.goal.target.position, page.state.goal.target.rpy[0]],
            [0.412, 0.023, 0.5, np.radians(175.0)],
            atol=1e-9,
        ),
        lambda: f"412, 23, 500, 175 to be taken: {page.state.goal.target}",
    )
    assert page.pose_field("x").input_value() in ("412", "412.00")


def test_dragging_the_gizmo_brings_the_tool_to_it(page):
    target = page.state.goal.target.matrix
    page.wait(lambda: np.allclose(page.pose_in("/live", "/target"), target, atol=1e-5), "the gizmo where the goal is")
    start = np.array(page.state.goal.target.position)
    scale = 0.26
    page.drag(page.project("/target", (0, 0, 0.9 * scale)), page.project("/target", (0, 0, 0.6 * scale)))
    page.wait(lambda: np.linalg.norm(page.state.goal.target.position - start) > 0.03, "the target to be dragged")
    goal = page.state.goal
    assert goal.reach.tone in ("good", "warn")
    assert page.state.model.forward(goal.q).is_close(goal.target, 1e-6)
    page.wait(lambda: page.shows("candidate", page.state.goal.q), "the candidate arm at the gizmo")


def test_an_unreachable_target_says_why_and_the_arm_comes_as_near_as_it_can(page):
    page.open_tab("Target")
    page.pose_field("x").fill("1800")
    page.wait(lambda: page.state.goal.reach.tone == "bad", "the target to be out of reach")
    shown = page.tab.locator(".rl-verdict.rl-bad:visible").first
    page.wait(lambda: "out of reach" in shown.inner_text() and "mm" in shown.inner_text(), "the reason in words")
    assert "Not reachable" in shown.inner_text()
    near = page.state.model.forward(page.state.goal.q).position
    assert near[0] > 0.7
    page.wait(lambda: page.shows("candidate", page.state.goal.q), "the candidate arm as near as it can")


BAD_ANGLES = {
    "nan": "not a finite number",
    "abc": "is not a number",
    "1e999": "not a finite number",
    "999": "outside",
    "": "is empty",
}
"""Each is answered otherwise than the one before."""


def test_bad_joint_angles_are_answered_beside_the_field_and_nothing_is_lost(page):
    before = np.array(page.state.goal.q)
    for typed, answer in BAD_ANGLES.items():
        page.type_joint(2, typed)
        page.wait(lambda answer=answer: any(answer in text for text in page.alerts()), f"an answer to {typed!r}")
        assert np.array_equal(page.state.goal.q, before)
        assert page.joint_field(2).input_value() == typed
    page.type_joint(2, "20")
    page.wait(
        lambda: page.alerts() == [] and abs(np.degrees(page.state.goal.q[1]) - 20.0) < 1e-9, "20 deg, no complaint"
    )


def test_bad_pose_numbers_are_answered_in_words(page):
    page.open_tab("Target")
    for field, typed, answer in (("x", "∞", "is not a number"), ("yaw", "1000", "outside"), ("z", "-inf", "finite")):
        page.pose_field(field).fill(typed)
        page.wait(lambda answer=answer: any(answer in text for text in page.alerts()), f"an answer to {typed!r}")
