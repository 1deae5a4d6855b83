"""The folder of recorded runs: its size, and deletion of old runs."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from rcilab.core.errors import InvalidValueError
from rcilab.recording.run_file import ENDING


@dataclass(frozen=True, slots=True)
class FolderStats:
    """Number and size of the recorded runs in a folder."""

    count: int
    size: int
    """[bytes]."""


def stored_runs(folder: str | PathLike[str]) -> FolderStats:
    """Returns number and total size of the runs in a folder; zeros if the folder does not exist."""
    sizes = [size for _, _, size in _runs(Path(folder))]
    return FolderStats(len(sizes), sum(sizes))


def keep_newest(folder: str | PathLike[str], count: int) -> FolderStats:
    """Deletes all runs of a folder except the newest ones; returns number and size of the deleted ones.

    Only files with the ending of a run, directly in the folder, are deleted.

    Args:
        folder: Folder of the runs.
        count: Number of runs to keep, 0 or more.

    Raises:
        InvalidValueError: The count is negative.
    """
    if count < 0:
        raise InvalidValueError("count", count, "is negative: 0 keeps none")
    deleted, freed = 0, 0
    for _, path, size in sorted(_runs(Path(folder)), reverse=True)[count:]:
        with suppress(OSError):  # No permission, or another process removed it first.
            path.unlink()
            deleted, freed = deleted + 1, freed + size
    return FolderStats(deleted, freed)


def newest_runs(folder: str | PathLike[str], count: int) -> list[tuple[Path, int, int]]:
    """Returns path, time of the last change, [ns], and size, [bytes], of the newest runs of a folder, newest first."""
    found = sorted(_runs(Path(folder)), reverse=True)[:count]
    return [(path, changed, size) for changed, path, size in found]


def _runs(folder: Path) -> list[tuple[int, Path, int]]:
    """Returns time of the last change, [ns], path and size, [bytes], of each run."""
    found: list[tuple[int, Path, int]] = []
    with suppress(OSError):
        for path in folder.iterdir():
            if path.suffix == ENDING and path.is_file() and not path.is_symlink():
                with suppress(OSError):
                    facts = path.stat()
                    found.append((facts.st_mtime_ns, path, facts.st_size))
    return found
