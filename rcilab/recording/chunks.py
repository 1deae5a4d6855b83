r"""A file in whole blocks: what was written before a crash can be read, up to the last block that is whole.

    magic       8 bytes, b"\\x89RCIRUN\\n"
    version     u32
    blocks      kind (4 ASCII letters), length of the payload (u32), CRC-32 of kind and payload (u32), payload

All numbers are little-endian. A block counts only when all of it is there and its checksum is right; reading ends at
the first one that does not count. What the kinds mean is said in `run_file.py`.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

from rcilab.core.errors import InvalidValueError, VersionMismatchError

MAGIC = b"\x89RCIRUN\n"
VERSION = 1

_HEADER = struct.Struct("<8sI")
_BLOCK = struct.Struct("<4sII")


@dataclass(frozen=True, slots=True)
class Chunk:
    """One whole block."""

    kind: str
    payload: bytes


def encode_header() -> bytes:
    """Returns what a file begins with."""
    return _HEADER.pack(MAGIC, VERSION)


def encode_block(kind: str, payload: bytes) -> bytes:
    """Returns one block; `kind` has four letters."""
    name = kind.encode("ascii")
    return _BLOCK.pack(name, len(payload), zlib.crc32(name + payload)) + payload


def decode_blocks(content: bytes, name: str) -> tuple[Chunk, ...]:
    """Returns the blocks of a file up to the last whole one.

    Args:
        content: The file's.
        name: The file's name, for errors.

    Raises:
        InvalidValueError: It is no such file.
        VersionMismatchError: It was written by another version of this format.
    """
    if not content.startswith(MAGIC):
        problem = "is empty" if not content else "is no run: rcilab did not write it, or its beginning is missing"
        raise InvalidValueError("run file", name, problem).coded("no_run", file=name)
    if len(content) < _HEADER.size:
        raise InvalidValueError("run file", name, "ends before its first block; nothing was recorded in it").coded(
            "run_empty", file=name
        )
    _, version = _HEADER.unpack_from(content)
    if version != VERSION:
        advice = "read it with the rcilab that wrote it, and export it from there"
        raise VersionMismatchError(f"run file {name!r}", version, VERSION, advice)
    blocks: list[Chunk] = []
    place = _HEADER.size
    while place + _BLOCK.size <= len(content):
        kind, length, checksum = _BLOCK.unpack_from(content, place)
        payload = content[place + _BLOCK.size : place + _BLOCK.size + length]
        if len(payload) < length or zlib.crc32(kind + payload) != checksum:
            break
        blocks.append(Chunk(kind.decode("ascii", errors="replace"), payload))
        place += _BLOCK.size + length
    return tuple(blocks)
