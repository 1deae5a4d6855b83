"""Safe reading of NumPy files: untrusted bytes of unknown size."""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Callable, Mapping
from io import BytesIO
from math import prod
from tokenize import TokenError
from typing import IO, TypeAlias
from zipfile import BadZipFile, ZipFile

import numpy as np

from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import require_bytes

SINGLE_ARRAY = "a single array"
"""Name for the array of a file that stores an unnamed one."""

_DAMAGE = (
    *(
        BadZipFile,
        zlib.error,
        EOFError,
        OSError,
        RuntimeError,
        struct.error,
    ),  # Of the archive: damaged, encrypted, unknown compression.
    *(ValueError, TypeError, SyntaxError, TokenError, LookupError, OverflowError),  # Of an array's header.
)
"""Exceptions that NumPy and zipfile raise on foreign or damaged bytes."""

_MAX_HEADER = 10_012  # [bytes] Header of an array; NumPy accepts one of 10 000 characters.
_NUMBER_BYTES = 8  # Size of a double, or of an item of a list, which every element becomes.
_MAX_MEMBERS = 1000  # Tuning value: a motion has 9 arrays.


Shapes: TypeAlias = Mapping[str, tuple[int, ...]]


def read_arrays(
    content: bytes,
    what: str,
    name: str,
    problem: str,
    max_rows: int,
    require_shapes: Callable[[Shapes], None] = lambda shapes: None,
) -> dict[str, np.ndarray]:
    """Returns the arrays in the bytes of an .npz or .npy, by name.

    Args:
        content: Bytes of the file.
        what: Kind of file, for the error.
        name: Name of the file, for the error.
        problem: Text of the error.
        max_rows: Bound of the content, see `file_bounds`.
        require_shapes: Called with the arrays' shapes by name before anything is unpacked; raises an error if they do
            not fit.

    Raises:
        InvalidValueError: The bytes are damaged, not a NumPy file, too many when unpacked, or contain Python objects.
    """
    try:
        size, shapes = _read_headers(content)
    except (*_DAMAGE, MemoryError) as error:  # MemoryError: the parser, on a header with too many brackets.
        raise InvalidValueError(what, name, problem) from error
    require_bytes(size, max_rows, what, name)
    require_shapes(shapes)
    try:
        archive = np.load(BytesIO(content), allow_pickle=False)
        if isinstance(archive, np.ndarray):
            return {SINGLE_ARRAY: archive}
        with archive:
            return {key: archive[key] for key in archive.files}
    except _DAMAGE as error:
        raise InvalidValueError(what, name, problem) from error


def contains_numbers(array: np.ndarray) -> bool:
    """Returns whether the elements of an array are real numbers within the range of a double."""
    return np.can_cast(array.dtype, np.float64)


def _read_headers(content: bytes) -> tuple[int, Shapes]:
    """Returns the unpacked size of the arrays, [bytes], and their shapes."""
    if not content.startswith(b"PK"):
        size, shape = _read_header(BytesIO(content))
        return size, {SINGLE_ARRAY: shape}
    total, shapes = 0, dict[str, tuple[int, ...]]()
    with ZipFile(BytesIO(content)) as archive:
        members = archive.infolist()
        if len(members) > _MAX_MEMBERS:
            raise ValueError(f"{len(members)} arrays are more than {_MAX_MEMBERS}")
        for member in members:
            with archive.open(member) as stream:
                size, shape = _read_header(stream)
            total += max(member.file_size, size)
            shapes[member.filename.removesuffix(".npy")] = shape
    return total, shapes


def _read_header(stream: IO[bytes]) -> tuple[int, tuple[int, ...]]:
    header = BytesIO(stream.read(_MAX_HEADER))  # NumPy would read the length in the header, up to 4 GB.
    version = np.lib.format.read_magic(header)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(header)
    return min(prod(shape) * max(dtype.itemsize, _NUMBER_BYTES), sys.maxsize), shape
