"""The files in which Linux reports about itself. A file that cannot be read is a result too, never an exception."""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Reading:
    """The content of a file, or why it could not be read."""

    text: str | None
    """Content without white space at the ends; None when it cannot be read."""
    problem: str = ""
    """Why it cannot be read, such as "/sys/x cannot be read (Permission denied)"."""


class System:
    """A tree of /proc, /sys and /boot.

    Args:
        root: Where the tree begins; anything but `/` is another machine's tree, or a made-up one.
    """

    def __init__(self, root: Path = Path("/")) -> None:
        self._root = root

    def read(self, path: str) -> Reading:
        """Returns the text of a file, given by its absolute path; one whose name ends in `.gz` is unpacked."""
        try:
            content = self._at(path).read_bytes()
            if path.endswith(".gz"):
                content = gzip.decompress(content)
        except FileNotFoundError:
            return Reading(None, f"there is no {path}")
        except (OSError, EOFError, zlib.error) as error:
            reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
            return Reading(None, f"{path} cannot be read ({reason})")
        return Reading(content.decode("utf-8", errors="replace").strip())

    def has(self, path: str) -> bool:
        """Returns whether there is such a file or directory, as far as we may look."""
        try:
            return self._at(path).exists()
        except OSError:
            return False

    def find(self, directory: str, pattern: str) -> list[str]:
        """Returns the absolute paths below a directory that fit a pattern such as `cpu*/online`, sorted."""
        try:
            found = sorted(self._at(directory).glob(pattern))
        except OSError:
            return []
        return [f"/{path.relative_to(self._root)}" for path in found]

    def _at(self, path: str) -> Path:
        return self._root / path.lstrip("/")
