"""Write a program as a person: add, choose by keys, type, plan, save, load, look at it as Python."""

from __future__ import annotations

import json

import numpy as np
import pytest

from browser.test_settings import choose
from rcilab.app.cell.cell_actions import EditCell
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import LoadProgram
from rcilab.app.view_actions import SetView
from rcilab.motion import Program, Waypoint


@pytest.fixture
def writing(page):
    """The Program tab with two waypoints, added by hand."""
    page.bench.dispatcher.ask(EditProgram(what="clear"))
    page.type_joint(1, "12")
    page.wait(lambda: page.state.plan is not None, "a target to add")
    page.open_tab("Program")
    page.wait(lambda: page.tab.get_by_text("No waypoints yet").is_visible(), "an empty program")
    page.button("Add from target").click()
    page.button("Add from arm").click()
    page.wait(lambda: page.tab.get_by_role("option").count() == 2, "two rows")
    yield page
    page.bench.dispatcher.ask(EditProgram(what="clear"))
    page.bench.dispatcher.ask(SetView(name="loop", value=False))


def field(page, name: str):
    """A text box of the editor by its label."""
    label = page.tab.locator("label:visible", has_text=name).first
    return label.locator("xpath=ancestor::div[contains(@class,'Flex-root')][1]").locator("input").first


def test_a_program_is_written_by_keyboard_planned_saved_and_loaded(writing, tmp_path):
    page, steps = writing, lambda: writing.state.program.draft.steps
    first, second = (step.key for step in steps())
    page.tab.get_by_role("option").first.click()
    page.wait(lambda: page.state.program.selected == first, "the clicked row to be selected")
    page.tab.keyboard.press("ArrowDown")
    page.wait(lambda: page.state.program.selected == second, "the row below")
    page.tab.keyboard.press("Alt+ArrowUp")
    page.wait(lambda: steps()[0].key == second, "the row to have moved up")
    page.tab.keyboard.press("Control+z")
    page.wait(lambda: steps()[0].key == first, "undo, with the focus still in the list")
    choose(page, "Type", "MoveL")
    page.wait(lambda: steps()[1].waypoint.type == "line", "a line")
    field(page, "Speed [%]").fill("150")
    page.wait(lambda: any("outside" in text for text in page.alerts()), "an answer beside the field")
    field(page, "Speed [%]").fill("40")
    page.wait(lambda: steps()[1].waypoint.speed == 0.4 and page.alerts() == [], "40 %")
    page.button("Plan all").click()
    page.wait(lambda: page.state.plan is not None and page.state.plan.program is not None, "the program's plan")
    field(page, "Blend").fill("-5")
    page.wait(lambda: any("-5 is outside" in text for text in page.alerts()), "why it is not taken")
    assert page.tab.locator(".rl-problem").is_visible()
    assert page.tab.get_by_text("The number was not accepted").is_visible()
    assert page.tab.locator("[role=tabpanel]").get_by_text("Passed").locator("visible=true").count() == 0
    field(page, "Blend").fill("0")
    page.wait(lambda: page.alerts() == [], "the verdict again")
    page.wait(lambda: page.tab.get_by_text("to waypoint 1 of 2, MoveJ").first.is_visible(), "the segment's name")
    with page.tab.expect_download() as coming:
        page.button("Save").click()
    file = tmp_path / "saved.json"
    coming.value.save_as(file)
    assert Program.load(file) == page.state.plan.program
    bad = tmp_path / "bad.json"
    bad.write_text(json.dumps({**json.loads(file.read_text()), "start": [0.0]}))
    for path in (bad, file):
        with page.tab.expect_file_chooser() as choosing:
            page.button("Load").click()
        choosing.value.set_files(path)
        if path is bad:
            page.wait(lambda: any("bad.json, line" in text for text in page.alerts()), "the line that is wrong")
            assert sum("bad.json" in text for text in page.alerts()) == 1, "said once, beside the button"
            assert "bad.json" not in page.toast()
            assert page.tab.get_by_text("Uploading", exact=False).locator("visible=true").count() == 0
            assert len(steps()) == 2
    page.wait(lambda: page.state.program.selected not in (first, second), "the saved program back")
    page.wait(lambda: page.alerts() == [], "no complaint any more")
    page.button("Show as Python").click()
    page.wait(
        lambda: "rcilab.plan_program(model, program, law=" in page.tab.locator(".rl-code pre").inner_text(), "a script"
    )


def test_a_waypoint_of_a_file_has_its_own_type_in_the_editor(writing):
    page, home = writing, writing.state.model.home
    program = Program(model=page.state.model.name, start=home, waypoints=(Waypoint.nullspace(0.3),))
    page.bench.dispatcher.ask(LoadProgram(name="elbow.json", content=program.to_json().encode()))
    page.wait(lambda: len(page.state.program.draft.steps) == 1, "the program")
    page.wait(lambda: field(page, "Type").input_value() == "Elbow", "the type that the list shows")
    assert field(page, "Type").is_disabled()
    page.bench.dispatcher.ask(EditProgram(what="add", source="here"))
    page.wait(lambda: len(page.state.program.draft.steps) == 2, "a new waypoint")
    assert page.state.program.draft.steps[1].waypoint.type == "line"  # It goes on as a path of the tool.
    page.wait(lambda: field(page, "Type").input_value() == "MoveL", "the type of the new waypoint")
    page.wait(lambda: not field(page, "Type").is_disabled(), "a type that can be changed")


