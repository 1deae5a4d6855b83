"""A program of 3000 waypoints: what the page gets for a load, a selection, an edit and a scroll stays small."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rcilab.app.program.edit_actions import EditProgram, ShowRows
from rcilab.app.program.program_actions import LoadProgram
from rcilab.app.program.program_draft import Note
from rcilab.app.request import TypeField
from rcilab.app.text import Text
from rcilab.i18n.translator import Remark
from rcilab.motion import Program, Waypoint
from rcilab.workbench.panels.program import ProgramPanel
from rcilab.workbench.panels.program_list import LONGEST_WINDOW, notes_html, window_around
from tests.workbench.opened import opened, wait
from tests.workbench.test_program import MODEL, PLACE

COUNT = 3000
SMALL = 60_000  # [characters] Of the list; all rows take 900 000.
ANGLES = np.linspace(0.0, 40.0, COUNT)
POINTS = np.column_stack((0.45 + 0.1 * np.cos(ANGLES), 0.1 * np.sin(ANGLES), np.full(COUNT, 0.4)))
SPIRAL = Program(
    model=MODEL.name,
    start=MODEL.home,
    waypoints=tuple(
        Waypoint(type="line", position=tuple(point), wxyz=tuple(PLACE.wxyz.tolist())) for point in POINTS.tolist()
    ),
)


@given(st.integers(0, 4000), st.integers(1, 4000), st.integers(0, 3999))
def test_the_wanted_row_and_those_around_it_are_there_and_the_rows_stay_if_it_already_was(start, count, wanted):
    wanted = min(wanted, count - 1)
    window = window_around(range(start, start + LONGEST_WINDOW), count, wanted)
    assert len(window) == min(count, LONGEST_WINDOW)
    assert window.start >= 0
    assert window.stop <= count
    assert all(near in window for near in (max(wanted - 10, 0), wanted, min(wanted + 10, count - 1)))
    assert window_around(window, count, wanted) == window_around(window, count, None) == window


def test_the_page_gets_a_part_of_a_long_list_and_points_once():
    with opened() as bench:
        ask, state = bench.dispatcher.ask, lambda: bench.store.state
        panel = next(panel for panel in bench.renderer._panels if isinstance(panel, ProgramPanel))
        marks = bench.renderer._marks

        def rows() -> str:
            return panel._list._handle.content

        def has(number: int) -> bool:
            return f'data-index="{number - 1}"' in rows()

        ask(LoadProgram(name="spiral.json", content=SPIRAL.to_json().encode()))
        wait(lambda: has(1) and len(marks._clouds) == 2, "the list and the points")
        assert len(rows()) < SMALL
        cloud = marks._clouds[0]
        assert len(cloud.points) == COUNT
        keys = [step.key for step in state().program.draft.steps]
        ask(EditProgram(what="select", key=keys[10]))
        wait(lambda: f'data-key="{keys[10]}" data-index="10" aria-selected="true"' in rows(), "the selected row")
        assert has(1)
        assert len(rows()) < SMALL
        wait(lambda: marks._drawn[1] == keys[10], "the selected point")
        assert marks._clouds[0] is cloud
        assert np.allclose(marks._clouds[1].points, POINTS[10], atol=1e-6)
        ask(ShowRows(index=1500))
        wait(lambda: has(1501), "the rows that were scrolled to")
        assert not has(11)
        assert len(rows()) < SMALL
        ask(EditProgram(what="select", key=keys[-1]))
        wait(lambda: has(COUNT), "the last row")
        ask(ShowRows(index=0))
        wait(lambda: has(1), "the first row")
        ask(TypeField(field=f"program.{keys[-1]}.speed", text="37"))
        wait(lambda: has(COUNT) and ">37<" in rows(), "the edited row, in sight again")
        assert len(rows()) < SMALL


def test_thousands_of_notes_stay_short():
    notes = tuple(Note(Remark("", "blend", number=key, asked=0.01, radius=0.001), key) for key in range(1, COUNT))
    listed = notes_html(notes, Text("en"))
    assert f"{COUNT - 1} blends shortened" in listed
    assert len(listed) < SMALL


def test_a_short_list_is_whole():
    assert window_around(range(0), LONGEST_WINDOW, 3) == range(LONGEST_WINDOW)
