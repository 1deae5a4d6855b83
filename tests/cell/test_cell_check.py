"""A cell in the check of a motion: distances, names, certificate, and the same distances as a plain search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import rcilab
from rcilab.cell.cell import Cell
from rcilab.cell.cell_geometry import CellQuery, cell_geometry
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Plane, Solid, Sphere
from rcilab.cell.tool import Part, Tool
from rcilab.core.clearance import ClearanceLimit
from rcilab.core.errors import CertificateError
from rcilab.core.spatial import Pose

MODEL = rcilab.load_model("xMatePro7")
GOAL = MODEL.home + np.array((1.5, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0))
MOTION = rcilab.plan_joint(MODEL, MODEL.home, GOAL, speed=0.5)
WALL = Obstacle(name="wall", shape=Box(size=(0.1, 0.02, 1.0)), pose=Pose((0.3, 0.35, 0.5)))
TOOL = Tool(
    T_flange_tool=Pose((0.0, 0.0, 0.2)), solids=(Solid(shape=Box(size=(0.06, 0.06, 0.2)), pose=Pose((0, 0, 0.1))),)
)


def row(report, name: str):
    return next(found for found in report.rows if found.id == name)


def test_a_motion_through_a_wall_is_refused_with_link_wall_distance_and_time() -> None:
    assert rcilab.check(MOTION, MODEL).ok
    report = rcilab.check(MOTION, MODEL, cell=Cell(model="xMatePro7", obstacles=(WALL,)))
    assert not report.ok
    assert report.certificate is None
    worst = report.violations[0]
    assert worst.condition.id == "clearance.cell"
    assert "and wall: distance from an obstacle" in str(worst)
    assert "they overlap" in str(worst)
    assert "与 “wall”重叠" in report.explain("zh")


def test_a_tool_hits_what_the_arm_alone_does_not() -> None:
    post = Obstacle(name="post", shape=Sphere(radius=0.02), pose=MODEL.forward(GOAL) @ Pose((0.0, 0.0, 0.15)))
    without, with_tool = (
        rcilab.check(MOTION, MODEL, cell=Cell(model="xMatePro7", tool=tool, obstacles=(post,))) for tool in (None, TOOL)
    )
    assert without.ok
    assert not with_tool.ok
    assert with_tool.violations[0].location == "tool and post"
    allowed = replace(post, may_touch=("tool",))
    assert rcilab.check(MOTION, MODEL, cell=Cell(model="xMatePro7", tool=TOOL, obstacles=(allowed,))).ok


def test_a_held_part_is_checked_against_cell_and_floor() -> None:
    bar = Part(name="bar", solids=(Solid(shape=Box(size=(0.02, 0.02, 0.9)), pose=Pose((0.0, 0.0, 0.45))),))
    cell = Cell(model="xMatePro7", tool=TOOL, parts=(bar,), floor=0.0)
    assert rcilab.check(MOTION, MODEL, cell=cell).ok
    report = rcilab.check(MOTION, MODEL, cell=cell.holding("bar"))
    assert row(report, "clearance.floor").value < row(rcilab.check(MOTION, MODEL, cell=cell), "clearance.floor").value
    assert "part" in row(report, "clearance.floor").location


def test_the_floor_is_that_of_the_cell() -> None:
    height = row(rcilab.check(MOTION, MODEL), "clearance.floor").value
    raised = Cell(model="xMatePro7", T_world_base=Pose((0.0, 0.0, 0.8)))
    assert row(rcilab.check(MOTION, MODEL, cell=raised), "clearance.floor").value == pytest.approx(height + 0.8)
    open_below = Cell(model="xMatePro7", floor=None)
    assert all(found.id != "clearance.floor" for found in rcilab.check(MOTION, MODEL, cell=open_below).rows)


def test_the_certificate_is_for_this_cell() -> None:
    free = Cell(model="xMatePro7", obstacles=(replace(WALL, pose=Pose((2.0, 2.0, 0.5))),))
    report = rcilab.check(MOTION, MODEL, cell=free)
    assert report.certificate is not None
    report.certificate.verify(MOTION, MODEL, MOTION.start, cell=free)
    report.certificate.verify(MOTION, MODEL, MOTION.start)
    moved = free.placed(replace(WALL, pose=Pose((2.1, 2.0, 0.5))))
    with pytest.raises(CertificateError, match="does not cover the cell"):
        report.certificate.verify(MOTION, MODEL, MOTION.start, cell=moved)
    alone = rcilab.check(MOTION, MODEL).certificate
    assert alone is not None
    with pytest.raises(CertificateError, match=r"cell=robot\.cell"):
        alone.verify(MOTION, MODEL, MOTION.start, cell=free)


def test_a_monitor_finds_the_wall_in_the_same_cycle_as_the_check() -> None:
    cell = Cell(model="xMatePro7", obstacles=(WALL,))
    monitor = rcilab.Monitor(MODEL, distance=ClearanceLimit(), cell=cell)
    monitor.reset(MOTION.start)
    found = [monitor.step(rcilab.JointPosition(q=q)) for q in MOTION.q]
    walls = [[one for one in cycle if one.condition.id == "clearance.cell"] for cycle in found]
    first = next(k for k, violations in enumerate(walls) if violations)
    assert first == round(1e3 * rcilab.check(MOTION, MODEL, cell=cell).violations[0].time)
    assert "and wall: distance from an obstacle" in walls[first][0].text


def test_the_search_finds_what_all_pairs_have() -> None:
    """The bounds that skip pairs are right: compared with every pair, over random configurations and all shapes."""
    rng = np.random.default_rng(7)
    wedge = MeshShape(
        vertices=np.array([(0, 0, 0), (0.3, 0, 0), (0, 0.3, 0), (0, 0, 0.3)], dtype=float),
        faces=np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]),
    )
    shapes = (Box(size=(0.2, 0.1, 0.3)), Cylinder(radius=0.05, length=0.4), Sphere(radius=0.1), wedge, Plane())
    obstacles = tuple(
        Obstacle(name=f"o{i}", shape=shape, pose=Pose.from_rpy(rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3)))
        for i, shape in enumerate(shapes[:4] * 3)
    )
    cell = Cell(
        model="xMatePro7", tool=TOOL, obstacles=(*obstacles, Obstacle(name="p", shape=Plane(), pose=Pose((0, 0, -1))))
    )
    model = cell.applied_to(MODEL)
    geometry = cell_geometry(model, cell, ClearanceLimit(floor_height=-0.9))
    moving = CellQuery(geometry)
    q = MODEL.home.copy()
    for _ in range(150):
        q = q + rng.normal(0.0, 0.05, 7)
        fresh = CellQuery(geometry)
        for name in ("links", "floor", "cell"):
            assert getattr(moving, name)(q)[0] == pytest.approx(getattr(fresh, name)(q)[0], abs=2e-6)
