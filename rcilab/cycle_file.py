"""Recorded cycles in files: CSV for people and spreadsheets, NPZ for numpy, whatever fields a record has."""

from __future__ import annotations

import csv
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rcilab.errors import InvalidValueError

_HIDDEN = ("reserved",)


def save_cycles(cycles: NDArray[np.void], file: str | PathLike[str]) -> None:
    """Writes recorded cycles, one row each, in SI units; the ending of the name chooses the format.

    .csv: a header line, then plain numbers; an array of a cycle becomes columns `q[1]`, `q[2]`, ..., a matrix
    `command_pose[1,1]`, ...; nan where there was nothing. .npz: one array a field, `numpy.load(file)["q"]` of shape
    (N, n).

    Args:
        cycles: The rows, a structured array of shape (N,).
        file: Where to; an existing file is replaced.

    Raises:
        InvalidValueError: The ending is unknown, or the file cannot be written.
    """
    path = Path(fspath(file))
    if path.suffix not in _WRITERS:
        raise InvalidValueError("file", fspath(file), f"must end in {' or '.join(_WRITERS)}, which chooses the format")
    try:
        _WRITERS[path.suffix](cycles, path)
    except OSError as error:
        raise InvalidValueError("file", fspath(file), f"cannot be written: {error.strerror}") from error


def _write_csv(cycles: NDArray[np.void], path: Path) -> None:
    names: list[str] = []
    columns: list[list[object]] = []
    for name in _fields(cycles):
        values = cycles[name]
        for place in np.ndindex(values.shape[1:]):
            index = ",".join(str(i + 1) for i in place)
            names.append(f"{name}[{index}]" if place else name)
            columns.append(values[(slice(None), *place)].tolist())
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(zip(*columns, strict=True))


def _write_npz(cycles: NDArray[np.void], path: Path) -> None:
    arrays: dict[str, Any] = {name: np.ascontiguousarray(cycles[name]) for name in _fields(cycles)}
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def _fields(cycles: NDArray[np.void]) -> list[str]:
    return [name for name in cycles.dtype.names or () if name not in _HIDDEN]


_WRITERS = {".csv": _write_csv, ".npz": _write_npz}
