"""The cell as a person builds it: an obstacle added, dragged into the way, typed out of it, chosen and deleted."""

from __future__ import annotations

import numpy as np

from browser.page import BenchPage
from rcilab.app.cell.cell_actions import EditCell


def test_an_obstacle_is_added_dragged_into_the_way_typed_out_of_it_and_deleted(page: BenchPage):
    tab = page.tab
    page.plan_to(0, 60.0)
    page.open_tab("Cell")
    page.button("Sphere").click()
    page.wait(lambda: page.state.cell.cell is not None, "the sphere")
    page.wait(lambda: page.is_drawn("/cell/obstacle0"), "the drawn sphere")
    plan = page.state.plan
    place = page.state.model.forward(plan.motion.at(0.5 * plan.motion.duration).q).position
    fields = page.group("rl-trios").locator("visible=true").locator(".mantine-TextInput-root input")
    page.wait(lambda: fields.count() == 7, "the fields of a sphere")
    for number, coordinate in enumerate(place):
        fields.nth(number).fill(f"{1000.0 * coordinate:.1f}")
        fields.nth(number).press("Enter")
    page.wait(lambda: not page.state.plan.report.ok, "the plan to be refused")
    page.wait(lambda: "Sphere" in tab.locator(".rl-verdict.rl-bad").first.inner_text(), "the obstacle in the verdict")
    assert tab.locator(".rl-entry em").count() == 1
    x, y = page.project("/cell_handles", (0.0, 0.0, 0.2))
    before = page.state.cell.cell.obstacles[0].pose.position
    page.drag((x, y), (x, y - 80))
    page.wait(lambda: page.state.cell.cell.obstacles[0].pose.position[2] > before[2] + 0.02, "the sphere to follow")
    page.button("Undo").click()
    page.wait(lambda: np.allclose(page.state.cell.cell.obstacles[0].pose.position, before), "the drag taken back")
    fields.nth(0).fill("-900")
    fields.nth(0).press("Enter")
    page.wait(lambda: page.state.plan.report.ok, "the plan to be safe again")
    row = tab.locator("[data-entry]").first
    row.focus()
    row.press("Enter")
    page.wait(lambda: page.state.cell.selected is not None, "the chosen entry")
    page.button("Delete").click()
    page.wait(lambda: page.state.cell.cell.obstacles == (), "the sphere to be gone")
    tab.locator(".rl-steps-none", has_text="Nothing stands").wait_for(state="visible")
    page.bench.dispatcher.ask(EditCell(what="clear"))
    page.wait(lambda: page.state.cell.cell is None, "the end")