def test_a_waypoint_is_expressed_in_a_frame_of_the_cell(writing):
    page, steps = writing, lambda: writing.state.program.draft.steps
    assert page.tab.locator("label:visible", has_text="Frame").count() == 0
    page.bench.dispatcher.ask(EditCell(what="add", name="frame"))
    page.wait(lambda: page.tab.locator("label:visible", has_text="Frame").count() == 1, "the choice of a frame")
    selected = [step.key for step in steps()].index(page.state.program.selected)
    here = page.state.model.forward(np.array(steps()[selected].waypoint.q)).position
    page.tab.get_by_label("Frame", exact=True).locator("visible=true").first.click()
    page.tab.get_by_role("option", name="Frame", exact=True).locator("visible=true").click()
    page.wait(lambda: steps()[selected].waypoint.frame == "Frame", "the waypoint in the frame")
    T = page.state.cell.cell.T_base("Frame")
    assert np.allclose(T @ np.array(steps()[selected].waypoint.position), here)
    x = 1000.0 * steps()[selected].waypoint.position[0]
    page.wait(lambda: abs(float(field(page, "x").input_value()) - x) < 0.1, "its number in the frame")
    page.bench.dispatcher.ask(EditCell(what="clear"))
    page.tab.get_by_text("The cell has no frame Frame").first.wait_for(state="visible")
    page.wait(lambda: field(page, "Frame").input_value() == "Frame", "the missing frame")


def test_a_path_is_imported_and_another_one_drawn_by_clicks_on_the_floor(writing, tmp_path):
    page, steps = writing, lambda: writing.state.program.draft.steps
    file = tmp_path / "square.nc"
    file.write_text("G0 X450 Y-50 Z400\nG1 X550 F1200\nY50\nX450\nY-50\n")
    with page.tab.expect_file_chooser() as choosing:
        page.button("Import path").click()
    choosing.value.set_files(file)
    page.wait(lambda: len(steps()) == 5, "the imported path")
    page.wait(lambda: page.tab.get_by_role("option").count() == 5, "its rows")
    page.button("Draw path").click()
    page.wait(lambda: page.state.paths.drawing == (), "the drawing")
    page.button("End the path").wait_for(state="visible")
    floor = np.array(((0.5, -0.3, 0.0), (0.6, -0.35, 0.0)))
    for number, place in enumerate(floor, 1):
        page.tab.mouse.click(*page.project("/live", tuple(place.tolist())))
        page.wait(lambda number=number: len(page.state.paths.drawing) == number, "a point where it was clicked")
    found = np.array([point.position for point in page.state.paths.drawing])
    assert np.abs(found - floor).max() < 0.02
    page.tab.keyboard.press("Enter")
    page.wait(lambda: len(steps()) == 7, "the drawn lines")
    assert steps()[-1].waypoint.type == "line"
    page.button("Draw path").click()
    page.tab.locator("html[data-rl-drawing]").wait_for()
    page.tab.keyboard.press("Escape")
    page.wait(lambda: page.state.paths.drawing is None, "no drawing")
    assert len(steps()) == 7


def test_a_long_program_is_scrolled_and_walked_through_by_keys(writing):
    page, count = writing, 600
    waypoints = [Waypoint.joint(page.state.model.home, speed=0.001 * (1 + number)) for number in range(count)]
    program = Program(model=page.state.model.name, start=page.state.model.home, waypoints=tuple(waypoints))
    page.bench.dispatcher.ask(LoadProgram(name="long.json", content=program.to_json().encode()))
    page.wait(lambda: len(page.state.program.draft.steps) == count, "the program")
    rows = page.tab.locator(".rl-steps")
    keys = [step.key for step in page.state.program.draft.steps]

    def sees(number: int) -> bool:
        row = page.tab.locator(f"#rl-step-{keys[number - 1]}")
        if not row.count():
            return False
        inner, outer = row.bounding_box(), rows.bounding_box()
        return inner is not None and outer["y"] - 1 <= inner["y"] <= outer["y"] + outer["height"]

    page.wait(lambda: sees(1), "the first row")
    assert page.tab.get_by_role("option").count() < 200
    rows.evaluate("(list) => { list.scrollTop = 25 * 300; }")
    page.wait(lambda: sees(305), "the rows that were scrolled to")
    page.tab.locator(f"#rl-step-{keys[304]}").click()
    page.wait(lambda: page.state.program.selected == keys[304], "the clicked row")
    page.tab.keyboard.press("ArrowDown")
    page.wait(lambda: page.state.program.selected == keys[305] and sees(306), "the row below")
    page.tab.keyboard.press("End")
    page.wait(lambda: page.state.program.selected == keys[-1] and sees(count), "the last row")
    page.tab.keyboard.press("ArrowUp")
    page.wait(lambda: page.state.program.selected == keys[-2], "the row above")
    page.tab.keyboard.press("Home")
    page.wait(lambda: page.state.program.selected == keys[0] and sees(1), "the first row again")
