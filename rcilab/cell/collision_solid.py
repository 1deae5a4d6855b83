"""Solids as coal computes their distances: each convex."""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# coal defines its names in compiled code at import; pyright does not know them.

from __future__ import annotations

from typing import Any

import coal
import numpy as np

from rcilab.cell.convex_parts import ConvexPart, convex_parts
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Shape, Sphere


def convex_solids(shape: Shape) -> list[Any]:
    """Returns coal's solids of a shape, in its frame: one, or the convex parts of a mesh."""
    if isinstance(shape, MeshShape):
        return [_convex(part) for part in convex_parts(shape)]
    if isinstance(shape, Box):
        return [coal.Box(*shape.size)]
    if isinstance(shape, Cylinder):
        return [coal.Cylinder(shape.radius, shape.length)]
    return [coal.Sphere(shape.radius) if isinstance(shape, Sphere) else half_space(0.0)]


def half_space(height: float) -> Any:
    """Returns what is below a height along z, [m]."""
    return coal.Halfspace(np.array((0.0, 0.0, 1.0)), height)


def _convex(part: ConvexPart) -> Any:
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in part[0]:
        points.append(vertex)
    for a, b, c in part[1].tolist():
        triangles.append(coal.Triangle(a, b, c))
    return coal.Convex(points, triangles)
