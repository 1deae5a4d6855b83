"""The set-up as a person edits it: a typed tool, a dragged face of the safety box, undo."""

from __future__ import annotations

import numpy as np

from browser.page import BenchPage
from browser.test_settings import choose
from rcilab.app.setup.configuration_state import pending_parts
from rcilab.app.setup.setup_fields import faces


def test_a_tool_is_typed_the_controller_reports_it_and_the_box_is_dragged_and_taken_back(page: BenchPage):
    tab = page.tab
    page.open_tab("Setup")
    choose(page, "Part", "tool")
    page.group("rl-triples").locator("visible=true").locator(".mantine-TextInput-root input").nth(2).fill("120")
    page.wait(lambda: abs(page.state.setup.wanted.tool.position[2] - 0.12) < 1e-9, "the typed tool")
    page.wait(lambda: pending_parts(page.state, page.status) == (), "the controller to have it")
    page.wait(lambda: "The controller has: 0, 0, 120 mm" in tab.locator(".rl-setup").inner_text(), "the report")
    page.wait(lambda: page.shows("live", page.status.q), "the drawn tool where the model has it")

    choose(page, "Part", "safety box")
    before = faces(page.state.setup.wanted.box)
    page.wait(lambda: tab.evaluate("() => !!__viserMutable.nodeRefFromName['/safety_box/handle5']"), "the handles")
    x, y = page.project("/safety_box/handle5", (0, 0, 0))
    page.drag((x, y), (x, y - 60))
    page.wait(lambda: faces(page.state.setup.wanted.box)[5] > before[5] + 0.02, "the upper face to follow the mouse")
    assert np.allclose(faces(page.state.setup.wanted.box)[:5], before[:5])
    page.wait(lambda: pending_parts(page.state, page.status) == (), "the controller to have the box")
    page.button("Undo").click()
    page.wait(lambda: np.allclose(faces(page.state.setup.wanted.box), before), "the box as it was")
    page.wait(lambda: pending_parts(page.state, page.status) == (), "the controller to have the box as it was")
    page.button("Undo").click()
    page.wait(lambda: page.state.setup.wanted.tool.position[2] == 0.0, "the tool as it was")
    page.wait(lambda: page.button("Undo").is_disabled(), "nothing more to undo")
    choose(page, "Part", "choose …")
    page.wait(lambda: pending_parts(page.state, page.status) == (), "the controller to have the first set-up")
