"""What a list says of a recorded run: read from the ends of its file, without its cycles."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import IO, TYPE_CHECKING, Literal

from rcilab.core.errors import InvalidValueError, RcilabError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS
from rcilab.recording.chunks import encode_header, read_chunk_ends
from rcilab.recording.run import decode_run
from rcilab.recording.run_file import ENDING

if TYPE_CHECKING:
    from rcilab.core.fault import FaultCode

RunEnd = Literal["arrived", "stopped", "fault", "cut"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """A recorded run in a list."""

    name: str
    """Of its file."""
    model: str
    started_ns: int
    """Start, nanoseconds since 1970 (UTC); 0: not known."""
    duration: float
    """[s]."""
    ended: RunEnd
    """"arrived" is also a motion without an end of its own; "cut" a file without its end."""
    faults: tuple[FaultCode, ...] = ()


def summarize_run(file: str | PathLike[str]) -> RunSummary | None:
    """Returns what a list says of a run; None of a file that is not a run, has no cycle or does not name its arm."""
    path = Path(file)
    try:
        with path.open("rb") as stream:
            run = decode_run(_ends(stream), path.name, max_rows=DEFAULT_MAX_ROWS)
    except (OSError, RcilabError):
        return None
    if run.model is None or not len(run.t):
        return None
    ended: RunEnd = "arrived"
    if run.faults or run.is_safety_stop:
        ended = "fault"
    elif not run.is_complete:
        ended = "cut"
    elif run.stopped:
        ended = "stopped"
    return RunSummary(
        name=path.name,
        model=run.model.name,
        started_ns=run.setup.started_ns,
        duration=float(run.t[-1]),
        ended=ended,
        faults=run.faults,
    )


def _ends(stream: IO[bytes]) -> bytes:
    """Returns a file of the first chunk, the last cycles and the end of another one."""
    chunks = read_chunk_ends(stream, ("HEAD", "CYCL", "TAIL"))
    if "HEAD" not in chunks:
        raise InvalidValueError("run file", ENDING, "has no beginning")
    return encode_header() + b"".join(chunks[kind] for kind in ("HEAD", "CYCL", "TAIL") if kind in chunks)
