"""The folder that runs are recorded in: how much is there, and how old ones are cleared away."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from rcilab.core.errors import InvalidValueError
from rcilab.recording.run_file import ENDING


@dataclass(frozen=True, slots=True)
class FolderStats:
    """What a folder holds of recorded runs."""

    count: int
    size: int
    """[bytes]."""


def stored_runs(folder: str | PathLike[str]) -> FolderStats:
    """Returns how many runs a folder holds and how large they are together; none where there is no folder."""
    sizes = [size for _, _, size in _runs(Path(folder))]
    return FolderStats(len(sizes), sum(sizes))


def keep_newest(folder: str | PathLike[str], count: int) -> FolderStats:
    """Deletes all runs of a folder but the newest ones, and returns what was deleted.

    Only files that are named as runs are, directly in the folder, are touched.

    Args:
        folder: Where runs are recorded.
        count: How many stay, 0 or more.

    Raises:
        InvalidValueError: The count is negative.
    """
    if count < 0:
        raise InvalidValueError("count", count, "is negative: 0 keeps none")
    deleted, freed = 0, 0
    for _, path, size in sorted(_runs(Path(folder)), reverse=True)[count:]:
        with suppress(OSError):  # It is not ours to delete, or another process removed it first.
            path.unlink()
            deleted, freed = deleted + 1, freed + size
    return FolderStats(deleted, freed)


def _runs(folder: Path) -> list[tuple[int, Path, int]]:
    """Returns when each run was written last, [ns], where it is, and its size, [bytes]."""
    found: list[tuple[int, Path, int]] = []
    with suppress(OSError):
        for path in folder.iterdir():
            if path.suffix == ENDING and path.is_file() and not path.is_symlink():
                with suppress(OSError):
                    facts = path.stat()
                    found.append((facts.st_mtime_ns, path, facts.st_size))
    return found
