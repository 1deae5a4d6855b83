"""Arrays in numpy's files, of which nobody knows yet whether they are sound."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from tokenize import TokenError
from zipfile import BadZipFile

import numpy as np

from rcilab.errors import InvalidValueError

SINGLE_ARRAY = "a single array"
"""The name of the array in a file that holds one without a name."""

_DAMAGE = (
    *(BadZipFile, zlib.error, EOFError, OSError, RuntimeError, struct.error),  # The archive; encrypted; other methods.
    *(ValueError, TypeError, SyntaxError, TokenError, LookupError, OverflowError, MemoryError),  # A header of an array.
)
"""What numpy and those it reads with raise on foreign or damaged bytes; a mistake in the code is none of them."""


def read_arrays(content: bytes, what: str, name: str, problem: str) -> dict[str, np.ndarray]:
    """Returns the arrays in the bytes of an .npz or .npy, by name.

    Args:
        content: The file's.
        what: What the file is, for the error.
        name: The file's name.
        problem: What the error says of it.

    Raises:
        InvalidValueError: The bytes are damaged, something else, or hold objects of Python's.
    """
    try:
        archive = np.load(BytesIO(content), allow_pickle=False)
        if isinstance(archive, np.ndarray):
            return {SINGLE_ARRAY: archive}
        with archive:
            return {key: archive[key] for key in archive.files}
    except _DAMAGE as error:
        raise InvalidValueError(what, name, problem) from error
