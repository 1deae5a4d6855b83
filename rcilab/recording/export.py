"""Export formats of a run, by file ending."""

from __future__ import annotations

from collections.abc import Callable
from io import TextIOWrapper
from os import PathLike, fspath
from pathlib import Path
from typing import IO, TYPE_CHECKING, TypeAlias

from rcilab.core.arrays import described
from rcilab.core.atomic_file import replacing
from rcilab.core.cycle_log import write_csv, write_npz
from rcilab.core.errors import InvalidValueError
from rcilab.i18n.translator import Text
from rcilab.i18n.units import USUAL, Units
from rcilab.recording.columns import run_columns
from rcilab.recording.data_frame import write_parquet
from rcilab.recording.html_file import write_html
from rcilab.recording.mcap_file import write_mcap
from rcilab.recording.run_file import write_run

if TYPE_CHECKING:
    from rcilab.recording.run import Run

Progress: TypeAlias = Callable[[float], None]
"""Called with the progress, 0 to 1."""

_Writer: TypeAlias = "Callable[[Run, IO[bytes], Progress, Text], None]"


def save_run(
    run: Run,
    file: str | PathLike[str],
    *,
    progress: Progress | None = None,
    language: str = "en",
    units: Units = USUAL,
) -> None:
    """Writes a run to a file; see `Run.save`."""
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("file", described(file), "must be a file name")
    path = Path(fspath(file))
    require_ending(path.suffix)
    try:
        with replacing(path) as stream:
            write_export(run, path.suffix, stream, progress=progress, language=language, units=units)
    except OSError as error:
        raise InvalidValueError("file", fspath(file), f"cannot be written: {error.strerror}").coded(
            "file_unwritable", file=fspath(file)
        ) from error


def write_export(
    run: Run,
    ending: str,
    stream: IO[bytes],
    *,
    progress: Progress | None = None,
    language: str = "en",
    units: Units = USUAL,
) -> None:
    """Writes a run to a stream in one of the formats of `WRITERS`; an exception in `progress` ends it."""
    write = WRITERS[require_ending(ending)]
    report = progress or (lambda share: None)
    text = Text(language, "rcilab.recording")
    text.units = units
    write(run, stream, report, text)
    report(1.0)


def require_ending(ending: str) -> str:
    """Returns `ending` if it is that of an export format.

    Raises:
        InvalidValueError: It is not; the message lists the endings.
    """
    if ending not in WRITERS:
        raise InvalidValueError("file ending", ending, f"is unknown; known: {', '.join(WRITERS)}")
    return ending


def _rcirun(run: Run, stream: IO[bytes], progress: Progress, text: Text) -> None:
    write_run(run, stream)


def _csv(run: Run, stream: IO[bytes], progress: Progress, text: Text) -> None:
    lines = TextIOWrapper(stream, encoding="utf-8", newline="")
    write_csv(run_columns(run), lines, progress)
    lines.flush()
    lines.detach()


def _npz(run: Run, stream: IO[bytes], progress: Progress, text: Text) -> None:
    write_npz(run.cycles, stream)


def _parquet(run: Run, stream: IO[bytes], progress: Progress, text: Text) -> None:
    write_parquet(run, stream, progress)


def _mcap(run: Run, stream: IO[bytes], progress: Progress, text: Text) -> None:
    write_mcap(run, stream, progress)


def _html(run: Run, stream: IO[bytes], progress: Progress, text: Text) -> None:
    write_html(run, stream, text)


WRITERS: dict[str, _Writer] = {
    ".rcirun": _rcirun,
    ".csv": _csv,
    ".npz": _npz,
    ".parquet": _parquet,
    ".mcap": _mcap,
    ".html": _html,
}
