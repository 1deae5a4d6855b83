"""The scene as a person meets it: elbow and ways to stand by mouse, words that stay inside, the camera brought back."""

from __future__ import annotations

import numpy as np

from rcilab.views.elbow_view import OUTWARD
from rcilab.views.viser_stage import camera_position

_ASKED = """async () => {
  const ask = window.requestAnimationFrame, began = performance.now();
  let count = 0;
  window.requestAnimationFrame = (draw) => { count++; return ask.call(window, draw); };
  await new Promise((done) => setTimeout(done, 1000));
  window.requestAnimationFrame = ask;
  return count / (performance.now() - began) * 1000;
}"""


def test_an_idle_page_asks_for_few_frames_and_smooths_no_edges_of_a_light_scene(page):
    page.wait(lambda: page.tab.evaluate(_ASKED) < 8.0, "fewer than 8 frames a second")  # viser itself asks for one.
    looks = "document.querySelector('#root canvas[data-engine]').getContext('webgl2').getContextAttributes().antialias"
    assert page.tab.evaluate(looks) is False


def test_dragging_the_elbow_turns_it_and_leaves_the_tool(page):
    page.wait(lambda: page.state.scene.elbow is not None, "the elbow's circle")
    target = page.state.goal.target
    elbow = page.state.scene.elbow
    goal_place = elbow.circle.points(elbow.psi + 0.7, OUTWARD)[0] - elbow.circle.points(elbow.psi, OUTWARD)[0]
    page.wait(lambda: page.is_drawn("/elbow_handle"), "the handle")
    page.drag(page.project("/elbow_handle", (0, 0, 0)), page.project("/elbow_handle", tuple(goal_place)))
    page.wait(lambda: abs(page.state.goal.psi - elbow.psi) > 0.4, "the elbow to follow the mouse")
    goal = page.state.goal
    assert goal.target.is_close(target, 1e-9)
    assert page.state.model.forward(goal.q).is_close(target, 1e-6)
    page.wait(lambda: page.shows("candidate", page.state.goal.q), "the candidate arm with its elbow there")


_OPACITY = """(name) => {
  const found = [];
  __viserMutable.nodeRefFromName[name].traverse(({ visible, material }) => { if (visible && material) found.push(material.opacity); });
  return [Math.min(...found), Math.max(...found)];
}"""  # noqa: E501
"""Of the fainter and of the stronger parts of a node."""


def test_handles_are_faint_until_pointed_at_and_the_elbow_has_its_circle_only_then(page):
    tab = page.tab
    page.wait(lambda: page.is_drawn("/elbow_handle"), "the handle")
    tab.locator("#rl-brand").hover()
    page.wait(lambda: tab.evaluate(_OPACITY, "/target") == [0.45, 0.45], "a faint target")
    page.wait(lambda: not tab.evaluate("rcilabScene.isShown(rcilabScene.node('/elbow'))"), "no circle")
    tab.mouse.move(*page.project("/target", (0.1, 0.0, 0.0)))
    page.wait(lambda: tab.evaluate(_OPACITY, "/target")[0] == 1.0, "a target that can be seen")
    assert tab.evaluate(_OPACITY, "/elbow_handle") == [0.55, 0.55]
    tab.mouse.move(*page.project("/elbow_handle", (0.0, 0.0, 0.0)))
    page.wait(lambda: tab.evaluate("rcilabScene.isShown(rcilabScene.node('/elbow'))"), "the circle")
    page.wait(lambda: tab.evaluate(_OPACITY, "/elbow_handle") == [1.0, 1.0], "a handle that can be seen")
    tab.locator("#rl-brand").hover()
    page.wait(lambda: not tab.evaluate("rcilabScene.isShown(rcilabScene.node('/elbow'))"), "no circle")
    page.open_tab("Target")
    page.group("rl-elbow").first.hover()
    page.wait(lambda: page.state.scene.is_elbow_edited, "the circle, as its controls are pointed at")
    tab.locator("#rl-brand").hover()
    page.wait(lambda: not page.state.scene.is_elbow_edited, "no circle")


def test_a_plan_and_the_workspace_have_legends_and_a_plane_cuts_the_workspace(page):
    tab, legends = page.tab, page.tab.locator("#rl-legends")
    page.plan_to(1, 15.0)
    page.wait(lambda: "Path: share of the limits" in legends.inner_text(), "the legend of the path")
    tab.get_by_role("button", name="Workspace").click()
    page.wait(lambda: "close to a singularity" in legends.inner_text(), "the legend of the workspace")
    count = """() => { let count = 0; const cloud = rcilabScene.node("/cloud");
        if (cloud) cloud.traverse((o) => { if (o.isPoints) count = o.geometry.attributes.position.count; });
        return count; }"""
    page.wait(lambda: tab.evaluate(count) == 4000, "the workspace")
    legends.get_by_role("button", name="z", exact=True).click()
    page.wait(lambda: page.is_drawn("/cut") and tab.evaluate(count) < 4000, "the plane, and less of the workspace")
    before = page.state.scene.cut.at
    legends.get_by_role("slider").press("ArrowLeft")
    page.wait(lambda: page.state.scene.cut.at < before, "the plane to move")
    legends.get_by_role("button", name="off").click()
    page.wait(lambda: page.state.scene.cut is None and tab.evaluate(count) == 4000, "the whole workspace")
    tab.get_by_role("button", name="Workspace").click()
    page.wait(lambda: "Workspace" not in legends.inner_text(), "no legend of it")


