"""Paths on the page without a browser: import with undo, in the right frame, and points drawn on surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.app.cell.cell_state import CellState
from rcilab.app.program.path_actions import DrawPath, ImportPath, SetPath
from rcilab.app.program.path_state import BLEND_FIELD, PATH_FIELD, frame_of_paths
from rcilab.app.program.program_draft import placed
from rcilab.app.request import TypeField
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Frame, Obstacle
from rcilab.cell.shapes import Box
from rcilab.core.spatial import Pose
from tests.workbench.test_program import MODEL, SQUARE, Bench

SQUARE_NC = b"M3\nG0 X-50 Y-50 Z5\nG1 X50 F1200\nY50\nX-50\nY-50\n"
TRAY = Pose((0.5, 0.0, 0.3))


@pytest.fixture
def bench() -> Bench:
    """A cell with a tray, whose top is a workpiece."""
    made = Bench()
    top = Obstacle(name="top", shape=Box(size=(0.3, 0.3, 0.02)), pose=Pose((0.0, 0.0, -0.01)), frame="tray")
    frame = Frame(name="tray", T_parent_frame=TRAY)
    made.store.update(cell=CellState(cell=Cell(model=MODEL.name, frames=(frame,), obstacles=(top,), workpiece="top")))
    return made


def load(bench: Bench, content: bytes = SQUARE_NC, name: str = "square.nc") -> None:
    bench.actions.paths.load(ImportPath(name=name, content=content))


def draw(bench: Bench, what, **values) -> None:
    bench.actions.paths.draw(DrawPath(what=what, **values))


def test_an_import_replaces_the_program_in_the_frame_of_the_workpiece_and_undo_brings_it_back(bench):
    bench.load(SQUARE)
    before = bench.program.draft
    bench.actions.paths.type_field(TypeField(field=BLEND_FIELD, text="5"))
    load(bench)
    draft = bench.program.draft
    assert draft.name == "square"
    assert bench.types == ["joint", "line", "line", "line", "line"]
    assert {step.waypoint.frame for step in draft.steps} == {"tray"}
    assert [step.waypoint.blend for step in draft.steps] == [0.005, 0.005, 0.005, 0.005, 0.0]
    assert np.allclose(placed(draft, bench.state.cell.cell).steps[0].waypoint.position, (0.45, -0.05, 0.305))
    assert bench.told == "path.loaded"
    assert [note.code for note in bench.state.paths.notes] == ["path_ignored"]
    bench.plan()
    assert (
        bench.state.plan.report.violations == ()
        or bench.state.plan.report.violations[0].condition.id == "clearance.cell"
    )
    bench.edit("undo")
    assert bench.program.draft is before


def test_an_import_can_be_added_after_the_selected_waypoint_in_its_frame(bench):
    bench.store.update(cell=replace(bench.state.cell, cell=replace(bench.state.cell.cell, workpiece="")))
    bench.load(SQUARE)
    assert frame_of_paths(bench.state) is None
    first, second, third = (step.key for step in bench.program.draft.steps)
    bench.edit("select", key=second)
    bench.edit("frame", frame="tray")
    bench.actions.paths.set_path(SetPath(appends=True))
    load(bench)
    keys = [step.key for step in bench.program.draft.steps]
    assert (keys[:2], keys[-1], len(keys)) == ([first, second], third, 8)
    assert bench.program.draft.steps[2].waypoint.frame == "tray"
    assert bench.program.selected == keys[6]
    assert bench.program.draft.name == "square"


def test_a_bad_file_and_too_many_waypoints_are_answered_next_to_the_button_and_change_nothing(bench):
    bench.load(SQUARE)
    before = bench.program.draft
    load(bench, b"G1 X1 Y1 Z1\nG41")
    assert bench.state.problems[PATH_FIELD].code == "program.file_bad"
    assert bench.program.draft is before
    bench.actions.paths.set_path(SetPath(appends=True))
    load(bench, "".join(f"G1 X{i * 0.001:.3f} Y0 Z0\n" for i in range(9_999)).encode())
    assert bench.program.draft is before
    bench.actions.paths.type_field(TypeField(field=BLEND_FIELD, text="-1"))
    assert bench.state.problems[BLEND_FIELD].code == "parse.range"
    load(bench)
    assert PATH_FIELD not in bench.state.problems


def test_clicks_on_surfaces_become_lines_with_the_tool_against_them_as_one_step_for_undo(bench):
    draw(bench, "toggle")
    for x, y in ((0.45, -0.05), (0.55, -0.05), (0.55, 0.05)):
        draw(bench, "point", eye=(x, y, 2.0), ray=(0.0, 0.0, -1.0))
    draw(bench, "point", eye=(0.0, 0.0, 2.0), ray=(0.0, 0.0, 1.0))
    assert bench.told == "path.miss"
    assert len(bench.state.paths.drawing) == 3
    assert bench.types == []
    draw(bench, "end")
    assert bench.state.paths.drawing is None
    assert bench.types == ["joint", "line", "line"]
    assert {step.waypoint.frame for step in bench.program.draft.steps} == {"tray"}
    in_base = placed(bench.program.draft, bench.state.cell.cell).steps[2].waypoint.pose
    assert np.allclose(in_base.position, (0.55, 0.05, 0.3))
    assert np.allclose(in_base.rotation[:, 2], (0.0, 0.0, -1.0))
    bench.edit("undo")
    assert bench.types == []


def test_a_dropped_or_empty_drawing_changes_nothing(bench):
    bench.load(SQUARE)
    before = bench.program.draft
    draw(bench, "toggle")
    draw(bench, "point", eye=(0.5, 0.0, 2.0), ray=(0.0, 0.0, -1.0))
    draw(bench, "cancel")
    draw(bench, "toggle")
    draw(bench, "toggle")
    draw(bench, "point", eye=(0.5, 0.0, 2.0), ray=(0.0, 0.0, -1.0))
    assert bench.program.draft is before
    assert bench.state.paths.drawing is None
