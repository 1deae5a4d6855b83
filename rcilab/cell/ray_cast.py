"""Where a line of sight meets the surface of a cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rcilab.cell.cell import Cell
from rcilab.cell.shape_mesh import solid_mesh
from rcilab.core.arrays import Array, Vector3, as_vector
from rcilab.core.errors import InvalidValueError
from rcilab.core.spatial import Pose

_PARALLEL = 1e-12  # A triangle that a ray sees from its edge is not hit.
_FARTHEST = 10.0  # [m] Tuning value: beyond any reach; the floor has no end.


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoint:
    """A point on a surface."""

    position: Vector3
    """In base, shape (3,), [m]."""
    normal: Vector3
    """Unit vector out of the surface, in base, shape (3,)."""

    def facing_tool(self) -> Pose:
        """Returns the pose of a tool at this point, its z axis against the normal.

        Its x axis is as near to -x of base as possible, on a surface whose normal is along x to -z.
        """
        z = -self.normal
        wanted = np.array((-1.0, 0.0, 0.0) if abs(z[0]) < np.cos(np.pi / 4.0) else (0.0, 0.0, -1.0))
        x = wanted - (wanted @ z) * z
        x /= np.linalg.norm(x)
        T = np.eye(4)
        T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = x, np.cross(z, x), z, self.position
        return Pose.from_matrix(T)


def cast_ray(cell: Cell | None, origin: ArrayLike, direction: ArrayLike) -> SurfacePoint | None:
    """Returns the first point of an obstacle or of the floor on a ray, or None.

    Args:
        cell: The cell; None: only the floor through the base.
        origin: Where the ray begins, in base, shape (3,), [m].
        direction: Its direction, shape (3,), of any length.

    Raises:
        InvalidValueError: A vector is not valid.
    """
    eye, ray = as_vector(origin, 3, "origin", "m"), as_vector(direction, 3, "direction")
    if not float(np.linalg.norm(ray)) > 0.0:
        raise InvalidValueError("direction", ray.tolist(), "has no direction: its length is zero")
    ray = ray / np.linalg.norm(ray)
    hits = [] if cell is None else [_on_mesh(eye, ray, cell, obstacle.name) for obstacle in cell.obstacles]
    floor = 0.0 if cell is None else cell.floor_height
    if floor is not None and ray[2] < -_PARALLEL and eye[2] > floor:
        hits.append(((floor - eye[2]) / ray[2], np.array((0.0, 0.0, 1.0))))
    distance, normal = min(hits, key=lambda hit: hit[0], default=(np.inf, np.zeros(3)))
    position = eye + distance * ray if np.isfinite(distance) else eye
    if not np.isfinite(distance) or float(np.abs(position).max()) > _FARTHEST:
        return None
    return SurfacePoint(position, normal)


def _on_mesh(eye: Array, ray: Array, cell: Cell, name: str) -> tuple[float, Array]:
    """Returns the distance to an obstacle, infinite without a hit, and the normal there (Moeller, Trumbore 1997)."""
    mesh = solid_mesh(cell.solid(name))
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    first, second = b - a, c - a
    across = np.cross(ray, second)
    det = (first * across).sum(axis=1)
    front = det > _PARALLEL  # Seen from outside.
    scale = 1.0 / np.where(front, det, 1.0)
    away = eye - a
    u = scale * (away * across).sum(axis=1)
    turned = np.cross(away, first)
    v = scale * (turned @ ray)
    distance = scale * (turned * second).sum(axis=1)
    edge = -1e-9  # Between two triangles, a ray meets one of them.
    hit = front & (u >= edge) & (v >= edge) & (u + v <= 1.0 - edge) & (distance > 0.0)
    if not hit.any():
        return np.inf, np.zeros(3)
    nearest = int(np.where(hit, distance, np.inf).argmin())
    normal = np.cross(first[nearest], second[nearest])
    return float(distance[nearest]), normal / np.linalg.norm(normal)
