"""One history of everything on the page: target, program, cell and setup are undone in the order of their edits."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from rcilab.app.cell.cell_actions import EditCell
from rcilab.app.edit_history import TurnBack
from rcilab.app.edit_order import EditOrder
from rcilab.app.goal.goal_actions import MoveJoint
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.request import TypeField
from rcilab.app.text import Text
from rcilab.workbench.app import Workbench
from rcilab.workbench.panels.status import status_values
from tests.workbench.opened import opened, wait


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as found:
        wait(lambda: found.session.status().q_c is not None, "the arm")
        yield found


def test_edits_of_all_sorts_are_undone_and_repeated_in_their_order(bench: Workbench) -> None:
    ask, state = bench.dispatcher.ask, lambda: bench.store.state
    assert state().turns == (False, False)
    ask(MoveJoint(joint=0, angle=0.3))
    wait(lambda: state().goal.q[0] == 0.3, "the target")
    ask(EditProgram(what="add"))
    wait(lambda: len(state().program.draft.steps) == 1, "the step")
    ask(EditCell(what="add", name="box"))
    wait(lambda: state().cell.cell is not None, "the box")
    ask(TypeField(field="setup.tool.z", text="120"))
    wait(lambda: state().model.T_flange_tool.position[2] == pytest.approx(0.12), "the tool")
    wait(lambda: state().turns == (True, False), "the order")
    ask(TurnBack(what="undo"))
    wait(lambda: state().model.T_flange_tool.position[2] == 0.0, "the tool as before")
    ask(TurnBack(what="undo"))
    wait(lambda: state().cell.cell is None or not state().cell.cell.obstacles, "no box")
    ask(TurnBack(what="redo"))
    wait(lambda: state().cell.cell is not None and len(state().cell.cell.obstacles) == 1, "the box again")
    ask(EditProgram(what="undo"))  # By its own button: the order follows.
    wait(lambda: not state().program.draft.steps, "no step")
    ask(TurnBack(what="redo"))
    wait(lambda: len(state().program.draft.steps) == 1, "the step again")
    for _ in range(2):
        ask(TurnBack(what="undo"))
    wait(lambda: not state().program.draft.steps, "no step again")
    assert bench.store.order.last(state().model.name) is None  # Another tool forgets the goals of the one before.
    second = state().goal.q[1]
    ask(MoveJoint(joint=1, angle=0.1))
    wait(lambda: state().goal.q[1] == 0.1, "the target")
    ask(TurnBack(what="undo"))
    wait(lambda: state().goal.q[1] == second, "the target before")
    ask(TurnBack(what="redo"))
    wait(lambda: state().goal.q[1] == 0.1, "the target again")
    ask(TurnBack(what="undo"))
    ask(TurnBack(what="undo"))
    wait(lambda: bench.store.state.notices[-1].text.code == "edit.nothing_undo", "the end of the history")
    wait(lambda: state().turns == (False, True), "the order")
    bar = status_values(state(), bench.session.status(), Text("zh"), 1.0)["history"]
    assert bar == {"undo": "撤回上一次编辑", "redo": "恢复撤回的编辑", "can": {"undo": False, "redo": True}}


def test_each_arm_has_its_own_order_and_a_new_edit_ends_what_could_be_repeated() -> None:
    order = EditOrder()
    order.add("goal", "a")
    order.add("program", "b")
    order.add("cell", "a")
    assert (order.last("a"), order.last("b"), order.next("a")) == ("cell", "program", None)
    order.undone("cell", "a")
    assert (order.last("a"), order.next("a")) == ("goal", "cell")
    order.undone("program", "b")
    order.add("setup", "a")
    assert (order.next("a"), order.next("b")) == (None, "program")
    order.forget("goal", "a")
    order.undone("setup", "a")
    assert order.last("a") is None
