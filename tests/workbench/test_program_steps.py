"""Steps of a program on the page besides waypoints: they are inserted, typed, kept together and described."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.app.cell.cell_state import CellState
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.new_steps import NEW_STEPS
from rcilab.app.program.program_actions import PlanProgram
from rcilab.app.program.program_draft import describe_step, number_at, time_at
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.run.world_actions import SetVirtualInput
from rcilab.app.text import Text
from rcilab.cell.cell import Cell
from rcilab.workbench.panels.outcome import progress_html
from rcilab.workbench.panels.program_list import list_html
from tests.workbench.opened import opened, wait
from tests.workbench.test_program import MODEL, SQUARE, Bench


@pytest.fixture
def bench() -> Bench:
    """The square, its second waypoint selected, in a cell with signals."""
    made = Bench()
    made.load(SQUARE)
    made.store.update(cell=CellState(cell=Cell.example("pick_place")))
    made.edit("select", key=made.program.draft.steps[1].key)
    return made


def kinds(bench: Bench) -> list[str]:
    return [step.waypoint.type for step in bench.program.draft.steps]


def chosen(bench: Bench):
    return bench.program.draft.waypoint(bench.program.selected)


def test_every_step_can_be_inserted_and_is_described_in_both_languages(bench):
    for kind in NEW_STEPS:
        before = kinds(bench)
        bench.edit("insert", type=kind)
        assert len(kinds(bench)) > len(before)
        bench.edit("undo")
        assert kinds(bench) == before
        bench.edit("redo")
        made = chosen(bench)
        for language in ("en", "zh"):
            assert "{" not in Text(language).render(describe_step(made))
        bench.edit("undo")
    bench.edit("insert", type="input")
    assert chosen(bench).signal == "part in tray"
    assert Text("en").render(describe_step(chosen(bench))) == "until part in tray is on, at most 10 s"
    assert "until part in tray" in list_html(bench.state, bench.program.draft, None, Text("en"))


def test_fields_of_a_step_are_typed_and_chosen_and_what_is_wrong_is_said(bench):
    bench.edit("insert", type="input")
    assert bench.type("timeout", "2.5") is None
    assert bench.type("signal", "3") is None
    assert (chosen(bench).timeout, chosen(bench).signal) == (2.5, 3)
    assert bench.type("timeout", "1e9") is not None
    assert bench.type("signal", " ") is not None
    bench.edit("choose", name="level", value="off")
    assert chosen(bench).level is False
    bench.edit("insert", type="repeat")
    assert bench.type("count", "2.5") is not None
    assert bench.type("count", "4") is None
    assert bench.type("signal", "part in tray") is None
    assert bench.type("text", "pick") is None
    assert (chosen(bench).count, chosen(bench).signal, chosen(bench).text) == (4, "part in tray", "pick")
    assert bench.type("signal", "") is None
    assert (chosen(bench).signal, chosen(bench).level) == (None, None)
    bench.edit("insert", type="circle")
    assert bench.type("center_x", "512.5") is None
    assert bench.type("angle", "90") is None
    assert (chosen(bench).center[0], chosen(bench).angle) == (0.5125, pytest.approx(np.pi / 2))
    bench.edit("select", key=bench.program.draft.steps[0].key)
    assert bench.type("approach", "40") is None
    assert chosen(bench).approach == 0.04
    assert bench.type("approach", "0") is None
    assert chosen(bench).approach is None


def test_a_block_goes_around_the_selected_step_and_keeps_its_two_ends(bench):
    before = kinds(bench)
    bench.edit("insert", type="repeat")
    assert kinds(bench) == [before[0], "repeat", before[1], "end", *before[2:]]
    assert bench.program.draft.depths[:4] == (0, 0, 1, 0)
    bench.edit("duplicate")
    assert kinds(bench)[1:7] == ["repeat", before[1], "end"] * 2
    bench.edit("delete")
    assert kinds(bench)[1:5] == ["repeat", before[1], "end", before[1]]
    bench.edit("undo")
    bench.edit("undo")
    bench.edit("select", key=bench.program.draft.steps[3].key)
    bench.edit("delete")  # An end, with the begin that belongs to it.
    assert kinds(bench) == before


def test_the_page_waits_for_an_input_that_a_button_switches():
    with opened() as page:
        ask, state, status = page.dispatcher.ask, lambda: page.store.state, page.session.status
        wait(lambda: status().phase == "idle" and status().q_c is not None, "the arm")
        ask(EditProgram(what="add"))
        for kind in ("output", "input", "retreat"):
            ask(EditProgram(what="insert", type=kind))
        wait(lambda: len(state().program.draft.steps) == 4, "the steps")
        ask(PlanProgram())
        wait(lambda: state().plan is not None and state().plan.program is not None, "the plan")
        plan = state().plan
        assert plan.steps == (1, 3, 4)
        assert number_at(plan, time_at(plan, 4)) == 4
        wait(lambda: status().powered, "the power")
        ask(RobotCommand(what="execute"))
        wait(lambda: status().awaited == 0, "the wait")
        wait(lambda: status().outputs[0] is True, "the output")
        assert "Waiting for input DI0_0" in progress_html(state(), status(), Text("en"))
        ask(SetVirtualInput(signal=0, level=True))
        wait(lambda: status().code == "idle.arrived", "the end")
        goal = plan.motion.goal
        wait(lambda: np.allclose(status().q_c, goal, atol=1e-6), "the goal")
        wait(lambda: state().last_run is not None, "the run")
        run = state().last_run.run
        assert run.plan.duration > plan.motion.duration
        assert MODEL.name == run.model.name


def select(bench: Bench, *numbers: int) -> None:
    keys = [step.key for step in bench.program.draft.steps]
    bench.edit("select", key=keys[numbers[0] - 1])
    for number in numbers[1:]:
        bench.edit("toggle", key=keys[number - 1])


def selected(bench: Bench) -> list[int]:
    keys = [step.key for step in bench.program.draft.steps]
    return [keys.index(key) + 1 for key in bench.program.draft.chosen(bench.program.selected, bench.program.marked)]


def test_several_steps_are_selected_edited_moved_copied_and_deleted_as_one(bench):
    bench.load(SQUARE)
    before = bench.program.draft
    select(bench, 1, 3)
    assert selected(bench) == [1, 3]
    assert bench.type("speed", "7.5") is None
    speeds = [step.waypoint.speed for step in bench.program.draft.steps]
    assert (speeds[0], speeds[2]) == (0.075, 0.075)
    assert speeds[1] == before.steps[1].waypoint.speed
    assert selected(bench) == [1, 3]
    bench.edit("undo")
    assert bench.program.draft is before
    select(bench, 1, 2)
    bench.edit("down")
    assert [step.key for step in bench.program.draft.steps[:3]] == [before.steps[k].key for k in (2, 0, 1)]
    assert selected(bench) == [2, 3]
    bench.edit("copy")
    bench.edit("paste")
    assert kinds(bench)[3:5] == [before.steps[k].waypoint.type for k in (0, 1)]
    assert selected(bench) == [4, 5]
    bench.edit("delete")
    assert len(bench.program.draft.steps) == len(before.steps)
    bench.edit("extend", key=bench.program.draft.steps[0].key)
    bench.edit("cut")
    bench.edit("undo")
    bench.edit("all")
    assert len(selected(bench)) == len(before.steps)
    bench.edit("insert", type="group")
    assert kinds(bench)[0] == "group"
    assert kinds(bench)[-1] == "end"
    listed = list_html(bench.state, bench.program.draft, None, Text("en"))
    assert listed.count("rl-marked") == 0


def test_steps_are_found_by_what_they_are(bench):
    bench.edit("insert", type="input")
    bench.edit("insert", type="comment")
    assert bench.type("text", "Deburr the edge") is None
    bench.edit("select", key=bench.program.draft.steps[0].key)
    for typed, number in (("deburr", 4), ("part in", 3), ("2", 2), ("input", 3)):
        assert bench.type("find", typed, key=0) is None
        assert selected(bench) == [number]
    assert bench.type("find", "lathe", key=0) == "program.not_found"
