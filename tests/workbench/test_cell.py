"""The cell on the page: requests in, state out, plans checked in it, and motions that touch an obstacle refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh

from rcilab.app.cell.cell_actions import AddMesh, EditCell, LoadCell, MoveEntry, SelectEntry, SetCell
from rcilab.app.cell.cell_edit import base_pose_of
from rcilab.app.cell.cell_state import Entry, entries_of, is_cell_pending, saved_cell
from rcilab.app.check.check_actions import PressCheck
from rcilab.app.check.freshness import outdated
from rcilab.app.goal.goal_actions import CancelSearch, MoveJoint, PlanGoal, PoseGoal, SetPathType, SetSpeed
from rcilab.app.request import Request, TypeField
from rcilab.app.run.replay import replayed
from rcilab.app.run.run_actions import ChooseRobot, RobotCommand
from rcilab.app.setup.setup_actions import OpenTab, PressSetup
from rcilab.app.text import Text
from rcilab.app.view_actions import SetView
from rcilab.cell.cell import Cell
from rcilab.cell.cell_storage import pack_cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import Box, MeshShape
from rcilab.core.spatial import Pose
from rcilab.workbench.app import Workbench
from tests.workbench.opened import opened, told, wait


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as found:
        yield found


@pytest.fixture
def ask(bench) -> Callable[[Request], None]:
    """Asks, and returns once it has been dealt with."""

    def act(request: Request) -> None:
        height = bench.store.state.height + 1.0
        bench.dispatcher.ask(request)
        bench.dispatcher.ask(SetView(name="height", value=height))
        wait(lambda: bench.store.state.height == height, f"an answer to {request}")

    act(EditCell(what="clear"))
    while bench.store.state.setup.can_undo:
        act(PressSetup(what="undo"))
    act(PoseGoal(name="here"))
    return act


def cell_of(bench) -> Cell:
    cell = bench.store.state.cell.cell
    assert cell is not None
    return cell


def type_in(ask, index: int, **numbers: str) -> None:
    for name, text in numbers.items():
        ask(TypeField(field=f"cell.{index}.{name}", text=text))


def checked(bench, ok: bool) -> bool:
    """Whether the plan has been checked in the cell of now, with this verdict."""
    state = bench.store.state
    plan = state.plan
    return plan is not None and plan.complete and plan.cell is state.cell_for(plan.model) and plan.report.ok == ok


def test_an_obstacle_in_the_way_is_refused_and_the_verdict_follows_it(bench, ask):
    goal = np.array(bench.store.state.goal.q)
    goal[0] += 1.2
    ask(MoveJoint(joint=0, angle=float(goal[0])))
    wait(lambda: checked(bench, True), "a plan without a cell")
    ask(EditCell(what="add", name="box"))
    middle = bench.store.state.plan.motion.at(0.5 * bench.store.state.plan.motion.duration).q
    place = bench.store.state.model.forward(middle).position
    ask(MoveEntry(index=0, position=tuple(place), wxyz=(1.0, 0.0, 0.0, 0.0), ended=True))
    wait(lambda: checked(bench, False), "the plan to be refused")
    worst = bench.store.state.plan.report.violations[0]
    assert (worst.condition.id, worst.links.obstacle) == ("clearance.cell", "Box")
    assert outdated(bench.store.state) is None
    wait(lambda: bench.store.state.scene.closest is not None, "the line between them")
    closest = bench.store.state.scene.closest
    assert closest.pair.obstacle == "Box"
    assert closest.distance < 0.0
    ask(RobotCommand(what="execute"))
    assert bench.session.status().phase == "idle", "a motion through an obstacle must not run"
    ask(MoveEntry(index=0, position=(-1.0, 0.0, 0.5), wxyz=(1.0, 0.0, 0.0, 0.0), ended=True))
    wait(lambda: checked(bench, True), "the plan to be safe again")
    wait(lambda: bench.store.state.scene.closest is None, "no line")
    ask(RobotCommand(what="execute"))
    wait(lambda: abs(bench.session.status().q_c[0] - goal[0]) < 1e-3, "the arm at its goal")
    wait(lambda: bench.session.status().phase == "idle", "the end of the motion")
    wait(lambda: bench.store.state.last_run is not None and bench.store.state.last_run.run is not None, "the run")
    run = bench.store.state.last_run.run
    assert [obstacle.name for obstacle in run.cell.obstacles] == ["Box"]
    shown = replayed(bench.store.state, run)
    assert shown.cell.cell is run.cell
    assert outdated(shown) is None
    ask(PoseGoal(name="home"))
    wait(lambda: checked(bench, True), "a plan back")
    ask(RobotCommand(what="execute"))
    wait(lambda: abs(bench.session.status().q_c[0] - bench.store.state.model.home[0]) < 1e-3, "the arm at home")
    wait(lambda: bench.session.status().phase == "idle", "the end of the motion")


def test_a_path_around_an_obstacle_is_searched_checked_and_cancelled(bench, ask):
    model, goal = bench.store.state.model, np.array(bench.store.state.goal.q)
    goal[0] += 1.2
    ask(MoveJoint(joint=0, angle=float(goal[0])))
    middle = bench.store.state.plan.motion.at(0.5 * bench.store.state.plan.motion.duration).q
    ask(EditCell(what="add", name="box"))
    place = tuple(model.forward(middle).position)
    ask(MoveEntry(index=0, position=place, wxyz=(1.0, 0.0, 0.0, 0.0), ended=True))
    ask(SetPathType(kind="free"))
    try:
        wait(lambda: checked(bench, True), "a path around it")
        plan = bench.store.state.plan
        assert plan.kind == "free"
        assert np.allclose(plan.motion.goal, goal)
        assert bench.store.state.search is None
        ask(PressCheck(what="slow"))
        ask(SetSpeed(speed=0.9))
        wait(lambda: bench.store.state.search is not None, "the next search")
        ask(CancelSearch())
        assert (bench.store.state.search, bench.store.state.no_plan.code) == (None, "plan.search_cancelled")
        ask(MoveEntry(index=0, position=tuple(model.forward(goal).position), wxyz=(1.0, 0.0, 0.0, 0.0), ended=True))
        ask(PlanGoal())
        wait(lambda: bench.store.state.no_plan.code == "plan.failed", "that the goal is not free")
        assert "link" in Text("en").render(bench.store.state.no_plan) or "tool" in Text("en").render(
            bench.store.state.no_plan
        )
    finally:
        ask(SetPathType(kind="joint"))


def test_entries_are_typed_renamed_attached_copied_and_taken_back(bench, ask):
    ask(EditCell(what="add", name="cylinder"))
    type_in(ask, 0, x="300", y="-0.25", z="400", yaw="30", radius="80", length="200", name="post")
    post = cell_of(bench).obstacles[0]
    assert (post.name, post.shape.radius, post.shape.length) == ("post", 0.08, 0.2)
    np.testing.assert_allclose(post.pose.position, (0.3, -0.00025, 0.35), atol=1e-12)  # It has become shorter.
    assert math.degrees(post.pose.rpy[2]) == pytest.approx(30.0)
    type_in(ask, 0, radius="0")
    assert "cell.0.radius" in bench.store.state.problems
    type_in(ask, 0, name="  ")
    assert bench.store.state.problems["cell.0.name"].code == "cell.no_name"
    ask(EditCell(what="add", name="frame"))
    type_in(ask, 1, name="table", x="100")
    ask(SelectEntry(index=0))
    before = base_pose_of(cell_of(bench), Entry("obstacle", "post"))
    ask(SetCell(name="frame", value="table"))
    assert base_pose_of(cell_of(bench), Entry("obstacle", "post")).is_close(before, 1e-9), "it stays where it is"
    type_in(ask, 1, z="250")
    moved = base_pose_of(cell_of(bench), Entry("obstacle", "post")).position - before.position
    assert np.abs(moved).max() > 0.1, "it moves with its frame"
    ask(SelectEntry(index=1))
    ask(EditCell(what="delete"))
    assert told(bench) == "cell.frame_used"
    ask(SelectEntry(index=0))
    ask(EditCell(what="duplicate"))
    assert [entry.name for entry in entries_of(cell_of(bench))] == ["post", "post 2", "table"]
    type_in(ask, 1, name="post")
    assert bench.store.state.problems["cell.1.name"].code == "cell.name_taken"
    ask(SetCell(name="workpiece", value=True))
    ask(SetCell(name="tool", value=True))
    assert (cell_of(bench).workpiece, cell_of(bench).obstacles[1].may_touch) == ("post 2", ("tool",))
    ask(EditCell(what="delete"))
    assert cell_of(bench).workpiece == ""
    for _ in range(30):
        ask(EditCell(what="undo"))
    assert not bench.store.state.cell.can_undo
    ask(EditCell(what="redo"))
    assert bench.store.state.cell.can_undo


def test_a_drag_is_one_step_for_undo_and_another_tab_hides_the_handles(bench, ask):
    ask(EditCell(what="add", name="sphere"))
    first = cell_of(bench).obstacles[0].pose
    for step in range(5):
        ask(MoveEntry(index=0, position=(0.5, 0.1 * step, 0.3), wxyz=(1.0, 0.0, 0.0, 0.0), ended=step == 4))
    ask(MoveEntry(index=0, position=(math.nan, 0.0, 0.0), wxyz=(1.0, 0.0, 0.0, 0.0)))
    ask(EditCell(what="undo"))
    assert cell_of(bench).obstacles[0].pose.is_close(first, 1e-12)
    ask(SelectEntry(index=0))
    ask(OpenTab(name="tab.check"))
    assert bench.store.state.cell.selected is None


def test_a_loaded_cell_gives_the_arm_its_tool_and_the_held_part_its_load(bench, ask):
    ask(EditCell(what="example", name="pick_place"))
    cell, state = cell_of(bench), bench.store.state
    assert state.model.T_flange_tool.is_close(cell.tool.T_flange_tool, 1e-12)
    assert state.model.load.mass == pytest.approx(0.9)
    ask(SetCell(name="held", value="cube"))
    assert bench.store.state.model.load.mass == pytest.approx(1.1)
    assert bench.store.state.cell_for(bench.store.state.model).applied_to(state.model).load.mass == pytest.approx(1.1)
    kept = saved_cell(cell_of(bench), bench.store.state.model)
    ask(EditCell(what="clear"))
    ask(LoadCell(name="kept.zip", content=pack_cell(kept)))
    assert cell_of(bench).fingerprint == kept.fingerprint
    assert bench.store.state.model.load.mass == pytest.approx(1.1)
    ask(LoadCell(name="kept.json", content=b"{"))
    assert bench.store.state.problems["cell.file"].code == "cell.file_bad"
    assert cell_of(bench).fingerprint == kept.fingerprint
    ask(LoadCell(name="other.zip", content=pack_cell(Cell(model="FR3"))))
    assert bench.store.state.problems["cell.file"].code == "cell.file_other"


def test_a_mesh_becomes_an_obstacle_and_one_in_millimetres_is_scaled(bench, ask):
    for unit, edge in ((1.0, 0.2), (1000.0, 200.0)):
        ask(EditCell(what="clear"))
        ask(AddMesh(name="casting.stl", content=trimesh.creation.box((edge, edge, edge)).export(file_type="stl")))
        wait(lambda: bench.store.state.cell.cell is not None, "the mesh to be prepared")
        (obstacle,) = cell_of(bench).obstacles
        assert (obstacle.name, type(obstacle.shape)) == ("casting", MeshShape)
        np.testing.assert_allclose(np.ptp(obstacle.shape.vertices, axis=0), edge / unit, rtol=1e-5)
    assert told(bench) == "cell.scaled"
    ask(AddMesh(name="casting.step", content=b"ISO-10303-21;"))
    assert bench.store.state.problems["cell.file"].code == "cell.file_bad"


def test_the_cell_comes_back_after_a_restart(tmp_path, bench, ask):
    from rcilab.app.autosave import Autosave

    model = bench.store.state.model
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    mesh = trimesh.load(BytesIO(box.export(file_type="stl")), file_type="stl")
    shape = MeshShape(vertices=mesh.vertices, faces=mesh.faces)
    wall = Obstacle(name="wall", shape=Box(size=(1.0, 0.1, 1.0)), pose=Pose((0.0, 1.0, 0.5)))
    cell = Cell(model=model.name, obstacles=(wall, Obstacle(name="casting", shape=shape)))
    state = bench.store.state
    autosave = Autosave(tmp_path / "kept.json")
    autosave.keep(replace(state, cell=replace(state.cell, cell=cell)))
    autosave.close(replace(state, cell=replace(state.cell, cell=cell)))
    back = Autosave(tmp_path / "kept.json").recall(model).cell
    assert [obstacle.name for obstacle in back.obstacles] == ["wall", "casting"]
    np.testing.assert_allclose(np.ptp(back.obstacles[1].shape.vertices, axis=0), 0.2, rtol=1e-5)
    assert len(list((tmp_path / "kept.meshes").glob("*.stl"))) == 1
    again = Autosave(tmp_path / "kept.json")
    again.recall(model)
    again.close(replace(state, cell=replace(state.cell, cell=Cell(model=model.name, obstacles=(wall,)))))


def test_the_simulated_arm_is_stopped_by_the_cell_that_it_was_started_with(bench, ask):
    ask(EditCell(what="add", name="box"))
    assert not is_cell_pending(bench.store.state), "the ideal arm has no contacts"
    ask(ChooseRobot(plant="mujoco"))
    try:
        wait(
            lambda: bench.session.status().phase == "idle" and bool(bench.session.status().powered), "the simulated arm"
        )
        assert not is_cell_pending(bench.store.state)
        assert bench.store.state.solid is bench.store.state.cell_for(bench.store.state.model)
        ask(MoveEntry(index=0, position=(0.9, 0.0, 0.2), wxyz=(1.0, 0.0, 0.0, 0.0), ended=True))
        assert is_cell_pending(bench.store.state)
        before = bench.session.robot()
        ask(ChooseRobot(plant="mujoco"))
        wait(lambda: bench.session.is_ready and bench.session.robot() is not before, "another controller")
        assert not is_cell_pending(bench.store.state)
    finally:
        ask(ChooseRobot(plant="ideal"))
        wait(lambda: bench.session.status().phase == "idle" and bool(bench.session.status().powered), "the ideal arm")
