r"""A file of chunks with checksums: after a crash it can be read up to the last complete chunk.

    magic       8 bytes, b"\\x89RCIRUN\\n"
    version     u32
    chunks      kind (4 ASCII letters), length of the payload (u32), CRC-32 of kind and payload (u32), payload

All numbers are little-endian. Reading ends at the first chunk that is incomplete or has a wrong checksum. The kinds are
described in `run_file.py`.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from os import SEEK_END
from typing import IO

from rcilab.core.errors import InvalidValueError, VersionMismatchError

MAGIC = b"\x89RCIRUN\n"
VERSION = 1

_HEADER = struct.Struct("<8sI")
_BLOCK = struct.Struct("<4sII")


@dataclass(frozen=True, slots=True)
class Chunk:
    """One complete chunk."""

    kind: str
    payload: bytes


def encode_header() -> bytes:
    """Returns the first bytes of a file."""
    return _HEADER.pack(MAGIC, VERSION)


def encode_chunk(kind: str, payload: bytes) -> bytes:
    """Returns one chunk; `kind` has four letters."""
    name = kind.encode("ascii")
    return _BLOCK.pack(name, len(payload), zlib.crc32(name + payload)) + payload


def decode_chunks(content: bytes, name: str, max_chunks: int) -> tuple[Chunk, ...]:
    """Returns the chunks of a file up to the last complete one.

    Args:
        content: Content of the file.
        name: Name of the file, for errors.
        max_chunks: Largest number of chunks.

    Raises:
        InvalidValueError: It is not such a file, or has more chunks.
        VersionMismatchError: It was written by another version of this format.
    """
    if not content.startswith(MAGIC):
        problem = "is empty" if not content else "is not a run: rcilab did not write it, or its beginning is missing"
        if not name.endswith(".rcirun"):
            problem += "; the files of runs are .rcirun"
        raise InvalidValueError("run file", name, problem).coded("no_run", file=name)
    if len(content) < _HEADER.size:
        raise InvalidValueError("run file", name, "ends before its first cycle; nothing was recorded in it").coded(
            "run_empty", file=name
        )
    _, version = _HEADER.unpack_from(content)
    if version != VERSION:
        advice = "read it with the rcilab that wrote it, and export it from there"
        raise VersionMismatchError(f"run file {name!r}", version, VERSION, advice)
    chunks: list[Chunk] = []
    offset = _HEADER.size
    while offset + _BLOCK.size <= len(content):
        kind, length, checksum = _BLOCK.unpack_from(content, offset)
        payload = content[offset + _BLOCK.size : offset + _BLOCK.size + length]
        if len(payload) < length or zlib.crc32(payload, zlib.crc32(kind)) != checksum:
            break
        if len(chunks) == max_chunks:
            raise InvalidValueError("run file", name, f"is damaged: it has more than {max_chunks} chunks").coded(
                "run_damaged", file=name
            )
        chunks.append(Chunk(kind.decode("ascii", errors="replace"), payload))
        offset += _BLOCK.size + length
    return tuple(chunks)


def read_chunk_ends(stream: IO[bytes], kinds: tuple[str, ...]) -> dict[str, bytes]:
    """Returns the last complete chunk of each of these kinds as it is in a file, without reading the others.

    A checksum is not verified here; `decode_chunks` does that.

    Args:
        stream: The file, at its beginning.
        kinds: Kinds of chunks.
    """
    size, found, offset = stream.seek(0, SEEK_END), dict[str, tuple[int, int]](), _HEADER.size
    while offset + _BLOCK.size <= size:
        stream.seek(offset)
        kind, length, _ = _BLOCK.unpack(stream.read(_BLOCK.size))
        if not kind.isalpha() or offset + _BLOCK.size + length > size:
            break
        found[kind.decode("ascii", errors="replace")] = offset, _BLOCK.size + length
        offset += _BLOCK.size + length
    chunks: dict[str, bytes] = {}
    for kind in kinds:
        if kind in found:
            stream.seek(found[kind][0])
            chunks[kind] = stream.read(found[kind][1])
    return chunks


def is_damaged(content: bytes, chunks: tuple[Chunk, ...]) -> bool:
    """Returns whether what follows the chunks of a file is damaged; False where the file ends within a chunk.

    Args:
        content: Content of the file.
        chunks: Its chunks up to the last complete one, of `decode_chunks`.
    """
    rest = content[_HEADER.size + sum(_BLOCK.size + len(chunk.payload) for chunk in chunks) :]
    if len(rest) < _BLOCK.size:
        return False
    kind, length, _ = _BLOCK.unpack_from(rest)
    return not kind.isalpha() or length <= len(rest) - _BLOCK.size
