"""The lessons of rcilab, and a student's copies of them, which are never overwritten."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from rcilab.core.atomic_file import read_own_text, write_atomic
from rcilab.core.errors import UsageError

INDEX = "index.md"
"""The page of the course: every lesson by its title, English and Chinese separately."""
FOLDER = "rcilab-notebooks"
"""Name of the folder of the copies, in the home directory."""

_RECORD = ".rcilab-lessons.json"  # SHA-256 of each file when it was copied: a file that differs was edited.


@dataclass(frozen=True, slots=True, kw_only=True)
class CopiedLessons:
    """The result of `copy_lessons`; `str` returns it as a sentence."""

    folder: Path
    """Folder of the copies."""
    written: tuple[str, ...]
    """Files that are new, or newer versions of unedited copies."""
    new_versions: tuple[str, ...]
    """Newer versions of copies that had been edited, under new names."""

    def __str__(self) -> str:
        text = f"lessons: your copies are in {self.folder}"
        if self.new_versions:
            text += f"; newer versions next to those that you have edited: {', '.join(self.new_versions)}"
        return text


def find_lessons() -> Path:
    """Returns the folder of the lessons: those of the installed package, or of the checkout that it runs from.

    Raises:
        UsageError: rcilab was installed without them.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "lessons", package.parent / "notebooks"):
        if (folder / INDEX).is_file():
            return folder
    raise UsageError(
        f"there are no lessons next to {package}: "
        "install rcilab again, or name a folder of notebooks, rcilab lab FOLDER"
    )


def copy_lessons(folder: Path, source: Path | None = None) -> CopiedLessons:
    """Copies the lessons into a folder; an edited copy is kept, and a newer lesson is put next to it.

    Args:
        folder: Folder of the copies; it is created.
        source: Folder of the lessons; None finds it.

    Raises:
        UsageError: The folder cannot be written, or there are no lessons.
    """
    source = find_lessons() if source is None else source
    try:
        recorded = _read_record(folder)
        written: list[str] = []
        new_versions: list[str] = []
        for lesson in sorted([*source.glob("*.ipynb"), source / INDEX]):
            text = lesson.read_text(encoding="utf-8")
            name = _choose_name(folder, lesson.name, text, recorded)
            if name is not None:
                write_atomic(folder / name, text)
                recorded[name] = _digest(text)
                (written if name == lesson.name else new_versions).append(name)
        write_atomic(folder / _RECORD, json.dumps(recorded, indent=1, sort_keys=True))
    except OSError as error:
        raise UsageError(
            f"the lessons cannot be copied into {folder}: {error.strerror}; name a folder that you may write to"
        ) from error
    return CopiedLessons(folder=folder, written=tuple(written), new_versions=tuple(new_versions))


def _choose_name(folder: Path, name: str, text: str, recorded: dict[str, str]) -> str | None:
    """Returns the file name for a lesson, or None if it has been copied already."""
    digest = _digest(text)
    for candidate in _names(name):
        file = folder / candidate
        if not file.exists():
            was_declined = candidate != name and recorded.get(candidate) == digest  # Copied once, and deleted.
            return None if was_declined else candidate
        found = _digest(_read_copy(file))
        if digest in (found, recorded.get(candidate)):
            return None
        if found == recorded.get(candidate):
            return candidate
    raise AssertionError("unreachable: there is always an unused name")


def _read_copy(file: Path) -> str:
    """Returns the text of a copy; nothing if it is not a regular text file of reasonable size."""
    try:
        return read_own_text(file)
    except UnicodeDecodeError:
        return ""
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.EFBIG, errno.EISDIR):
            raise
        return ""


def _names(name: str) -> Iterator[str]:
    """Yields 01_x.zh.ipynb, 01_x.new.zh.ipynb, 01_x.new2.zh.ipynb, ...: the ending gives the language."""
    yield name
    stem, _, ending = name.partition(".")
    number = 1
    while True:
        yield f"{stem}.new{'' if number == 1 else number}.{ending}"
        number += 1


def _read_record(folder: Path) -> dict[str, str]:
    try:
        found = json.loads(read_own_text(folder / _RECORD))
    except (OSError, ValueError, RecursionError):
        return {}  # Then every copy that differs counts as edited.
    return {str(name): str(digest) for name, digest in found.items()} if isinstance(found, dict) else {}


def _digest(text: str) -> str:
    return sha256(text.encode()).hexdigest()
