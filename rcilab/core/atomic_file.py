"""Atomic replacement of small files: a reader finds the old or the new content, also after a crash."""

from __future__ import annotations

import errno
import os
import stat
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import IO

from rcilab.core.error_base import InvalidValueError

_LARGEST_OWN = 32_000_000
"""Largest file of our own, [bytes]; tuning value: the longest programs of all arms take 20 million."""


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
        OSError: It cannot be read, is not a regular file, or is far larger than this program writes one.
        UnicodeDecodeError: It is not UTF-8 text.
    """
    return _read_regular(file, _require_own_size).decode()


def read_limited(file: Path, what: str, require_size: Callable[[int], None]) -> bytes:
    """Returns the content of a file.

    Args:
        file: The file.
        what: Kind of file, for the error, such as "program file".
        require_size: Called with the file's size, [bytes], before anything is read; raises where it is too large.

    Raises:
        InvalidValueError: The file does not exist, is not a regular file, or cannot be read.
    """
    try:
        return _read_regular(file, require_size)
    except FileNotFoundError as error:
        raise InvalidValueError(what, str(file), "does not exist").coded("no_file", file=str(file)) from error
    except OSError as error:
        raise InvalidValueError(what, str(file), f"cannot be read: {error.strerror}").coded(
            "file_unreadable", file=str(file)
        ) from error


def _read_regular(file: Path, require_size: Callable[[int], None]) -> bytes:
    """Returns the content of a regular file; a device has no end, and a named pipe may have no writer."""
    with open(file, "rb", opener=_open_without_waiting) as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(file))
        require_size(status.st_size)
        return stream.read(status.st_size + 1)


def _open_without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)


def _require_own_size(size: int) -> None:
    if size > _LARGEST_OWN:
        raise OSError(errno.EFBIG, f"{size / 1e6:.0f} MB are more than {_LARGEST_OWN / 1e6:.0f}")
