"""Meshes from files, STL, OBJ, glTF, PLY, and as STL."""

from __future__ import annotations

from io import BytesIO
from os import PathLike, fspath
from pathlib import Path

import numpy as np

from rcilab.cell.shapes import MeshShape
from rcilab.core.arrays import as_number, described
from rcilab.core.errors import InvalidValueError
from rcilab.robots.mesh import Mesh, encode_stl

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
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("mesh file", described(file), "must be a file name")
    source = Path(fspath(file))
    require_ending(source.name)
    try:
        _require_size(source.stat().st_size, source.name)
    except OSError as error:
        raise InvalidValueError("file", str(source), f"cannot be read: {error.strerror}") from error
    return _read(source, source.name, scale, str(source))


def read_mesh(content: bytes, name: str, *, scale: float = 1.0) -> MeshShape:
    """Returns the mesh in the content of a file, as `load_mesh`; it belongs to no file.

    Args:
        content: The content.
        name: Name of the file, whose ending gives the format.
        scale: Factor on its lengths, to metres.

    Raises:
        InvalidValueError: It is not a mesh, or the ending is unknown.
    """
    require_ending(name)
    _require_size(len(content), name)
    return _read(BytesIO(content), name, scale, "")


def mesh_stl(shape: MeshShape) -> bytes:
    """Returns a mesh as binary STL, in metres."""
    return encode_stl(Mesh(shape.vertices, shape.faces))


def require_ending(name: str) -> None:
    """Requires the name of a file with a mesh.

    Raises:
        InvalidValueError: It has another ending.
    """
    if Path(name).suffix.lower() not in ENDINGS:
        raise InvalidValueError("file", name, f"must end in one of: {' '.join(ENDINGS)}")


def _require_size(size: int, name: str) -> None:
    if size > _LARGEST_FILE:
        raise InvalidValueError("file", name, f"has {size / 1e6:.0f} MB, a mesh at most {_LARGEST_FILE / 1e6:g}")


def _read(source: Path | BytesIO, name: str, scale: float, file: str) -> MeshShape:
    import trimesh

    factor = as_number(scale, "scale")
    if not 0.0 < factor < float("inf"):
        raise InvalidValueError("scale", factor, "must be above 0")
    try:
        mesh = trimesh.load_scene(source, file_type=Path(name).suffix[1:].lower()).to_mesh()
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except Exception as error:  # trimesh raises whatever its parsers meet.
        raise InvalidValueError("file", name, f"is not a mesh that can be read: {error}") from error
    if not len(faces):
        raise InvalidValueError("file", name, "has no triangles")
    return MeshShape(vertices=factor * vertices, faces=faces, file=file, scale=factor)
