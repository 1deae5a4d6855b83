"""Links on the page: open at once on an empty one, after a question where they replace something, never on a robot."""

from __future__ import annotations

import time

import pytest

from rcilab.app.cell.cell_actions import EditCell
from rcilab.app.link.link_actions import AnswerLink, OpenLink
from rcilab.app.link.page_link import PageLink, encode_link
from rcilab.app.program.edit_actions import EditProgram
from rcilab.cell.cell import Cell
from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint
from rcilab.workbench.panels.status import status_values
from tests.workbench.opened import all_told, opened, told, wait
from tests.workbench.test_program import MODEL, SQUARE

OTHER = load_model("xMate3")
CELL = Cell.example("pick_place")
CIRCLE = Program(model=MODEL.name, start=MODEL.home, waypoints=(Waypoint.circle((0.4, 0.0, 0.4), (0.0, 0.0, 1.0)),))
ELSEWHERE = Program(model=OTHER.name, start=OTHER.home, waypoints=(Waypoint.joint(OTHER.home + 0.1),))


@pytest.fixture(scope="module")
def bench():
    with opened() as bench:
        yield bench


def link(program: Program, cell: Cell | None = None) -> OpenLink:
    return OpenLink(text=encode_link(PageLink(model=program.model, program=program, cell=cell)))


def waypoints(bench) -> tuple[Waypoint, ...]:
    return tuple(step.waypoint for step in bench.store.state.program.draft.steps)


def test_a_link_opens_and_asks_before_it_replaces_anything(bench):
    ask = bench.dispatcher.ask
    ask(link(SQUARE, CELL))
    wait(lambda: told(bench) == "link.opened", "the opened link")
    assert waypoints(bench) == SQUARE.waypoints
    assert bench.store.state.cell.cell.fingerprint == CELL.fingerprint
    assert bench.store.state.link is None
    ask(link(CIRCLE))
    wait(lambda: bench.store.state.link is not None, "the question")
    values = status_values(bench.store.state, bench.session.status(), bench.renderer._text, 0.0)
    assert "waypoints: 1" in values["question"]["text"]
    assert values["question"]["kind"] == "answerlink"
    assert waypoints(bench) == SQUARE.waypoints
    ask(AnswerLink(yes=False))
    wait(lambda: bench.store.state.link is None, "the answer")
    assert waypoints(bench) == SQUARE.waypoints
    ask(link(CIRCLE))
    ask(AnswerLink(page=None, yes=True))
    wait(lambda: waypoints(bench) == CIRCLE.waypoints, "the other program")
    assert bench.store.state.cell.cell is not None  # The link has none.
    ask(EditProgram(what="undo"))
    wait(lambda: waypoints(bench) == SQUARE.waypoints, "the program of before")
    ask(OpenLink(text="no link"))
    wait(lambda: "link_damaged" in str(bench.store.state.notice.text), "the problem")
    assert waypoints(bench) == SQUARE.waypoints


def test_a_link_for_another_arm_is_refused_at_an_address_and_sends_nothing_there(bench, monkeypatch):
    store = bench.store
    before = store.state
    opened_with: list[object] = []
    monkeypatch.setattr(bench.session, "open", lambda *args: opened_with.append(args))
    store.update(target="rci://192.0.2.1:1337")
    try:
        sent = bench.session.status().setup_times
        bench.dispatcher.ask(link(ELSEWHERE))
        wait(lambda: "link.other_arm" in all_told(bench), "the refusal")
        assert store.state.model.name == MODEL.name
        bench.dispatcher.ask(EditProgram(what="clear"))
        bench.dispatcher.ask(EditCell(what="clear"))
        bench.dispatcher.ask(link(SQUARE, CELL))
        wait(lambda: waypoints(bench) == SQUARE.waypoints, "the program of this arm")
        time.sleep(0.3)  # Some ticks, in which a virtual controller would get the tool of the cell.
        assert bench.session.status().setup_times == sent
        assert opened_with == []
    finally:
        store.update(target=before.target)


def test_a_link_for_another_arm_restarts_the_virtual_controller_after_a_question(bench):
    bench.dispatcher.ask(link(ELSEWHERE))
    wait(lambda: bench.store.state.link is not None, "the question")
    assert bench.store.state.model.name == MODEL.name
    bench.dispatcher.ask(AnswerLink(yes=True))
    wait(lambda: bench.store.state.model.name == OTHER.name, "the other arm")
    wait(lambda: waypoints(bench) == ELSEWHERE.waypoints, "its program")
    wait(lambda: bench.session.status().phase == "idle", "a ready arm")
