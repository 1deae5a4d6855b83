"""Convex parts of a mesh, which together have its shape: distances are computed between convex solids.

The decomposition is that of CoACD (Wei et al. 2022, "Approximate convex decomposition for 3D meshes with
collision-aware concavity and tree search"). It takes seconds and is kept in the user's cache folder.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TypeAlias
from zipfile import BadZipFile

import numpy as np

from rcilab.cell.cell import Cell
from rcilab.cell.shapes import MeshShape
from rcilab.core.arrays import Array, readonly_copy
from rcilab.core.atomic_file import replacing
from rcilab.core.cache_folder import cache_folder
from rcilab.robots.mesh import Faces

CONCAVITY = 0.05
"""Largest concavity of a part, relative to the size of the mesh: the default of CoACD."""
MOST_PARTS = 24
"""Largest number of parts; tuning value: more take longer in every check."""
_SEARCH = 60
"""Steps of the search; with these and the coarser samples it takes a tenth of the default's time."""
_FLAT = 1e-4  # [m] Thickness that a flat mesh gets.

ConvexPart: TypeAlias = tuple[Array, Faces]
"""Vertices, shape (V, 3), [m], and faces, shape (F, 3)."""


@lru_cache(maxsize=128)
def convex_parts(mesh: MeshShape) -> tuple[ConvexPart, ...]:
    """Returns the convex parts of a mesh; one for a convex mesh. From memory, the cache folder, or computed."""
    file = cache_folder() / "convex" / f"{mesh.digest}-{CONCAVITY:g}-{MOST_PARTS}.npz"
    kept = _read(file)
    if kept:
        return kept
    parts = _decompose(mesh)
    _keep(file, parts)
    return parts


def prepare_meshes(cell: Cell) -> None:
    """Computes the convex parts of all meshes of a cell, unless they are known: it takes seconds for each."""
    for shape in _meshes(cell):
        convex_parts(shape)


def has_meshes(cell: Cell) -> bool:
    """Returns whether a cell has meshes to prepare."""
    return bool(_meshes(cell))


def _meshes(cell: Cell) -> list[MeshShape]:
    carried = () if cell.tool is None else cell.tool.solids_at()
    held = [solid for part in cell.parts for solid in part.solids]
    shapes = (*(obstacle.shape for obstacle in cell.obstacles), *(solid.shape for solid in (*carried, *held)))
    return [shape for shape in shapes if isinstance(shape, MeshShape)]


def _decompose(mesh: MeshShape) -> tuple[ConvexPart, ...]:
    import trimesh

    whole = trimesh.Trimesh(mesh.vertices, mesh.faces)
    whole.merge_vertices()
    if whole.is_watertight and whole.is_convex:
        return (_hull(mesh.vertices),)
    import coacd

    coacd.set_log_level("error")
    pieces = coacd.run_coacd(
        coacd.Mesh(np.asarray(whole.vertices), np.asarray(whole.faces)),
        threshold=CONCAVITY,
        max_convex_hull=MOST_PARTS,
        mcts_iterations=_SEARCH,
        mcts_nodes=10,
        resolution=1000,
        preprocess_resolution=30,
        seed=0,
    )
    return tuple(_hull(np.asarray(vertices)) for vertices, _ in pieces) or (_hull(mesh.vertices),)


def _hull(vertices: Array) -> ConvexPart:
    """Returns the convex hull of points; of points in a plane, of a thin slab around it."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(vertices)
    except QhullError:
        offsets = _FLAT * np.concatenate((np.eye(3), -np.eye(3)))
        vertices = (vertices[:, np.newaxis] + offsets).reshape(-1, 3)
        hull = ConvexHull(vertices)
    used = np.unique(hull.simplices)
    numbers = np.zeros(len(vertices), dtype=np.int32)
    numbers[used] = np.arange(len(used), dtype=np.int32)
    triangles = hull.simplices.astype(np.int32)
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0.0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return readonly_copy(vertices[used]), numbers[triangles]


def _read(file: Path) -> tuple[ConvexPart, ...]:
    """Returns the parts in a file; none if it does not exist or cannot be read."""
    try:
        with np.load(file, allow_pickle=False) as content:
            count = int(content["count"])
            return tuple((readonly_copy(content[f"v{i}"]), content[f"f{i}"]) for i in range(count))
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return ()


def _keep(file: Path, parts: tuple[ConvexPart, ...]) -> None:
    arrays = {"count": np.array(len(parts))}
    for i, (vertices, faces) in enumerate(parts):
        arrays |= {f"v{i}": vertices, f"f{i}": faces}
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with replacing(file) as stream:
            np.savez_compressed(stream, **arrays)  # pyright: ignore[reportArgumentType]
    except OSError:
        return  # It is computed again the next time.
