from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import rcilab
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Frame, Obstacle, Signal
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Plane, Solid, Sphere
from rcilab.cell.tool import Jaws, Part, Tool
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose

WALL = Obstacle(name="wall", shape=Box(size=(0.1, 0.02, 1.0)), pose=Pose((0.3, 0.35, 0.5)))


def cell_with(**values) -> Cell:
    return Cell(model="xMatePro7", **values)


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: Box(size=(0.1, 0.0, 0.1)), "size.*above 0 and at most 100 m"),
        (lambda: Cylinder(radius=0.1, length=500.0), "length.*at most 100 m"),
        (lambda: Sphere(radius=float("nan")), "radius"),
        (lambda: MeshShape(vertices=np.zeros((3, 3)), faces=np.array([[0, 1, 3]])), "vertex does not exist"),
        (lambda: MeshShape(vertices=np.full((3, 3), 300.0), faces=np.array([[0, 1, 2]])), "scale 0.001"),
        (lambda: Jaws(open=0.02, closed=0.05), "above the closed width"),
        (lambda: Tool(solids=(Solid(shape=Plane()),)), "cannot be carried"),
        (lambda: Obstacle(name="", shape=Plane()), "obstacle name.*one line"),
        (lambda: Obstacle(name="a", shape=Plane(), may_touch=("arm",)), "must be of: tool, part"),
        (lambda: Signal(name="grip", kind="output", channel=1.5), "whole number"),
        (lambda: cell_with(obstacles=(WALL, WALL)), "name of two"),
        (lambda: cell_with(obstacles=(replace(WALL, frame="table"),)), "frame of wall.*there are: world"),
        (lambda: cell_with(frames=(Frame(name="a", parent="b"),)), "parent of a.*not a frame above it"),
        (lambda: cell_with(frames=(Frame(name="world"),)), "choose another"),
        (lambda: cell_with(floor=float("inf")), "floor.*within 100 m"),
        (lambda: cell_with(held="bolt"), "held.*there are: none"),
        (lambda: cell_with(T_world_base=Pose.from_rpy((0, 0, 0), (0.3, 0, 0))), "upright"),
    ],
)
def test_what_is_not_a_cell_is_refused_with_the_bound(build, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        build()


def test_frames_are_a_tree_and_obstacles_move_with_theirs() -> None:
    table = Frame(name="table", T_parent_frame=Pose((1.0, 0.0, 0.5)))
    tray = Frame(name="tray", parent="table", T_parent_frame=Pose.from_rpy((0.0, 0.2, 0.0), (0.0, 0.0, np.pi / 2)))
    cell = cell_with(
        T_world_base=Pose((0.0, 0.0, 0.3)), frames=(table, tray), obstacles=(replace(WALL, frame="tray", pose=Pose()),)
    )
    np.testing.assert_allclose(cell.T_world("tray").position, (1.0, 0.2, 0.5), atol=1e-12)
    np.testing.assert_allclose(cell.solid("wall").pose.position, (1.0, 0.2, 0.2), atol=1e-12)
    moved = replace(cell, frames=(replace(table, T_parent_frame=Pose((0.5, 0.0, 0.5))), tray))
    np.testing.assert_allclose(moved.solid("wall").pose.position, (0.5, 0.2, 0.2), atol=1e-12)
    assert moved.fingerprint != cell.fingerprint
    assert cell.floor_height == pytest.approx(-0.3)


def test_the_model_gets_tool_and_the_mass_of_tool_and_held_part() -> None:
    model = rcilab.load_model("xMatePro7")
    tool = Tool(T_flange_tool=Pose((0.0, 0.0, 0.2)), payload=rcilab.Payload(mass=1.0, center_of_mass=(0.0, 0.0, 0.1)))
    part = Part(name="bolt", payload=rcilab.Payload(mass=0.5, center_of_mass=(0.01, 0.0, 0.0)))
    cell = cell_with(tool=tool, parts=(part,))
    assert cell.applied_to(model).load.mass == 1.0
    loaded = cell.holding("bolt").applied_to(model)
    assert loaded.load.mass == 1.5
    np.testing.assert_allclose(loaded.load.center_of_mass, (0.01 / 3.0, 0.0, (0.1 + 0.1) / 1.5), atol=1e-12)
    assert loaded.T_flange_tool.is_close(tool.T_flange_tool)
    bare = cell_with(parts=(part,)).holding("bolt")
    for holding in (cell.holding("bolt"), bare):  # A model that has them already does not get them twice.
        once = holding.applied_to(model)
        assert holding.applied_to(once).load.mass == once.load.mass
    assert bare.applied_to(loaded).T_flange_tool.is_close(tool.T_flange_tool)
    assert bare.applied_to(loaded).load.mass == 0.5
    with pytest.raises(InvalidValueError, match="is that of xMatePro7, the model is FR3"):
        cell.applied_to(rcilab.load_model("FR3"))


def test_fingers_stand_apart_by_the_width_of_the_jaws() -> None:
    finger = Solid(shape=Box(size=(0.02, 0.01, 0.05)), pose=Pose((0.0, 0.005, -0.025)))
    tool = Tool(T_flange_tool=Pose((0.0, 0.0, 0.1)), jaws=Jaws(open=0.08, finger=(finger,)))
    for width, inner in ((None, 0.04), (0.0, 0.0), (0.03, 0.015)):
        sides = [solid.pose.position[1] for solid in tool.solids_at(width)]
        np.testing.assert_allclose(sides, (inner + 0.005, -inner - 0.005), atol=1e-12)


def test_an_obstacle_is_placed_moved_and_removed() -> None:
    cell = cell_with().placed(WALL)
    moved = cell.placed(replace(WALL, pose=Pose((0.5, 0.0, 0.5))))
    assert [o.name for o in moved.obstacles] == ["wall"]
    assert moved.fingerprint != cell.fingerprint
    assert moved.without("wall").obstacles == ()
    with pytest.raises(InvalidValueError, match="does not exist in the cell; there are: wall"):
        cell.without("table")
