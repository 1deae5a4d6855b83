"""Small files that are exchanged as a whole: whoever reads meets the old one or the new one, also after a crash."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import IO

from rcilab.core.error_base import InvalidValueError


@contextmanager
def replacing(file: str | PathLike[str], *, survives_power_loss: bool = False) -> Generator[IO[bytes]]:
    """Gives a stream whose content takes the place of a file once all of it is written; a failure leaves the file.

    A symbolic link stays one, and what is not a regular file (/dev/stdout, a pipe) is written to directly.

    Args:
        file: Where; its folder must exist.
        survives_power_loss: Whether to wait until the disk has it; a killed process loses nothing in any case.

    Raises:
        OSError: It cannot be written.
    """
    path = Path(file)
    if path.exists() and not path.is_file():
        with path.open("wb") as stream:
            yield stream
        return
    path = Path(os.path.realpath(path))
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-")
    try:
        with os.fdopen(handle, "wb") as stream:
            os.fchmod(handle, _mode_of(path))
            yield stream
            if survives_power_loss:
                stream.flush()
                os.fsync(handle)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _mode_of(path: Path) -> int:
    """Returns the permissions of a file, or those that a new one gets."""
    try:
        mode = path.stat().st_mode & 0o777
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    return mode


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
    with replacing(file, survives_power_loss=survives_power_loss) as stream:
        stream.write(text.encode())


def read_whole(file: Path, what: str, most: int) -> bytes:
    """Returns what is in a file.

    Args:
        file: Where.
        what: What it should be, for the error: "program file".
        most: Bytes that are read at most.

    Raises:
        InvalidValueError: There is none, or it cannot be read.
    """
    try:
        with file.open("rb") as stream:
            status = os.fstat(stream.fileno())  # A file is given as much room as it needs, not as it may.
            return stream.read(min(most, status.st_size + 1) if stat.S_ISREG(status.st_mode) else most)
    except FileNotFoundError as error:
        raise InvalidValueError(what, str(file), "does not exist").coded("no_file", file=str(file)) from error
    except OSError as error:
        raise InvalidValueError(what, str(file), f"cannot be read: {error.strerror}").coded(
            "file_unreadable", file=str(file)
        ) from error
