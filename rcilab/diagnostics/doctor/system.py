"""Files in which Linux reports its state. An unreadable file is a result, not an exception."""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Reading:
    """Content of a file, or the reason why it cannot be read."""

    text: str | None
    """Content without white space at the ends; None if it cannot be read."""
    problem: str = ""
    """Reason if it cannot be read, such as "/sys/x cannot be read (Permission denied)"."""


class System:
    """A tree of /proc, /sys and /boot.

    Args:
        root: Root of the tree; for tests, another directory than `/`.
    """

    def __init__(self, root: Path = Path("/")) -> None:
        self._root = root

    def read(self, path: str) -> Reading:
        """Returns the text of a file by its absolute path; a `.gz` file is decompressed."""
        try:
            content = self._at(path).read_bytes()
            if path.endswith(".gz"):
                content = gzip.decompress(content)
        except FileNotFoundError:
            return Reading(None, f"{path} does not exist")
        except (OSError, EOFError, zlib.error) as error:
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
            return Reading(None, f"{path} cannot be read ({reason})")
        return Reading(content.decode("utf-8", errors="replace").strip())

    def has(self, path: str) -> bool:
        """Returns whether a file or directory exists; False without permission to check."""
        try:
            return self._at(path).exists()
        except OSError:
            return False

    def find(self, directory: str, pattern: str) -> list[str]:
        """Returns the absolute paths below a directory that match a pattern such as `cpu*/online`, sorted."""
        try:
            found = sorted(self._at(directory).glob(pattern))
        except OSError:
            return []
        return [f"/{path.relative_to(self._root)}" for path in found]

    def _at(self, path: str) -> Path:
        return self._root / path.lstrip("/")
