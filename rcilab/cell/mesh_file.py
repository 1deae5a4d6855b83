"""Meshes from files: STL, OBJ, glTF, PLY."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path

import numpy as np

from rcilab.cell.shapes import MeshShape
from rcilab.core.arrays import as_number, described
from rcilab.core.errors import InvalidValueError

ENDINGS = (".stl", ".obj", ".glb", ".gltf", ".ply")
_LARGEST_FILE = 50_000_000  # [bytes] 200 000 triangles as text have 40 million.


def load_mesh(file: str | PathLike[str], *, scale: float = 1.0) -> MeshShape:
    """Returns the mesh in a file; several bodies become one mesh.

    Args:
        file: Its name; .stl, .obj, .glb, .gltf or .ply.
        scale: Factor on its lengths, to metres: 0.001 for millimetres.

    Raises:
        InvalidValueError: The file does not exist, has another ending, or has no triangles.
    """
    import trimesh

    if not isinstance(file, str | PathLike):
        raise InvalidValueError("mesh file", described(file), "must be a file name")
    source = Path(fspath(file))
    if source.suffix.lower() not in ENDINGS:
        raise InvalidValueError("file", source.name, f"must end in one of: {' '.join(ENDINGS)}")
    factor = as_number(scale, "scale")
    if not 0.0 < factor < float("inf"):
        raise InvalidValueError("scale", factor, "must be above 0")
    try:
        size = source.stat().st_size
    except OSError as error:
        raise InvalidValueError("file", str(source), f"cannot be read: {error.strerror}") from error
    if size > _LARGEST_FILE:
        raise InvalidValueError("file", source.name, f"has {size / 1e6:.0f} MB, a mesh at most {_LARGEST_FILE / 1e6:g}")
    try:
        mesh = trimesh.load_scene(source, file_type=source.suffix[1:].lower()).to_mesh()
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except Exception as error:  # trimesh raises whatever its parsers meet.
        raise InvalidValueError("file", source.name, f"is not a mesh that can be read: {error}") from error
    if not len(faces):
        raise InvalidValueError("file", source.name, "has no triangles")
    return MeshShape(vertices=factor * vertices, faces=faces, file=str(source), scale=factor)
