"""Smooth bodies from signed distances: primitives, smooth unions, and meshes of their surfaces.

A body is a function from points, shape (N, 3), [m], to signed distances, shape (N,), [m]: negative inside. The minimum
joins bodies, the maximum cuts them; the smooth versions round the seam, so that a housing looks like one casting.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from rcilab.core.arrays import Array
from rcilab.robots.mesh import Mesh

Body: TypeAlias = Callable[[Array], Array]

_PROJECTIONS = 2
_RELAXATIONS = 2
_STEP = 1e-5  # [m] for differences of distances; bodies are smooth on a scale of millimetres


def join(a: Array, b: Array, blend: float) -> Array:
    """Returns the union of two bodies with a seam rounded over about `blend`, [m] (quadratic smooth minimum)."""
    h = np.maximum(blend - np.abs(a - b), 0.0)
    return np.minimum(a, b) - h * h * (0.25 / blend)


def cut(a: Array, b: Array, blend: float) -> Array:
    """Returns body `a` without body `b`, the edge rounded over about `blend`, [m]."""
    return -join(-a, b, blend)


def cylinder(p: Array, axis: int, low: float, high: float, radius: float, edge: float, at: Sequence[float]) -> Array:
    """Returns distances to a cylinder with rounded rims.

    Args:
        p: Points, shape (N, 3), [m].
        axis: 0, 1 or 2, the direction of the cylinder.
        low: Lower end along the axis, [m].
        high: Upper end along the axis, [m].
        radius: Radius, [m].
        edge: Radius of the rims, [m].
        at: The two other coordinates of the axis, in the order of x, y, z, [m].
    """
    u, v = (i for i in range(3) if i != axis)
    radial = np.hypot(p[:, u] - at[0], p[:, v] - at[1]) - (radius - edge)
    axial = np.abs(p[:, axis] - (low + high) / 2.0) - ((high - low) / 2.0 - edge)
    outside = np.hypot(np.maximum(radial, 0.0), np.maximum(axial, 0.0))
    return outside + np.minimum(np.maximum(radial, axial), 0.0) - edge


def rod(p: Array, start: Sequence[float], end: Sequence[float], r0: float, r1: float) -> Array:
    """Returns distances to a round rod between two points, with the radius changing from r0 to r1, [m]."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    along = b - a
    t = np.clip((p - a) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(p - a - t[:, None] * along, axis=1) - (r0 + t * (r1 - r0))


def vase(p: Array, ends: Sequence[float], stations: Sequence[float], radii: Sequence[float]) -> Array:
    """Returns distances (slightly too small on the slope) to an upright body of revolution about the z axis.

    Args:
        p: Points, shape (N, 3), [m].
        ends: Heights of the flat bottom and top, [m].
        stations: Heights between which the radius changes from the first to the second, smoothly, [m].
        radii: Radius below the first and above the second station, [m].
    """
    t = np.clip((p[:, 2] - stations[0]) / (stations[1] - stations[0]), 0.0, 1.0)
    radius = radii[0] + (radii[1] - radii[0]) * t * t * (3.0 - 2.0 * t)
    radial = np.hypot(p[:, 0], p[:, 1]) - radius
    return np.maximum(radial, np.maximum(ends[0] - p[:, 2], p[:, 2] - ends[1]))


def box(p: Array, center: Sequence[float], half: Sequence[float], edge: float) -> Array:
    """Returns distances to a box with rounded edges, half lengths and edge radius in [m]."""
    d = np.abs(p - np.asarray(center)) - (np.asarray(half) - edge)
    return np.linalg.norm(np.maximum(d, 0.0), axis=1) + np.minimum(d.max(axis=1), 0.0) - edge


def mesh_surface(body: Body, low: Sequence[float], high: Sequence[float], cell: float) -> Mesh:
    """Returns the surface of a body inside a box as a mesh (surface nets, then relaxed along the surface).

    Args:
        body: Signed distances; its zero level must not touch the sides of the box.
        low: Lower corner of the box, [m].
        high: Upper corner of the box, [m].
        cell: Edge of a grid cell, about the edge of a triangle, [m].
    """
    start = np.asarray(low, dtype=np.float64)
    counts = np.ceil((np.asarray(high) - start) / cell).astype(int) + 1
    axes = [start[i] + cell * np.arange(counts[i]) for i in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = (body(grid) < 0.0).reshape(counts)
    corners = np.zeros(counts - 1, dtype=np.int8)
    for i, j, k in np.ndindex(2, 2, 2):
        corners += inside[i : counts[0] - 1 + i, j : counts[1] - 1 + j, k : counts[2] - 1 + k]
    crossed = (corners > 0) & (corners < 8)
    number = np.full(crossed.shape, -1, dtype=np.int64)
    number[crossed] = np.arange(int(crossed.sum()))
    vertices = start + cell * (np.argwhere(crossed) + 0.5)
    quads = _quads_across_edges(inside, number)
    vertices = _project(body, vertices, _PROJECTIONS)
    for _ in range(_RELAXATIONS):
        vertices = _project(body, _average_neighbours(vertices, quads), 1)
    vertices = _project(body, vertices, 1)
    return Mesh(vertices, _split_quads(vertices, quads))


def _quads_across_edges(inside: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Returns one quad for every grid edge that crosses the surface: the four cells around the edge, shape (Q, 4)."""
    quads: list[np.ndarray] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        first = np.moveaxis(inside, (axis, u, v), (0, 1, 2))
        cells = np.moveaxis(number, (axis, u, v), (0, 1, 2))
        leaving = first[:-1, 1:-1, 1:-1] & ~first[1:, 1:-1, 1:-1]
        entering = ~first[:-1, 1:-1, 1:-1] & first[1:, 1:-1, 1:-1]
        around = np.stack([cells[:, :-1, :-1], cells[:, 1:, :-1], cells[:, 1:, 1:], cells[:, :-1, 1:]], axis=-1)
        quads += [around[leaving], around[entering][:, ::-1]]
    return np.concatenate(quads)


def _project(body: Body, points: Array, times: int) -> Array:
    """Returns points moved onto the zero level by Newton steps along the gradient."""
    for _ in range(times):
        shifts = np.concatenate([points] + [points + step for step in _STEP * np.eye(3)])
        value, *ahead = body(shifts).reshape(4, -1)
        gradient = (np.stack(ahead, axis=1) - value[:, None]) / _STEP
        square = np.maximum(np.einsum("ij,ij->i", gradient, gradient), 0.05)
        points = points - gradient * (value / square)[:, None]
    return points


def _average_neighbours(vertices: Array, quads: np.ndarray) -> Array:
    """Returns vertices moved towards the mean of the quads around them, which smooths the net."""
    ends = np.roll(quads, 1, axis=1).ravel(), np.roll(quads, -1, axis=1).ravel()
    center = quads.ravel()
    total = 2.0 * np.bincount(center, minlength=len(vertices))
    mean = np.stack(
        [
            np.bincount(center, (x[ends[0]] + x[ends[1]]), minlength=len(vertices)) / np.maximum(total, 1.0)
            for x in vertices.T
        ],
        axis=1,
    )
    return 0.4 * vertices + 0.6 * mean


def _split_quads(vertices: Array, quads: np.ndarray) -> np.ndarray:
    """Returns two triangles per quad, split along its shorter diagonal."""
    a, b, c, d = quads.T
    short = np.linalg.norm(vertices[a] - vertices[c], axis=1) <= np.linalg.norm(vertices[b] - vertices[d], axis=1)
    first = np.where(short[:, None], np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(short[:, None], np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.concatenate([first, second]).astype(np.int32)
