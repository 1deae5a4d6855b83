"""Files of cells: JSON that names the files of its meshes, or a ZIP archive that contains them."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable
from io import BytesIO
from os import PathLike, fspath, path
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, TypeVar

from rcilab.cell.cell_file import cell_text, read_cell
from rcilab.cell.mesh_file import load_mesh, mesh_stl, read_mesh
from rcilab.cell.shapes import MeshShape
from rcilab.core.arrays import described
from rcilab.core.atomic_file import read_limited, replacing
from rcilab.core.errors import InvalidValueError
from rcilab.motion.located_json import require_length

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell

T = TypeVar("T")

LARGEST_ARCHIVE = 200_000_000
"""Largest size of an archive, packed or unpacked, [bytes]; a tuning value."""
_TEXT = "cell.json"
_SAME_TIME = (2000, 1, 1, 0, 0, 0)  # Of every entry: equal cells are equal files.


def save_cell(cell: Cell, file: str | PathLike[str]) -> None:
    """Writes a cell as .json, which names the files of its meshes, or as .zip, which contains them.

    Raises:
        InvalidValueError: The name has another ending, the file cannot be written, or a mesh for .json has no file.
    """
    target = _as_path(file)
    if target.suffix.lower() == ".zip":
        content = pack_cell(cell)
    elif target.suffix.lower() == ".json":
        content = cell_text(cell, lambda shape: _file_of(shape, target.parent)).encode()
    else:
        raise InvalidValueError("cell file", str(target), "must end in .json or .zip")
    try:
        with replacing(target) as stream:
            stream.write(content)
    except OSError as error:
        raise InvalidValueError("cell file", str(target), f"cannot be written: {error.strerror}").coded(
            "file_unwritable", file=str(target)
        ) from error


def load_cell(file: str | PathLike[str], build: Callable[..., T]) -> T:
    """Returns the cell in a file, .json or .zip; `build` as of `read_cell`.

    Raises:
        InvalidValueError: The file does not exist, or its cell is not valid; the message names the line.
        VersionMismatchError: It has another version of this format.
    """
    source = _as_path(file)
    if source.suffix.lower() == ".zip":
        return unpack_cell(read_limited(source, "cell file", _require_archive), source.name, build)
    content = read_limited(source, "cell file", lambda size: require_length(size, source.name))
    return read_cell(content, source.name, lambda mesh, scale: load_mesh(source.parent / mesh, scale=scale), build)


def pack_cell(cell: Cell) -> bytes:
    """Returns a cell as a ZIP archive: cell.json, and its meshes as STL in metres. Equal cells are equal archives."""
    meshes: dict[str, MeshShape] = {}

    def name_mesh(shape: MeshShape) -> tuple[str, float]:
        name = f"meshes/{shape.digest[:12]}.stl"
        meshes[name] = shape
        return name, 1.0

    text, archive = cell_text(cell, name_mesh), BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as entries:
        for name, content in ((_TEXT, text.encode()), *((name, mesh_stl(mesh)) for name, mesh in meshes.items())):
            entries.writestr(zipfile.ZipInfo(name, _SAME_TIME), content, zipfile.ZIP_DEFLATED)
    return archive.getvalue()


def unpack_cell(content: bytes, name: str, build: Callable[..., T]) -> T:
    """Returns the cell in a ZIP archive; no file outside it is read.

    Args:
        content: The archive.
        name: Its name, for errors.
        build: As of `read_cell`.

    Raises:
        InvalidValueError: It is not an archive of a cell, or the cell is not valid.
        VersionMismatchError: The cell has another version of its format.
    """
    entries = _unpack(content, name)
    if _TEXT not in entries:
        raise InvalidValueError("cell file", name, f"contains no {_TEXT}; save the cell as .zip again")
    require_length(len(entries[_TEXT]), _TEXT)

    def find_mesh(file: str, scale: float) -> MeshShape:
        inside = str(PurePosixPath(file))
        if inside not in entries:
            raise InvalidValueError("file", file, f"is not in {name}; save the cell as .zip again")
        return read_mesh(entries[inside], inside, scale=scale)

    return read_cell(entries[_TEXT], f"{name}, {_TEXT}", find_mesh, build)


def _unpack(content: bytes, name: str) -> dict[str, bytes]:
    """Returns the files in a ZIP archive."""
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            infos = archive.infolist()
            _require_archive(sum(info.file_size for info in infos))
            return {info.filename: archive.read(info) for info in infos}
    except InvalidValueError:
        raise
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError, ValueError) as error:
        # RuntimeError: a password is needed; NotImplementedError: an unknown compression; ValueError: a wrong offset.
        raise InvalidValueError("cell file", name, f"is not a ZIP archive that can be read: {error}") from error


def read_uploaded(content: bytes, name: str, build: Callable[..., T]) -> T:
    """Returns the cell in an uploaded file, .json or .zip; no file of this machine is read.

    Args:
        content: The file.
        name: Its name.
        build: As of `read_cell`.

    Raises:
        InvalidValueError: The cell is not valid, or its meshes are in other files.
        VersionMismatchError: The cell has another version of its format.
    """
    if name.lower().endswith(".zip"):
        _require_archive(len(content))
        return unpack_cell(content, name, build)
    require_length(len(content), name)
    return read_cell(content, name, _refuse_mesh, build)


def _refuse_mesh(file: str, scale: float) -> MeshShape:
    problem = 'is another file; upload the cell with its meshes, made by Cell.load("cell.json").save("cell.zip")'
    raise InvalidValueError("file", file, problem)


def _file_of(shape: MeshShape, folder: Path) -> tuple[str, float]:
    if not shape.file:
        raise InvalidValueError("mesh", repr(shape), "was not read from a file; save the cell as .zip")
    return path.relpath(shape.file, folder), shape.scale


def _require_archive(size: int) -> None:
    if size > LARGEST_ARCHIVE:
        problem = f"has {size / 1e6:.0f} MB, an archive of a cell at most {LARGEST_ARCHIVE / 1e6:g}"
        raise InvalidValueError("cell file", "archive", problem)


def _as_path(file: object) -> Path:
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("cell file", described(file), "must be a file name")
    return Path(fspath(file))
