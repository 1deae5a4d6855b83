"""A link to a view: the arm, its cell and its program as text in the fragment of an address."""

from __future__ import annotations

import base64
import binascii
import json
import zlib
from dataclasses import dataclass
from typing import Any

from rcilab.cell.cell import Cell
from rcilab.cell.cell_file import cell_text
from rcilab.cell.cell_storage import read_uploaded
from rcilab.cell.shapes import MeshShape
from rcilab.core.errors import InvalidValueError, ModelError, VersionMismatchError
from rcilab.motion.program import Program
from rcilab.robots import describe_robot

LONGEST_LINK = 8000
"""Largest number of characters; longer addresses are cut by mail and chat programs."""
_VERSION = 1
_MOST_BYTES = 1_000_000  # [bytes] Unpacked; tuning value: a link of the largest length has less.
_KEYS = frozenset({"version", "model", "program", "cell"})


@dataclass(frozen=True, slots=True, kw_only=True)
class PageLink:
    """What a link opens."""

    model: str
    """Name of the arm."""
    program: Program | None = None
    cell: Cell | None = None


@dataclass(frozen=True, slots=True)
class LinkQuestion:
    """A link that waits for the answer of the page that opened it."""

    page: int | None
    link: PageLink


def encode_link(link: PageLink) -> str:
    """Returns the text of a link: compressed JSON in base64url.

    Raises:
        InvalidValueError: The cell has a mesh, which is too large for a link.
    """
    content: dict[str, Any] = {"version": _VERSION, "model": link.model}
    if link.program is not None:
        content["program"] = json.loads(link.program.to_json())
    if link.cell is not None:
        content["cell"] = json.loads(cell_text(link.cell, _refuse_mesh))
    packed = zlib.compress(json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode(), 9)
    return base64.urlsafe_b64encode(packed).decode().rstrip("=")


def decode_link(text: str) -> PageLink:
    """Returns what a link opens; no file of this machine is read.

    Raises:
        InvalidValueError: The text is damaged, or has something else.
        VersionMismatchError: It has another version.
    """
    content = _unpack(text)
    if content.get("version") != _VERSION:
        raise VersionMismatchError("link", content.get("version"), _VERSION, "open it with the rcilab that made it")
    program, cell = content.get("program"), content.get("cell")
    try:
        if not content.keys() <= _KEYS:
            raise _damaged()
        model = describe_robot(content["model"]).name
    except (KeyError, ModelError) as error:
        raise _damaged() from error
    found = PageLink(
        model=model,
        program=None if program is None else Program.from_json(json.dumps(program), "link"),
        cell=None if cell is None else read_uploaded(json.dumps(cell).encode(), "link", Cell),
    )
    if any(part is not None and part.model != model for part in (found.program, found.cell)):
        raise _damaged()
    return found


def _unpack(text: str) -> dict[str, Any]:
    try:
        packed = base64.b64decode(text + "=" * (-len(text) % 4), altchars="-_", validate=True)
        unpacker = zlib.decompressobj()
        content = json.loads(unpacker.decompress(packed, _MOST_BYTES))
        if not unpacker.eof or not isinstance(content, dict):
            raise _damaged()
    except (binascii.Error, zlib.error, ValueError, RecursionError) as error:
        raise _damaged() from error
    return content


def _damaged() -> InvalidValueError:
    problem = "is damaged: it has been cut or changed; have it sent again, or the files instead"
    return InvalidValueError("link", "the text", problem).coded("link_damaged")


def _refuse_mesh(shape: MeshShape) -> tuple[str, float]:
    raise InvalidValueError("cell", shape.file or "a mesh", "is too large for a link; send the cell as a file").coded(
        "link_mesh"
    )
