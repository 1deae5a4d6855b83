"""Triangles of the solids of a cell, for pictures and exports."""

from __future__ import annotations

import numpy as np

from rcilab.cell.cell import Cell
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Shape, Solid, Sphere
from rcilab.core.spatial import Pose
from rcilab.robots.mesh import Mesh

PLANE_SIZE = 2.0
"""Edge of the square that stands for an infinite wall, [m]."""
_SECTIONS = 32  # Of a cylinder; tuning value: round at the size of a screen.


def shape_mesh(shape: Shape) -> Mesh:
    """Returns the triangles of a shape in its own frame, [m]; of a wall a square of `PLANE_SIZE`."""
    import trimesh

    if isinstance(shape, MeshShape):
        return Mesh(shape.vertices, shape.faces)
    if isinstance(shape, Box):
        made = trimesh.creation.box(shape.size)
    elif isinstance(shape, Cylinder):
        made = trimesh.creation.cylinder(shape.radius, shape.length, sections=_SECTIONS)
    elif isinstance(shape, Sphere):
        made = trimesh.creation.icosphere(3, shape.radius)
    else:
        half = PLANE_SIZE / 2.0
        corners = np.array([(-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0)])
        return Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32))
    return Mesh(np.array(made.vertices), np.array(made.faces, dtype=np.int32))


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
