"""Atomic replacement of small files: a reader finds the old or the new content, also after a crash."""

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
    """Opens a stream whose content replaces a file once it is complete; after a failure the file is unchanged.

    A symbolic link stays a link. Anything but a regular file (/dev/stdout, a pipe) is written to directly.

    Args:
        file: The file; its folder must exist.
        survives_power_loss: Whether to wait until the data is on the disk. A killed process loses nothing in any case.

    Raises:
        OSError: The file cannot be written.
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
    """Returns the permissions of a file, or those of a new one."""
    try:
        mode = path.stat().st_mode & 0o777
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    return mode


def write_atomic(file: Path, text: str, *, survives_power_loss: bool = True) -> None:
    """Writes a text file and creates its folders; after a failure the file is unchanged.

    Args:
        file: The file.
        text: Its new content.
        survives_power_loss: Whether to wait until the data is on the disk. A killed process loses nothing in any case.

    Raises:
        OSError: The file cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with replacing(file, survives_power_loss=survives_power_loss) as stream:
        stream.write(text.encode())


def read_own_text(file: Path) -> str:
    """Returns the text of a file that this program writes itself, in a folder of the user.

    Raises:
        OSError: It cannot be read, or is not a regular file; reading a named pipe would block forever.
        UnicodeDecodeError: It is not UTF-8 text.
    """
    with open(os.open(file, os.O_RDONLY | os.O_NONBLOCK), "rb") as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(file))
        return stream.read().decode()


def read_limited(file: Path, what: str, max_bytes: int) -> bytes:
    """Returns the content of a file, up to a number of bytes.

    Args:
        file: The file.
        what: Kind of file, for the error, such as "program file".
        max_bytes: Largest number of bytes to read.

    Raises:
        InvalidValueError: The file does not exist or cannot be read.
    """
    try:
        with file.open("rb") as stream:
            status = os.fstat(stream.fileno())  # Allocate the file's size, not the bound.
            return stream.read(min(max_bytes, status.st_size + 1) if stat.S_ISREG(status.st_mode) else max_bytes)
    except FileNotFoundError as error:
        raise InvalidValueError(what, str(file), "does not exist").coded("no_file", file=str(file)) from error
    except OSError as error:
        raise InvalidValueError(what, str(file), f"cannot be read: {error.strerror}").coded(
            "file_unreadable", file=str(file)
        ) from error
