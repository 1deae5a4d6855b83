"""Waypoints in frames of the cell on the page: they stay where they are, follow the frame, and are planned again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rcilab.app.cell.cell_actions import EditCell, MoveEntry
from rcilab.app.cell.cell_state import CellState
from rcilab.app.check.freshness import outdated
from rcilab.app.check.slowdown_job import slow_program
from rcilab.app.goal.goal_actions import MoveTarget
from rcilab.app.planning import moved_frames
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import LoadProgram, PlanProgram
from rcilab.app.program.program_draft import placed, target_in_base
from rcilab.app.request import TypeField
from rcilab.app.run.readiness import obstacle
from rcilab.app.text import Text
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Frame
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import message
from rcilab.motion import Program, Waypoint
from rcilab.workbench.panels.program_list import list_html
from rcilab.workbench.panels.waypoint import WaypointPanel
from tests.workbench.opened import opened, wait
from tests.workbench.test_program import MODEL, PLACE, SQUARE, STANDING, Bench, beside

TRAY = Pose.from_rpy((0.4, -0.1, 0.2), (0.0, 0.0, 0.8))
STEP = Pose((0.02, -0.03, 0.01))


def cell(T_base_tray: Pose, name: str = "tray") -> CellState:
    return CellState(cell=Cell(model=MODEL.name, frames=(Frame(name=name, T_parent_frame=T_base_tray),)))


@pytest.fixture
def bench() -> Bench:
    """The square, its second waypoint selected, in a cell with a tray."""
    made = Bench()
    made.load(SQUARE)
    made.store.update(cell=cell(TRAY))
    made.edit("select", key=made.program.draft.steps[1].key)
    return made


def chosen(bench: Bench) -> Waypoint:
    waypoint = bench.program.draft.waypoint(bench.program.selected)
    assert waypoint is not None
    return waypoint


def where(bench: Bench) -> Pose:
    """Where the selected waypoint is in the scene."""
    waypoint = placed(bench.program.draft, bench.state.cell.cell).waypoint(bench.program.selected)
    assert waypoint is not None
    target = target_in_base(waypoint, MODEL)
    assert target is not None
    return target


def test_another_frame_leaves_the_waypoint_where_it_is_and_undo_takes_it_back(bench):
    before = chosen(bench)
    bench.edit("frame", frame="tray")
    assert chosen(bench).frame == "tray"
    assert where(bench).is_close(before.pose)
    assert bench.type("x", "300") is None
    assert chosen(bench).position[0] == 0.3
    assert (TRAY.inverse() @ where(bench)).position[0] == pytest.approx(0.3)
    bench.edit("frame", frame=None)
    assert chosen(bench).frame is None
    assert (TRAY.inverse() @ chosen(bench).pose).position[0] == pytest.approx(0.3)
    for _ in range(3):
        bench.edit("undo")
    assert chosen(bench) is before
    bench.edit("frame", frame="shelf")
    assert chosen(bench) is before


def test_taught_points_keep_the_frame(bench):
    bench.edit("frame", key=bench.program.draft.steps[0].key, frame="tray")  # Its joint angles become a pose.
    assert bench.program.draft.steps[0].waypoint.frame == "tray"
    bench.edit("frame", frame="tray")
    bench.edit("type", type="arc")
    assert (chosen(bench).frame, chosen(bench).type) == ("tray", "arc")
    bench.goal.move_target(MoveTarget(position=tuple(beside(0.03, 0.05, 0.02).position), wxyz=tuple(PLACE.wxyz)))
    bench.edit("via", source="target")
    assert np.allclose(TRAY @ np.array(chosen(bench).via), beside(0.03, 0.05, 0.02).position)
    bench.goal.move_target(MoveTarget(position=tuple(beside(0.0, 0.12, 0.0).position), wxyz=tuple(PLACE.wxyz)))
    bench.edit("teach", source="target")
    assert chosen(bench).frame == "tray"
    assert where(bench).is_close(bench.state.goal.target)
    bench.edit("aim")
    assert bench.state.goal.target.is_close(where(bench))
    bench.plan()
    assert bench.state.plan.program.frames == ()


def test_a_frame_that_moves_outdates_the_plan_which_then_follows_it(bench):
    bench.edit("frame", frame="tray")
    bench.plan()
    before, text = bench.state.plan, Text("en")
    assert outdated(bench.state) is None
    listed = list_html(bench.state, placed(bench.program.draft, bench.state.cell.cell), None, text)
    bench.store.update(cell=cell(STEP @ TRAY))
    assert "before these frames were moved or removed: tray." in text.render(outdated(bench.state))
    assert "坐标系被移动或删除：tray。" in Text("zh").render(outdated(bench.state))
    assert obstacle(bench.state, replace(STANDING, powered=True)).code == "ready.frames"
    assert list_html(bench.state, placed(bench.program.draft, bench.state.cell.cell), None, text) != listed
    bench.plan()
    assert outdated(bench.state) is None
    after = bench.state.plan
    ends = [MODEL.forward(plan.motion.at(plan.motion.segment_starts[2]).q).position for plan in (before, after)]
    assert np.allclose(ends[1] - ends[0], STEP.position, rtol=0.0, atol=2e-3)  # The corner is rounded.
    assert moved_frames(after, cell(STEP @ TRAY).cell) == ()
    assert moved_frames(after, None) == ("tray",)


def test_a_missing_frame_is_named_and_not_planned_until_there_is_another(bench):
    bench.edit("frame", frame="tray")
    numbers = chosen(bench).position
    bench.store.update(cell=cell(TRAY, name="shelf"))
    bench.actions.plan(PlanProgram())
    assert bench.program.progress is None
    assert bench.state.notice.text.code == "plan.failed"
    assert "the cell has no frame tray; there are: world, shelf" in Text("en").render(bench.state.notice.text)
    listed = list_html(bench.state, placed(bench.program.draft, bench.state.cell.cell), None, Text("en"))
    assert "The cell has no frame tray" in listed
    for what in ("teach", "aim"):
        bench.edit(what, source="target")
        assert bench.told == "program.frame_missing"
    bench.edit("frame", frame="shelf")
    assert (chosen(bench).frame, chosen(bench).position) == ("shelf", numbers)
    bench.plan()
    assert outdated(bench.state) is None


def test_why_a_program_failed_is_not_said_once_the_frame_is_elsewhere(bench):
    bench.edit("frame", frame="tray")
    bench.store.update(cell=cell(Pose((2.0, 0.0, 0.0)) @ TRAY))
    bench.plan()
    assert (bench.program.tone, bench.program.failed) == ("bad", bench.program.selected)
    bench.actions.tick()
    assert bench.program.answer is not None
    bench.store.update(cell=cell(TRAY))
    bench.actions.tick()
    assert bench.program.answer is None


def test_a_slowed_program_is_still_in_its_frame(bench, monkeypatch):
    for module in ("program.program_planning", "check.slowdown_job"):  # By its own law it conforms to everything.
        monkeypatch.setattr(f"rcilab.app.{module}.PROGRAM_LAW", "jerk_limited")
    far = MODEL.forward(MODEL.home + np.array([1.0, 0.8, 0.0, -0.6, 0.0, 0.0, 0.0]))
    there = Waypoint.joint(TRAY.inverse() @ far, psi=0.0, speed=1.0, frame="tray")
    bench.load(Program(model=MODEL.name, start=MODEL.home, waypoints=(there,)))
    bench.plan()
    plan = bench.state.plan
    assert not all(row.ok for row in plan.report.rows)
    slower = slow_program(plan, bench.program.draft, 1, lambda part: None)
    assert slower.plan is not None
    assert slower.plan.frames == plan.frames
    assert MODEL.forward(slower.plan.motion.goal).is_close(far, 1e-6)


def test_the_open_page_draws_the_waypoint_with_its_frame_and_offers_the_frames():
    tray = Waypoint.line(TRAY.inverse() @ beside(0.0, 0.1, 0.0), speed=1.0, frame="Frame")
    program = Program(model=MODEL.name, start=MODEL.home, waypoints=(tray,))
    with opened() as bench:
        panel = WaypointPanel(Text("en"), bench.dispatcher.ask)
        panel.build(bench.server.gui, bench.store.state)

        def balls():
            return [point for handle in bench.renderer._marks._clouds[:1] for point in handle.points]

        def show():
            panel.show(bench.store.state, bench.session.status())
            return panel._frame.handle

        bench.dispatcher.ask(LoadProgram(name="tray.json", content=program.to_json().encode()))
        wait(lambda: bool(bench.store.state.program.draft.steps), "the program")
        note = Text("en").render(message("program.frame_missing", frame="Frame"))
        assert show().options == ("the base", "Frame")
        assert note in panel._source._handle.content
        bench.dispatcher.ask(EditCell(what="add", name="frame"))
        wait(lambda: bench.store.state.cell.cell is not None, "the frame")
        bench.dispatcher.ask(MoveEntry(index=0, position=tuple(TRAY.position), wxyz=tuple(TRAY.wxyz), ended=True))
        wait(lambda: len(balls()) == 1 and np.allclose(balls()[0], beside(0.0, 0.1, 0.0).position, atol=1e-6), "a ball")
        assert (show().value, show().visible) == ("Frame", True)
        assert note not in panel._source._handle.content
        bench.dispatcher.ask(PlanProgram())
        wait(lambda: bench.store.state.plan is not None and bench.store.state.plan.program is not None, "its plan")
        moved = STEP @ TRAY
        bench.dispatcher.ask(MoveEntry(index=0, position=tuple(moved.position), wxyz=tuple(moved.wxyz), ended=True))
        there = (STEP @ beside(0.0, 0.1, 0.0)).position
        wait(lambda: len(balls()) == 1 and np.allclose(balls()[0], there, atol=1e-6), "the ball with its frame")
        assert outdated(bench.store.state).code == "ready.frames"
        bench.dispatcher.ask(PlanProgram())
        wait(lambda: outdated(bench.store.state) is None, "the plan again")
        assert np.allclose(MODEL.forward(bench.store.state.plan.motion.goal).position, there, atol=1e-6)
        bench.dispatcher.ask(EditProgram(what="frame", frame=None))
        wait(lambda: bench.store.state.program.draft.steps[0].waypoint.frame is None, "the base frame")
        assert np.allclose(bench.store.state.program.draft.steps[0].waypoint.position, there, atol=1e-9)
        bench.dispatcher.ask(TypeField(field="cell.0.name", text="tray"))
        wait(lambda: bench.store.state.cell.cell.frames[0].name == "tray", "another name")
        assert show().options == ("the base", "tray")
