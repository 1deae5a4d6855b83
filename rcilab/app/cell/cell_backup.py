"""The cell in the saved state of the page: JSON, and each mesh once in a folder next to it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from rcilab.cell.cell import Cell
from rcilab.cell.cell_file import cell_text, read_cell
from rcilab.cell.mesh_file import load_mesh, mesh_stl
from rcilab.cell.shapes import MeshShape
from rcilab.core.atomic_file import replacing


class CellBackup:
    """Writes and reads the cells of one workbench.

    Args:
        folder: Folder of the meshes; created when there is one.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._used: set[str] = set()

    def text_of(self, cell: Cell) -> str:
        """Returns a cell as JSON; writes its meshes.

        Raises:
            OSError: A mesh cannot be written.
        """
        return cell_text(cell, self._store)

    def cell_of(self, text: str) -> Cell:
        """Returns the cell of a text.

        Raises:
            InvalidValueError: It is not valid, or a mesh is missing.
            VersionMismatchError: It has another version.
        """
        return read_cell(text.encode(), "saved cell", self._find, Cell)

    def clean(self) -> None:
        """Removes the meshes that no cell has used."""
        with suppress(OSError):
            for file in self._folder.glob("*.stl"):
                if file.name not in self._used:
                    file.unlink()

    def _store(self, shape: MeshShape) -> tuple[str, float]:
        name = f"{shape.digest[:16]}.stl"
        self._used.add(name)
        if not (self._folder / name).exists():
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            with replacing(self._folder / name) as stream:
                stream.write(mesh_stl(shape))
        return name, 1.0

    def _find(self, name: str, scale: float) -> MeshShape:
        self._used.add(Path(name).name)
        return load_mesh(self._folder / Path(name).name, scale=scale)
