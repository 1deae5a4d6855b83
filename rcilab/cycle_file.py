"""Recorded cycles: what a row holds, and files of them: CSV for people and spreadsheets, NPZ for numpy."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from io import TextIOWrapper
from os import PathLike, fspath
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.errors import InvalidValueError
from rcilab.whole_file import replacing


def cycle_dtype(n: int) -> np.dtype[np.void]:
    """Returns the layout of one recorded cycle of an arm with n joints.

    ======================  ==================================================================================
    message_id              number of the controller cycle
    t                       time since the first command of the motion, in controller cycles, [s]; NaN outside
    received_ns, sent_ns    monotonic stamps of the state's arrival and of the answer (0: not answered), [ns]
    lateness                how late it was handled, by the robot's own 1 ms grid, [s]; NaN: nobody waited for it
    success_rate            share of commands that arrived in time, as the controller reports it, 0 to 1
    q, q_c, dq              measured and commanded joint angles [rad], measured velocities [rad/s], shape (n,)
    command                 joint angles sent in answer, [rad], shape (n,); NaN when none were sent
    faults                  the error bits as one number, bit k = `Fault(k)`
    lost                    controller cycles between the previous row and this one that never reached us
    robot_mode, controller_mode, motion_generator_mode    as on the wire
    braking                 1: what was sent in answer brings the arm to rest, whatever was planned
    tau                     measured joint torques, [N m], shape (n,)
    command_pose            pose of the tool in base sent in answer, [m], shape (4, 4); NaN when none was sent
    command_psi             arm angle sent with it, [rad]; NaN when none was sent
    command_tau             joint torques sent in answer, [N m], shape (n,); NaN when none were sent
    ======================  ==================================================================================
    """
    vector = ("<f8", (n,))
    return np.dtype(
        [
            ("message_id", "<u8"),
            ("t", "<f8"),
            ("received_ns", "<i8"),
            ("sent_ns", "<i8"),
            ("lateness", "<f8"),
            ("success_rate", "<f8"),
            ("q", *vector),
            ("q_c", *vector),
            ("dq", *vector),
            ("command", *vector),
            ("faults", "<u4"),
            ("lost", "<u4"),
            ("robot_mode", "u1"),
            ("controller_mode", "u1"),
            ("motion_generator_mode", "u1"),
            ("braking", "u1"),
            ("reserved", "u1", (4,)),
            ("tau", *vector),
            ("command_pose", "<f8", (4, 4)),
            ("command_psi", "<f8"),
            ("command_tau", *vector),
        ]
    )


UNITS = {
    "t": "s",
    "received_ns": "ns",
    "sent_ns": "ns",
    "lateness": "s",
    "q": "rad",
    "q_c": "rad",
    "dq": "rad/s",
    "command": "rad",
    "tau": "N m",
    "command_psi": "rad",
    "command_tau": "N m",
}
"""Unit of each field that has one and only one; a pose mixes numbers without a unit and [m]."""

_HIDDEN = ("reserved",)
_CHUNK = 2000  # Rows of a CSV between two reports of progress.


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One number a cycle."""

    name: str
    """Such as q[1], command_pose[1,4] or t."""
    unit: str
    """"" for a number without one."""
    values: NDArray[Any]
    """Shape (N,)."""

    @property
    def title(self) -> str:
        """Name and unit, such as "q[1] [rad]"."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def split_columns(name: str, unit: str, values: NDArray[Any]) -> list[Column]:
    """Returns the columns of an array with one entry a cycle: name[1], name[2], ... or name[1,1], ..., from 1."""
    columns: list[Column] = []
    for place in np.ndindex(values.shape[1:]):
        index = ",".join(str(i + 1) for i in place)
        columns.append(Column(f"{name}[{index}]" if place else name, unit, values[(slice(None), *place)]))
    return columns


def cycle_columns(cycles: NDArray[np.void]) -> list[Column]:
    """Returns every number of recorded cycles, each as a column with its unit."""
    columns: list[Column] = []
    for name in _fields(cycles):
        found = split_columns(name, UNITS.get(name, ""), cycles[name])
        if name == "command_pose":  # The last column of the matrix is the position.
            found = [
                Column(c.name, "m" if c.name.endswith(",4]") and "[4," not in c.name else "", c.values) for c in found
            ]
        columns += found
    return columns


def write_csv(columns: Sequence[Column], stream: IO[str], progress: Callable[[float], None] | None = None) -> None:
    """Writes columns as CSV: a header line with names and units, then plain numbers; nan where there is nothing.

    Args:
        columns: All of the same length.
        stream: Where to; opened with newline="".
        progress: Told the share that is done, now and then.
    """
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([column.title for column in columns])
    count = len(columns[0].values) if columns else 0
    for start in range(0, count, _CHUNK):
        rows: Iterable[tuple[object, ...]] = zip(
            *(column.values[start : start + _CHUNK].tolist() for column in columns), strict=True
        )
        writer.writerows(rows)
        if progress is not None:
            progress(min(1.0, (start + _CHUNK) / count))


def save_cycles(cycles: NDArray[np.void], file: str | PathLike[str]) -> None:
    """Writes recorded cycles, one row each, in SI units; the ending of the name chooses the format.

    .csv: a header line with units, then plain numbers; an array of a cycle becomes columns `q[1] [rad]`,
    `q[2] [rad]`, ..., a matrix `command_pose[1,1]`, ...; nan where there was nothing. .npz: one array a field,
    `numpy.load(file)["q"]` of shape (N, n).

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
        with replacing(path) as stream:
            _WRITERS[path.suffix](cycles, stream)
    except OSError as error:
        raise InvalidValueError("file", fspath(file), f"cannot be written: {error.strerror}").coded(
            "file_unwritable", file=fspath(file)
        ) from error


def write_npz(cycles: NDArray[np.void], stream: IO[bytes]) -> None:
    """Writes recorded cycles as one array a field."""
    arrays: dict[str, Any] = {name: np.ascontiguousarray(cycles[name]) for name in _fields(cycles)}
    np.savez_compressed(stream, **arrays)


def _write_csv(cycles: NDArray[np.void], stream: IO[bytes]) -> None:
    lines = TextIOWrapper(stream, encoding="utf-8", newline="")
    write_csv(cycle_columns(cycles), lines)
    lines.detach()


def _fields(cycles: NDArray[np.void]) -> list[str]:
    return [name for name in cycles.dtype.names or () if name not in _HIDDEN]


_WRITERS = {".csv": _write_csv, ".npz": write_npz}
