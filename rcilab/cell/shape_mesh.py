"""Triangles of the solids of a cell, for pictures and exports."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from rcilab.cell.cell import Cell
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Shape, Solid, Sphere
from rcilab.core.arrays import Array
from rcilab.core.spatial import Pose
from rcilab.robots.mesh import Mesh, revolve

PLANE_SIZE = 4.0
"""Edge of the square that stands for an infinite wall, [m]."""
_THICKNESS = 0.01  # [m] Of this square.
_SEGMENTS = 32  # Of a cylinder or a sphere; tuning value: round at the size of a screen.


@lru_cache(maxsize=256)
def shape_mesh(shape: Shape) -> Mesh:
    """Returns the triangles of a shape in its own frame, [m]; of a wall a square of `PLANE_SIZE`. Edges are sharp."""
    if isinstance(shape, MeshShape):
        return Mesh(shape.vertices, shape.faces)
    if isinstance(shape, Box):
        return _box(shape.size)
    if isinstance(shape, Cylinder):
        half = shape.length / 2.0
        profile = [(0.0, -half), (shape.radius, -half), (shape.radius, half), (0.0, half)]
        return revolve(profile, segments=_SEGMENTS)
    if isinstance(shape, Sphere):
        r, angles = shape.radius, np.linspace(-np.pi / 2.0, np.pi / 2.0, _SEGMENTS // 2 + 1)[1:-1].tolist()
        profile = [(0.0, -r), *((r * math.cos(angle), r * math.sin(angle)) for angle in angles), (0.0, r)]
        return revolve(profile, segments=_SEGMENTS)
    return _box((PLANE_SIZE, PLANE_SIZE, _THICKNESS)).moved((0.0, 0.0, -_THICKNESS / 2.0))


def _box(size: tuple[float, ...]) -> Mesh:
    corners: list[Array] = []
    for axis in range(3):
        for side in (-0.5, 0.5):
            square = np.full((4, 3), side)
            square[:, (axis + 1) % 3] = np.array((-0.5, 0.5, 0.5, -0.5)) * np.sign(side)
            square[:, (axis + 2) % 3] = (-0.5, -0.5, 0.5, 0.5)
            corners.append(square)
    faces = [(4 * i + a, 4 * i + b, 4 * i + c) for i in range(6) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    return Mesh(np.concatenate(corners) * size, np.array(faces, dtype=np.int32))


def solid_mesh(solid: Solid) -> Mesh:
    """Returns the triangles of a solid in the frame that its pose is in, [m]."""
    mesh, pose = shape_mesh(solid.shape), solid.pose
    return Mesh(mesh.vertices @ pose.rotation.T + pose.position, mesh.faces)


def carried_solids(cell: Cell, T_flange_tool: Pose) -> dict[str, tuple[Solid, ...]]:
    """Returns the bodies of "tool" and "part" in the flange frame; without one that is not there.

    Args:
        cell: The cell.
        T_flange_tool: Pose of the tool, of an arm whose cell has no tool.
    """
    tip = T_flange_tool if cell.tool is None else cell.tool.T_flange_tool
    tool = () if cell.tool is None else cell.tool.solids_at()
    part = () if cell.part is None else cell.part.at_flange(tip)[1]
    return {name: solids for name, solids in (("tool", tool), ("part", part)) if solids}
