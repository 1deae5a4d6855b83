"""Bodies of links that are described as rods: smooth castings, foot plate and flange."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rcilab.core.arrays import Array
from rcilab.robots.description import Rod
from rcilab.robots.mesh import Mesh, revolve
from rcilab.robots.surface import join, mesh_surface, rod

_BLEND = 0.016  # [m] Rounding of the seam between two rods.
_PLATE = 0.012  # [m] Thickness of the foot plate.
_FLANGE_RADIUS = 0.0315  # [m] ISO 9409-1-50
_FLANGE_HEIGHT = 0.020  # [m]


def cast(rods: Sequence[Rod], cell: float) -> Mesh:
    """Returns the rods of a link as one smooth body, in the link's frame.

    Args:
        rods: The rods, at least one.
        cell: Edge of a grid cell, about that of a triangle, [m].
    """
    ends = np.array([(r.start, r.end) for r in rods])
    room = max(r.radius for r in rods) + _BLEND / 2.0 + cell

    def body(p: Array) -> Array:
        first, *others = (rod(p, r.start, r.end, r.radius, r.radius) for r in rods)
        for other in others:
            first = join(first, other, _BLEND)
        return first

    return mesh_surface(body, ends.min(axis=(0, 1)) - room, ends.max(axis=(0, 1)) + room, cell)


def foot_plate(radius: float, segments: int) -> Mesh:
    """Returns the disc under the base, in the base frame, [m]."""
    edge = [(0.0, 0.0), (radius, 0.0), (radius, _PLATE), (0.0, _PLATE)]
    return revolve(edge, segments=segments)


def flange_plate(rotation: Array, segments: int) -> Mesh:
    """Returns the disc of the flange, in the last link's frame; its face looks along z of the flange.

    Args:
        rotation: Of the flange in the last link's frame, shape (3, 3).
        segments: Facets around it.
    """
    up = rotation[2, 2]
    r, bevel = _FLANGE_RADIUS, 0.4 * _FLANGE_HEIGHT  # Bevelled, so that the ball end of the link's capsule covers it.
    edge = [(0.0, -_FLANGE_HEIGHT), (r, -_FLANGE_HEIGHT), (r, -bevel), (0.55 * r, 0.0), (0.0, 0.0)]
    if up < 0.0:
        edge = [(radius, -height) for radius, height in reversed(edge)]
    plate = revolve(edge, segments=segments)
    return plate if up else Mesh(plate.vertices @ rotation.T, plate.faces)