def test_a_way_to_stand_is_seen_under_the_mouse_and_taken_with_enter(page):
    page.open_tab("Target")
    page.pose_field("y").fill("-250")
    page.tab.keyboard.press("Enter")
    page.wait(lambda: abs(page.state.goal.target.position[1] + 0.25) < 1e-9, "the number to count")
    rows = page.tab.get_by_role("option")
    page.wait(lambda: rows.count() == len(page.state.goal.reach.solutions) > 1, "more than one way to stand")
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


EDGES = """() => {
  let scene = __viserMutable.nodeRefFromName['/live'];
  while (scene.parent) scene = scene.parent;
  const camera = __viserMutable.camera, V = camera.matrixWorldInverse.elements, P = camera.projectionMatrix.elements, found = [];
  scene.traverse((mesh) => {
    const uniforms = mesh.isMesh && mesh.material.uniforms;
    if (!uniforms || !uniforms.uLabelData || uniforms.uAtlas || !mesh.geometry.attributes.aRect) return;
    const { aLabelIndex, aRect, aParams } = mesh.geometry.attributes, data = uniforms.uLabelData.value.image.data;
    for (let i = 0; i < mesh.geometry.instanceCount; i++) {
      const [x, y, z, isShown] = data.slice(4 * aLabelIndex.array[i], 4 * aLabelIndex.array[i] + 4);
      const depth = -(V[2] * x + V[6] * y + V[10] * z + V[14]), right = V[0] * x + V[4] * y + V[8] * z + V[12];
      const scale = aParams.array[2 * i + 1] * (depth / 10) * uniforms.uFovScale.value * 800 / uniforms.uViewportHeight.value;
      const [left, , width] = aRect.array.slice(4 * i, 4 * i + 4);
      if (isShown) found.push((right + (left + width) * scale) * P[0] / depth, (right + left * scale) * P[0] / depth);
    }
  });
  return found;
}"""  # noqa: E501
"""Where labels end and begin across the picture, which reaches from -1 to 1."""


def test_words_stay_inside_the_scene_and_a_lost_camera_comes_back(page):
    page.open_tab("Target")
    page.pose_field("x").fill("600")
    page.pose_field("y").fill("700")
    page.wait(lambda: np.allclose(page.state.goal.target.position[:2], (0.6, 0.7)), "a target at the edge of the scene")
    assert page.state.goal.reach.tone == "bad", "it has a long verdict"

    def is_at_edge() -> bool:
        edges = page.tab.evaluate(EDGES)
        return 0.9 < max(edges) < 1.0 and min(edges) > -1.0

    page.wait(is_at_edge, lambda: f"words up to it: {page.tab.evaluate(EDGES)}")
    page.tab.wait_for_timeout(500)  # It may have been there on the way.
    page.wait(is_at_edge, lambda: f"the whole verdict inside: {page.tab.evaluate(EDGES)}")
    camera = next(iter(page.bench.server.get_clients().values())).camera
    camera.position = (0.5, -1.5, -0.9)
    page.wait(lambda: page.tab.evaluate("__viserMutable.camera.position.y") < -0.8, "a camera below the floor")
    page.tab.locator("#rl-brand").click()
    page.tab.keyboard.press("h")
    page.wait(
        lambda: abs(page.tab.evaluate("__viserMutable.camera.position.y") - camera_position(camera.aspect)[2]) < 0.01,
        "the camera where the page opened it",
    )


BOXES = EDGES.replace(
    "const [left, , width] = aRect.array.slice(4 * i, 4 * i + 4);",
    "const [left, low, width, height] = aRect.array.slice(4 * i, 4 * i + 4);"
    "const up = V[1] * x + V[5] * y + V[9] * z + V[13];",
).replace(
    "found.push((right + (left + width) * scale) * P[0] / depth, (right + left * scale) * P[0] / depth)",
    "found.push([[left, left + width].map((e) => (right + e * scale) * P[0] / depth),"
    "[low, low + height].map((e) => (up + e * scale) * P[5] / depth)])",
)
"""The edges of every label that is shown, across and along the picture."""


