"""Motions in files: a versioned .npz that comes back to the last bit, the rows as CSV, and words for other files."""

from __future__ import annotations

from io import TextIOWrapper
from os import PathLike, fspath
from pathlib import Path
from typing import IO, BinaryIO

import numpy as np

from rcilab.core.arrays import as_number
from rcilab.core.atomic_file import read_whole, replacing
from rcilab.core.cycle_log import Column, write_csv
from rcilab.core.errors import InvalidValueError, VersionMismatchError
from rcilab.core.file_bounds import MOST_ROWS, ROW_BYTES, require_bytes, require_max_rows, require_rows
from rcilab.motion.archive import read_arrays
from rcilab.motion.motion import Motion
from rcilab.motion.piecewise import PiecewisePolynomial

KIND = "rcilab motion"
VERSION = 1

_SIGNATURES = (b"PK", b"\x93NUMPY")
"""How an archive and a single array of numpy's begin."""


def save_motion(motion: Motion, file: str | PathLike[str] | BinaryIO) -> None:
    """Writes a motion: by the ending of a name .npz or .csv, to a stream .npz.

    Raises:
        InvalidValueError: The ending is unknown, or the file cannot be written.
    """
    if not isinstance(file, str | PathLike):
        _require_stream(file, "write")
        _write_npz(motion, file)
        return
    write = _WRITERS[_require_suffix(file)]
    try:
        with replacing(file) as stream:
            write(motion, stream)
    except OSError as error:
        raise InvalidValueError("motion file", fspath(file), f"cannot be written: {error.strerror}") from error


def _write_npz(motion: Motion, stream: IO[bytes]) -> None:
    content = {
        "kind": np.array(KIND),
        "version": np.array(VERSION),
        "law": np.array(motion.law),
        "speed": np.array(motion.speed),
        "breaks": motion.polynomial.breaks,
        "coefficients": motion.polynomial.coefficients,
        "goal": motion.goal,
        "segment_starts": motion.segment_starts,
        "notes": np.array(motion.notes, dtype=np.str_),
    }
    np.savez(stream, **content)


def _write_csv(motion: Motion, stream: IO[bytes]) -> None:
    lines = TextIOWrapper(stream, encoding="utf-8", newline="")
    joints = [Column(f"q{i + 1}", "rad", motion.q[:, i]) for i in range(motion.n)]
    write_csv([Column("t", "s", motion.times), *joints], lines)
    lines.detach()


_WRITERS = {".npz": _write_npz, ".csv": _write_csv}


def _require_suffix(file: str | PathLike[str]) -> str:
    suffix = Path(file).suffix.lower()
    if suffix not in _WRITERS:
        raise InvalidValueError("motion file", fspath(file), f"must end in {' or '.join(_WRITERS)}")
    return suffix


def load_motion(file: str | PathLike[str] | BinaryIO, max_rows: int = MOST_ROWS) -> Motion:
    """Returns the motion in a file; see `Motion.load`.

    Raises:
        InvalidValueError: There is no such file, it holds no sound motion, or too long a one.
        VersionMismatchError: It was written by another version of this format.
    """
    require_max_rows(max_rows)
    if not isinstance(file, str | PathLike):
        _require_stream(file, "read")
    elif Path(file).suffix.lower() == ".csv":
        from rcilab.motion.samples import load_rows

        return load_rows(file, max_rows)
    name = fspath(file) if isinstance(file, str | PathLike) else "stream"
    content = _read(file, name, max_rows)
    if str(content.get("kind", "")) != KIND:
        found = ", ".join(content) or "nothing"
        raise InvalidValueError("motion file", name, f"holds no motion (found: {found}); save one with Motion.save")
    version = content.get("version")
    if version is None or version.shape != () or version != VERSION:
        found = None if version is None else version.tolist()
        advice = "plan the motion again and save it, or read it with the rcilab that wrote it"
        raise VersionMismatchError(f"motion file {name!r}", found, VERSION, advice)
    try:
        curve = PiecewisePolynomial(content["breaks"], content["coefficients"])
        motion = Motion(
            polynomial=curve,
            goal=content["goal"],
            law=str(content["law"]),  # type: ignore[arg-type]  # Motion checks it.
            speed=as_number(content["speed"], "speed"),
            # Files from before there were programs have neither.
            segment_starts=content.get("segment_starts", np.zeros(1)),
            notes=tuple(content["notes"].tolist()) if "notes" in content else (),
        )
    except KeyError as error:
        raise InvalidValueError("motion file", name, f"is incomplete: no {error}") from error
    except InvalidValueError as error:
        raise InvalidValueError("motion file", name, f"holds a damaged motion: {error}") from error
    except (TypeError, ValueError, OverflowError) as error:
        problem = "holds a damaged motion: breaks and coefficients are not all numbers"
        raise InvalidValueError("motion file", name, problem) from error
    require_rows(len(motion), max_rows, "motion file", name)
    return motion


def _read(file: str | PathLike[str] | BinaryIO, name: str, max_rows: int) -> dict[str, np.ndarray]:
    most = max_rows * ROW_BYTES + 1
    content = read_whole(Path(file), "motion file", most) if isinstance(file, str | PathLike) else file.read(most)
    if not content:
        raise InvalidValueError("motion file", name, "cannot be read as a motion: it is empty")
    if not content.startswith(_SIGNATURES):
        raise InvalidValueError("motion file", name, "cannot be read as a motion: Motion.save did not write it")
    problem = "cannot be read as a motion: it is damaged, or holds something else; save the motion again"
    require_bytes(len(content), max_rows, "motion file", name)
    return read_arrays(content, "motion file", name, problem, max_rows)


def _require_stream(file: object, method: str) -> None:
    if not hasattr(file, method):
        raise InvalidValueError("motion file", file, "is no file name, and no open binary file")
