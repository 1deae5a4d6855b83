"""Motion files: a versioned .npz with an exact round trip, and rows as CSV."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sized
from io import TextIOWrapper
from os import PathLike, fspath
from pathlib import Path
from typing import IO, BinaryIO, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rcilab.core.arrays import Array, JointPath, as_number
from rcilab.core.atomic_file import read_limited, replacing
from rcilab.core.cycle_log import Column, write_csv
from rcilab.core.errors import InvalidValueError, VersionMismatchError
from rcilab.core.file_bounds import ROW_BYTES, require_bytes, require_max_rows, require_rows
from rcilab.motion.motion_event import events_in
from rcilab.motion.npy_reader import Shapes, contains_numbers, read_arrays
from rcilab.motion.piecewise import PiecewisePolynomial, require_piece_shapes

M = TypeVar("M", bound=Sized)

KIND = "rcilab motion"
VERSION = 1

_PIECES_PER_ROW = 5
"""Largest number of pieces of a curve per 1 ms; tuning value: a planned motion has one for several ms."""

_SIGNATURES = (b"PK", b"\x93NUMPY")
"""First bytes of a NumPy archive and of a single array."""
_OTHER_FILES = {
    ".rcirun": "it is a recorded run, which rcilab.load_run reads",
    ".json": "it is a program, which Program.load reads",
}


def write_arrays(stream: IO[bytes], content: Mapping[str, ArrayLike]) -> None:
    """Writes the arrays of a motion, by name, as .npz."""
    np.savez(stream, kind=np.array(KIND), version=np.array(VERSION), **dict(content))  # type: ignore[arg-type]


def write_rows(stream: IO[bytes], times: Array, q: JointPath) -> None:
    """Writes the rows of a motion as CSV.

    Args:
        stream: Binary stream to write to.
        times: Times of the rows, shape (N,), [s].
        q: Joint angles, shape (N, n), [rad].
    """
    lines = TextIOWrapper(stream, encoding="utf-8", newline="")
    joints = [Column(f"q{i + 1}", "rad", q[:, i]) for i in range(q.shape[1])]
    write_csv([Column("t", "s", times), *joints], lines)
    lines.detach()


def save(
    file: str | PathLike[str] | BinaryIO, npz: Callable[[IO[bytes]], None], csv: Callable[[IO[bytes]], None]
) -> None:
    """Writes a motion: to a file as .npz or .csv by its suffix, to a stream as .npz.

    Args:
        file: File name or binary stream.
        npz: Writes .npz to a stream.
        csv: Writes CSV to a stream.

    Raises:
        InvalidValueError: The suffix is unknown, or the file cannot be written.
    """
    if not isinstance(file, str | PathLike):
        _require_stream(file, "write")
        npz(file)
        return
    suffix, writers = Path(file).suffix.lower(), {".npz": npz, ".csv": csv}
    if suffix not in writers:
        raise InvalidValueError("motion file", fspath(file), f"must end in {' or '.join(writers)}")
    try:
        with replacing(file) as stream:
            writers[suffix](stream)
    except OSError as error:
        raise InvalidValueError("motion file", fspath(file), f"cannot be written: {error.strerror}") from error


def is_csv(file: object) -> bool:
    """Returns whether a file name ends in .csv."""
    return isinstance(file, str | PathLike) and Path(fspath(file)).suffix.lower() == ".csv"


def read_content(file: str | PathLike[str] | BinaryIO, max_rows: int, build: Callable[..., M]) -> M:
    """Returns the motion in an .npz, built by `build` with the keyword arguments of `Motion`.

    Raises:
        InvalidValueError: The file does not exist, or its motion is not valid or too long.
        VersionMismatchError: It has another version of this format.
    """
    require_max_rows(max_rows)
    if not isinstance(file, str | PathLike):
        _require_stream(file, "read")
    name = fspath(file) if isinstance(file, str | PathLike) else "stream"
    content = _read(file, name, max_rows)
    if str(content.get("kind", "")) != KIND:
        found = ", ".join(content) or "nothing"
        raise InvalidValueError(
            "motion file", name, f"does not contain a motion (found: {found}); save one with Motion.save"
        )
    version = content.get("version")
    if version is None or version.shape != () or version != VERSION:
        found = None if version is None else version.tolist()
        advice = "plan and save the motion again, or read it with the version of rcilab that wrote it"
        raise VersionMismatchError(f"motion file {name!r}", found, VERSION, advice)
    try:
        if not all(contains_numbers(content[key]) for key in ("breaks", "coefficients", "goal")):
            raise TypeError("complex or other numbers")
        curve = PiecewisePolynomial(content["breaks"], content["coefficients"])
        motion = build(
            polynomial=curve,
            goal=content["goal"],
            law=str(content["law"]),
            speed=as_number(content["speed"], "speed"),
            # Files of older versions have neither.
            segment_starts=content.get("segment_starts", np.zeros(1)).astype(np.float64, casting="safe"),
            notes=tuple(content["notes"].tolist()) if "notes" in content else (),
            events=events_in(content["events"]) if "events" in content else (),
        )
    except KeyError as error:
        raise InvalidValueError("motion file", name, f"is incomplete: {error} is missing") from error
    except InvalidValueError as error:
        raise InvalidValueError("motion file", name, f"contains a damaged motion: {error}") from error
    except (TypeError, ValueError, OverflowError) as error:
        problem = "contains a damaged motion: its arrays do not all contain real numbers"
        raise InvalidValueError("motion file", name, problem) from error
    require_rows(len(motion), max_rows, "motion file", name)
    return motion


def _read(file: str | PathLike[str] | BinaryIO, name: str, max_rows: int) -> dict[str, np.ndarray]:
    def require_size(size: int) -> None:
        require_bytes(size, max_rows, "motion file", name)

    if isinstance(file, str | PathLike):
        content = read_limited(Path(file), "motion file", require_size)
    else:
        content = file.read(max_rows * ROW_BYTES + 1)
        require_size(len(content))
    if not content:
        raise InvalidValueError("motion file", name, "cannot be read as a motion: it is empty")
    if not content.startswith(_SIGNATURES):
        problem = _OTHER_FILES.get(Path(name).suffix.lower(), "it was not written by Motion.save")
        raise InvalidValueError("motion file", name, f"cannot be read as a motion: {problem}")
    problem = "cannot be read as a motion: it is damaged, or has another content; save the motion again"
    return read_arrays(
        content, "motion file", name, problem, max_rows, lambda shapes: _require_shapes(shapes, name, max_rows)
    )


def _require_shapes(shapes: Shapes, name: str, max_rows: int) -> None:
    """Requires arrays that fit together and are not too long; a missing one is reported when the file is read."""
    breaks, coefficients, goal = (shapes.get(key) for key in ("breaks", "coefficients", "goal"))
    if breaks is None or coefficients is None:
        return
    try:
        require_piece_shapes(breaks, coefficients)
        if goal is not None and goal != coefficients[1:2]:
            raise InvalidValueError("goal", f"array of shape {goal}", f"must have {coefficients[1]} joints")
    except InvalidValueError as error:
        raise InvalidValueError("motion file", name, f"contains a damaged motion: {error}") from error
    require_rows(coefficients[0] // _PIECES_PER_ROW, max_rows, "motion file", name)


def _require_stream(file: object, method: str) -> None:
    if not hasattr(file, method):
        raise InvalidValueError("motion file", file, "must be a file name or an open binary file")
