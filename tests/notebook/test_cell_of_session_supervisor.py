"""The cell of a session in the notebook: plans are checked in it, scenes show it."""

from __future__ import annotations

import numpy as np

import rcilab
from rcilab import notebook
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import Box
from rcilab.core.spatial import Pose
from rcilab.notebook.kernel_reachability import KernelReachability
from tests.waiting import wait_for

PRO7 = rcilab.load_model("xMatePro7")
GOAL = PRO7.home + np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
SIDE = Obstacle(name="post", shape=Box(size=(0.1, 0.1, 1.0)), pose=Pose((-0.6, 0.0, 0.5)))


def test_a_plan_is_checked_in_the_cell_of_its_session_and_runs() -> None:
    middle = PRO7.forward(0.5 * (PRO7.home + GOAL)).position
    in_the_way = Obstacle(name="post", shape=SIDE.shape, pose=Pose((middle[0], middle[1], 0.5)))
    with (
        rcilab.simulate(PRO7, cell=Cell(model=PRO7.name, obstacles=(in_the_way,))) as robot,
        notebook.RunPanel(robot) as run,
    ):
        wait_for(lambda: not run.power_on.disabled, what="a robot that can be powered")
        run.power_on.click()
        wait_for(lambda: run.state.status is not None and run.state.status.powered, what="motor power")
        run.state.pose(GOAL)
        run.state.make_plan()
        plan = run.state.shown_plan
        assert [v.links.obstacle for v in plan.report.violations if v.links is not None] == ["post"]
        assert plan.report.certificate is None
        robot.set_cell(Cell(model=PRO7.name, obstacles=(SIDE,)))
        run.state.make_plan()
        assert run.state.shown_plan.report.ok
        run.execute.click()
        wait_for(lambda: np.abs(robot.state.q_c - GOAL).max() < 1e-3, 30.0, "the arm at its goal")


def test_scene_and_preview_show_obstacles_and_what_the_arm_carries() -> None:
    cell = Cell.example("pick_place").holding("cube")
    model = cell.applied_to(PRO7)
    plain, shown = (rcilab.preview(model.home, model, live=False, cell=one).html() for one in (None, cell))
    assert len(shown) > len(plain)
    with (
        rcilab.simulate(PRO7, cell=cell) as robot,
        notebook.Scene(robot, reachability=KernelReachability(route="loopback")) as scene,
    ):
        drawn = scene._picture._canvas._nodes
        assert {"/cell/obstacle0/mesh", "/cell/obstacle3/mesh", "/cell/frame2"} <= set(drawn)
        assert any(node.startswith("/arm/") and node.endswith("/carried") for node in drawn)
        robot.set_cell(None)
        scene.state.notify("goal")
        assert "/cell/obstacle0/mesh" not in scene._picture._canvas._nodes
