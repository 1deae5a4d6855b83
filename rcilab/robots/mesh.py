"""Triangle meshes, bodies of revolution, and their encoding as binary STL."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rcilab.core.arrays import Array

Faces: TypeAlias = NDArray[np.int32]

AxisName = Literal["x", "y", "z"]


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A triangle mesh. Faces that share a vertex are shaded smoothly; at a crease vertices are duplicated."""

    vertices: Array
    """Shape (V, 3), [m]."""
    faces: Faces
    """Indices into `vertices`, counter-clockwise seen from outside, shape (F, 3)."""

    def moved(self, offset: ArrayLike) -> Mesh:
        """Returns the mesh shifted by a vector, [m]."""
        return Mesh(self.vertices + np.asarray(offset, dtype=np.float64), self.faces)


def shrink(mesh: Mesh, depth: float) -> Mesh:
    """Returns the mesh with every vertex moved inward along its normal by `depth`, [m]."""
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.stack(
        [np.bincount(mesh.faces.ravel(), np.repeat(x, 3), minlength=len(mesh.vertices)) for x in cross.T], axis=1
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return Mesh(mesh.vertices - depth * normals, mesh.faces)


def merge_meshes(meshes: Sequence[Mesh]) -> Mesh:
    """Returns the meshes as one."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(
            [mesh.faces + np.int32(start) for mesh, start in zip(meshes, starts, strict=True)], dtype=np.int32
        ),
    )


def revolve(
    profile: Sequence[tuple[float, float]],
    *,
    axis: AxisName = "z",
    center: Sequence[float] = (0.0, 0.0, 0.0),
    segments: int = 48,
    crease: float = 35.0,
) -> Mesh:
    """Returns the body that a profile sweeps around an axis.

    Args:
        profile: Points (radius, height along the axis), [m], from low to high along the outside of the body.
        axis: The axis of revolution.
        center: Position of the profile's origin, [m].
        segments: Number of facets around.
        crease: A bend of the profile above this angle is a sharp edge, [deg].
    """
    radii, heights = np.array(profile, dtype=np.float64).T
    bends = np.diff(np.arctan2(np.diff(heights), np.diff(radii)))
    bends = np.abs((bends + np.pi) % (2.0 * np.pi) - np.pi)
    sharp = 1 + np.flatnonzero(bends > np.radians(crease))
    rows = np.sort(np.concatenate([np.arange(len(radii)), sharp]))  # Rows at creases are duplicated.
    angles = np.arange(segments) * (2.0 * np.pi / segments)
    r, h = radii[rows], heights[rows]
    ring = np.stack([np.outer(r, np.cos(angles)), np.outer(r, np.sin(angles))], axis=-1)
    points = np.concatenate([ring, np.broadcast_to(h[:, None, None], (*ring.shape[:2], 1))], axis=-1)
    faces: list[NDArray[np.int64]] = []
    current = np.arange(segments)
    following = (current + 1) % segments
    for row in range(len(rows) - 1):
        if rows[row] == rows[row + 1]:
            continue
        low, high = row * segments, (row + 1) * segments
        if r[row] > 0.0:
            faces.append(np.stack([low + current, low + following, high + following], axis=1))
        if r[row + 1] > 0.0:
            faces.append(np.stack([low + current, high + following, high + current], axis=1))
    order = {"z": (0, 1, 2), "x": (2, 0, 1), "y": (1, 2, 0)}[axis]  # Cyclic, so that the orientation of faces stays.
    vertices = points.reshape(-1, 3)[:, order] + np.asarray(center, dtype=np.float64)
    return Mesh(vertices, np.concatenate(faces).astype(np.int32))


def mirror_y(mesh: Mesh) -> Mesh:
    """Returns the mirror image in the plane y = 0, with outward faces."""
    return Mesh(mesh.vertices * (1.0, -1.0, 1.0), np.ascontiguousarray(mesh.faces[:, ::-1]))


def encode_stl(mesh: Mesh, title: str = "rcilab") -> bytes:
    """Returns a mesh as binary STL: 80 bytes of title, the count, then 50 bytes per triangle, little-endian, [m].

    Coordinates are rounded to 10 micrometres, so that the last bit of a sine does not change the file.
    """
    corners = np.round(mesh.vertices, 5).astype(np.float32)[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(cross, axis=1, keepdims=True)
    whole = lengths[:, 0] > 0.0
    records = np.zeros(int(whole.sum()), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("tag", "<u2")])
    records["normal"] = (cross / np.where(lengths > 0.0, lengths, 1.0))[whole]
    records["corners"] = corners[whole]
    return title.encode("ascii")[:80].ljust(80) + np.uint32(len(records)).astype("<u4").tobytes() + records.tobytes()