def test_no_words_lie_on_others(page):
    """Three labels at one place, and one where the toolbar is."""
    labels = [
        page.bench.server.scene.add_label(
            f"/test_label/{k}", f"words that are long {k}", position=(0.3, 0.0, 0.3), anchor="bottom-left",
            depth_test=False, font_screen_scale=1.0,
        )
        for k in range(3)
    ]  # fmt: skip
    labels.append(page.bench.server.scene.add_label("/test_label/3", "edge", position=(0.7, 0.4, 0.0)))
    toolbar = page.tab.evaluate(
        "2 * (document.getElementById('rl-toolbar').getBoundingClientRect().left - rcilabScene.box().left)"
        " / rcilabScene.box().width - 1"
    )

    def apart() -> bool:
        boxes = page.tab.evaluate(BOXES)
        beside = all(across[1] <= toolbar + 1e-3 for across, _ in boxes)
        return (
            beside
            and len(boxes) >= 4
            and not any(
                a[0][0] < b[0][1] - 1e-4
                and b[0][0] < a[0][1] - 1e-4
                and a[1][0] < b[1][1] - 1e-4
                and b[1][0] < a[1][1] - 1e-4
                for i, a in enumerate(boxes)
                for b in boxes[:i]
            )
        )

    try:
        page.wait(apart, lambda: f"labels apart: {page.tab.evaluate(BOXES)}")
    finally:
        for label in labels:
            label.remove()


def test_the_toolbar_turns_the_camera_and_shows_what_is_switched_on(page):
    tab = page.tab
    where = "() => __viserMutable.camera.position.toArray()"
    tab.get_by_role("button", name="From the top").click()
    page.wait(lambda: abs(tab.evaluate(where)[2]) > 2.0 * abs(tab.evaluate(where)[0]), "the camera above the arm")
    frames = tab.locator("#rl-toolbar [aria-pressed]").nth(1)
    frames.click()
    page.wait(lambda: "frames" in page.state.scene.extras, "the frames")
    page.wait(lambda: frames.get_attribute("aria-pressed") == "true", "the pressed button")
    frames.click()
    page.wait(lambda: "frames" not in page.state.scene.extras, "no frames")
    tab.get_by_role("button", name="View of the whole arm").click()
    page.wait(lambda: abs(tab.evaluate(where)[0]) > 0.5, "the first view")


def test_a_finger_turns_the_camera_and_moves_a_handle_only_after_a_long_press(page):
    tab, session = page.tab, page.tab.context.new_cdp_session(page.tab)
    where = "() => __viserMutable.camera.position.toArray()"

    def touch(kind: str, *points: tuple[float, float]) -> None:
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in points]})

    def swipe(pause: float) -> None:
        x, y = page.project("/target", (0.2, 0.0, 0.0))  # Its arrow along x.
        touch("touchStart", (x, y))
        tab.wait_for_timeout(pause)
        for step in range(1, 7):
            touch("touchMove", (x + 8 * step, y - 4 * step))
            tab.wait_for_timeout(60)
        touch("touchEnd")

    target, before = page.state.goal.target, tab.evaluate(where)
    swipe(0)
    page.wait(lambda: np.abs(np.subtract(tab.evaluate(where), before)).max() > 0.05, "the camera to turn")
    assert page.state.goal.target.is_close(target, 0.0)
    reacting = "__viserMutable.scene.__r3f.root.getState().events.enabled"
    page.wait(lambda: tab.evaluate(reacting), "the scene to react to a mouse again")
    tab.get_by_role("button", name="View of the whole arm").click()
    page.wait(lambda: np.abs(np.subtract(tab.evaluate(where), before)).max() < 0.01, "the camera to come back")
    swipe(700)
    page.wait(lambda: not page.state.goal.target.is_close(target, 1e-3), "the target to follow")
    assert np.abs(np.subtract(tab.evaluate(where), before)).max() < 0.01, "not the camera"
    tab.mouse.move(5, 5)


def test_a_phone_has_the_scene_above_the_panel_with_status_stop_program_and_run(page):
    tab, size = page.tab, page.tab.viewport_size
    box = """name => { const box = document.querySelector(name).getBoundingClientRect();
        return [box.left, box.top, box.right, box.bottom]; }"""
    tab.set_viewport_size({"width": 390, "height": 844})
    try:
        tab.locator("#root .mantine-Paper-root").first.wait_for(state="visible")
        tab.wait_for_function(_FULL_WIDTH)
        left, top, right, bottom = tab.evaluate(box, "#root canvas[data-engine]")
        panel = tab.evaluate(box, '#root .mantine-Paper-root[style*="20em"]')
        assert (left, right) == (panel[0], panel[2]) == (0, 390)
        assert (bottom, panel[3]) == (panel[1], 844), "the panel below the scene"
        assert bottom - top > 300
        for name in ("#rl-stop", '.rl-chip[data-id="phase"]', "#rl-toolbar"):
            page.wait(lambda name=name: _is_inside(tab.evaluate(box, name)), f"{name} to be inside")
        for name in ("Program", "Run"):
            tab.get_by_role("tab", name=name).click()
            tab.wait_for_function(
                f"document.querySelector('[role=tab][aria-selected=true]').textContent.includes('{name}')"
            )
        assert page.button("Execute").is_visible()
        assert tab.evaluate("document.documentElement.scrollWidth") == 390
    finally:
        tab.set_viewport_size(size)
        page.wait_until_drawn()
        page.open_tab("Jog")


def _is_inside(edges: list[float]) -> bool:
    return 0 <= edges[0] < edges[2] <= 390


_FULL_WIDTH = """() => { const panel = document.querySelector('#root .mantine-Paper-root[style*="20em"]');
  return panel && panel.getBoundingClientRect().width === 390 && rcilabScene.canvas(); }"""
