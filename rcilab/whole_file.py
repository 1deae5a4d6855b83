"""Small files that are exchanged as a whole: whoever reads meets the old one or the new one, also after a crash."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from rcilab.errors import InvalidValueError


def write_whole(file: Path, text: str, *, survives_power_loss: bool = True) -> None:
    """Writes a text file, and the folders it is in; nothing of it is left where that fails.

    Args:
        file: Where.
        text: What.
        survives_power_loss: Whether to wait until the disk has it; a killed process loses nothing in any case.

    Raises:
        OSError: It cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=file.parent, prefix=f".{file.stem}-")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as out:
            out.write(text)
            if survives_power_loss:
                out.flush()
                os.fsync(out.fileno())
        os.replace(temporary, file)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def read_whole(file: Path, what: str, most: int = -1) -> bytes:
    """Returns what is in a file.

    Args:
        file: Where.
        what: What it should be, for the error: "program file".
        most: Bytes that are read at most; -1 is all.

    Raises:
        InvalidValueError: There is none, or it cannot be read.
    """
    try:
        with file.open("rb") as stream:
            return stream.read(most)
    except FileNotFoundError as error:
        raise InvalidValueError(what, str(file), "does not exist").coded("no_file", file=str(file)) from error
    except OSError as error:
        raise InvalidValueError(what, str(file), f"cannot be read: {error.strerror}").coded(
            "file_unreadable", file=str(file)
        ) from error
