"""Recorded cycles: the layout of a row, and files of rows: CSV for spreadsheets, NPZ for numpy."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from io import TextIOWrapper
from os import PathLike, fspath
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.core.atomic_file import replacing
from rcilab.core.error_base import InvalidValueError

STATE_FIELDS = ("tau_ext_in_base", "tau_ext_in_stiff", "T_base_tool", "theta")
"""More fields of a row, named as in `RobotState`, in the order of the row."""
OTHER_STATE_FIELDS = (
    "dq_c", "ddq_c", "T_base_tool_c", "tool_velocity_c", "tool_acceleration_c", "tau_filtered", "tau_c", "dtau_c",
    "dtheta", "motor_tau", "motor_tau_filtered", "psi", "psi_c", "dpsi_c", "ddpsi_c",
)  # fmt: skip
"""Further fields of a complete row: the rest of the state, plain numbers last."""
PLAYOUT_FIELDS = ("motion", "played", "age", "queued", "missed", "late", "command_number")
"""Further fields of a row that a virtual controller records: what it did with the commands of its client."""
RATE_FIELDS = ("command_dq", "command_twist", "command_goal")
"""The last fields of such a row: commands of a client that are neither angles, nor poses, nor torques."""

NOT_RECORDED = 2**64 - 1
"""The `age` of a played command that is in no row."""

_POSES = ("command_pose", "T_base_tool", "T_base_tool_c")
_SCALARS = ("psi", "psi_c", "dpsi_c", "ddpsi_c")
_SCREWS = {
    "command_twist": ("m/s", "rad/s"),
    "tau_ext_in_base": ("N", "N m"),
    "tau_ext_in_stiff": ("N", "N m"),
    "tool_velocity_c": ("m/s", "rad/s"),
    "tool_acceleration_c": ("m/s^2", "rad/s^2"),
}
"""Units of fields with three linear and three angular components."""


def cycle_dtype(n: int, *, complete: bool = False, playout: bool = False) -> np.dtype[np.void]:
    """Returns the layout of one recorded cycle of an arm with n joints.

    ======================  ==================================================================================
    message_id              number of the controller cycle
    t                       time since the first command of the motion, in controller cycles, [s]; NaN outside
    received_ns, sent_ns    monotonic stamps of the state's arrival and of the answer (0: not answered), [ns]
    lateness                delay of its handling against the robot's own 1 ms grid, [s]; NaN: no deadline
    success_rate            share of commands that arrived in time, as the controller reports it, 0 to 1
    q, q_c, dq              measured and commanded joint angles [rad], measured velocities [rad/s], shape (n,)
    command                 joint angles sent, [rad], shape (n,); NaN when none were sent
    faults                  the error bits as one number of 64 bits, bit k = fault k of the maker
    lost                    states between the previous row and this one that were not received
    robot_mode, controller_mode, motion_generator_mode    as on the wire
    braking                 1: the answer is part of a stop, not of the plan
    tau                     measured joint torques, [N m], shape (n,)
    command_pose            pose of the tool in base as sent, [m], shape (4, 4); NaN when none was sent
    command_psi             arm angle sent with it, [rad]; NaN when none was sent
    command_tau             joint torques sent, [N m], shape (n,); NaN when none were sent
    tau_ext_in_base         external force and moment in the base frame, shape (6,), [N, N m]
    tau_ext_in_stiff        external force and moment in the force-control frame, shape (6,), [N, N m]
    T_base_tool             measured pose of the tool in base, shape (4, 4), [m]
    theta                   motor positions, motor side of the gear, [rad], shape (n,)
    ======================  ==================================================================================

    A complete row continues with the rest of the state, `OTHER_STATE_FIELDS`, named as in `RobotState`. A field that is
    missing in a file of an earlier version is NaN. A row that a virtual controller recorded ends with `PLAYOUT_FIELDS`
    and `RATE_FIELDS`:

    ======================  ==================================================================================
    motion                  number of the motion of its client, from 1; 0 outside
    played                  1: a command was played in this cycle
    age                     number of rows from the one with that command to this one; `NOT_RECORDED`: no row has it
    queued                  commands left in the queue
    missed                  1: the motion was in progress and no command was there for this cycle
    late                    commands of this motion so far that came after their cycle and were dropped
    command_number          number that the client gave its command; that of the state without one
    command_dq              joint velocities sent, [rad/s], shape (n,); NaN when none were sent
    command_twist           velocity of the tool sent, base axes, shape (6,), [m/s, rad/s]; NaN when none was sent
    command_goal            joint angles sent as a goal to which the controller plans, [rad], shape (n,); NaN when none
    ======================  ==================================================================================

    There, received_ns is when the state was sent, sent_ns when the command of the row arrived, and lateness the time
    between the state with its number and its arrival. The command is the answer to the state of the row; only where a
    client repeated a number, or uses its own, one that came before or after it.

    Args:
        n: Number of joints.
        complete: Whether a row holds every field of the state.
        playout: Whether a row holds what the controller did with the commands.
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
            ("faults", "<u8"),
            ("lost", "<u4"),
            ("robot_mode", "u1"),
            ("controller_mode", "u1"),
            ("motion_generator_mode", "u1"),
            ("braking", "u1"),
            ("tau", *vector),
            ("command_pose", "<f8", (4, 4)),
            ("command_psi", "<f8"),
            ("command_tau", *vector),
            *((name, "<f8", _shape(name, n)) for name in STATE_FIELDS + (OTHER_STATE_FIELDS if complete else ())),
            *((name, "<u8") for name in (PLAYOUT_FIELDS if playout else ())),
            *((name, "<f8", _shape(name, n)) for name in (RATE_FIELDS if playout else ())),
        ]
    )


def state_cycles(rows: NDArray[np.void]) -> int:
    """Returns from how many cycles to the next a controller sends its state: the shortest step of recorded rows."""
    steps = np.diff(rows["message_id"].astype(np.int64))
    steps = steps[steps > 0]
    return int(steps.min()) if steps.size else 1


def _shape(name: str, n: int) -> tuple[int, ...]:
    if name in _POSES:
        return (4, 4)
    if name in _SCALARS:
        return ()
    return (6,) if name in _SCREWS else (n,)


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
    "command_dq": "rad/s",
    "command_goal": "rad",
    "theta": "rad",
    "dq_c": "rad/s",
    "ddq_c": "rad/s^2",
    "psi": "rad",
    "psi_c": "rad",
    "dpsi_c": "rad/s",
    "ddpsi_c": "rad/s^2",
    "tau_filtered": "N m",
    "tau_c": "N m",
    "dtau_c": "N m/s",
    "dtheta": "rad/s",
    "motor_tau": "N m",
    "motor_tau_filtered": "N m",
}
"""Unit of each field with a single unit; see `_unit` for the others."""

_CHUNK = 2000  # Rows of a CSV between two reports of progress.


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One number per cycle."""

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


def split_columns(name: str, unit: str | Callable[[tuple[int, ...]], str], values: NDArray[Any]) -> list[Column]:
    """Returns the columns of an array with one entry per cycle: name[1], name[2], ... or name[1,1], ..., from 1.

    Args:
        name: Name of the array.
        unit: Unit of its numbers, or a function that returns the unit for an index in an entry, counted from 0.
        values: The array, shape (N, ...).
    """
    columns: list[Column] = []
    for index in np.ndindex(values.shape[1:]):
        subscript = ",".join(str(i + 1) for i in index)
        column_unit = unit if isinstance(unit, str) else unit(index)
        title = f"{name}[{subscript}]" if index else name
        columns.append(Column(title, column_unit, values[(slice(None), *index)]))
    return columns


def cycle_columns(cycles: NDArray[np.void]) -> list[Column]:
    """Returns recorded cycles as columns of numbers, each with its unit."""
    columns: list[Column] = []
    for name in _fields(cycles):
        columns += split_columns(name, partial(_unit, name), cycles[name])
    return columns


def _unit(name: str, index: tuple[int, ...]) -> str:
    """Returns the unit of one number of a field; the last column of a pose is the position."""
    if name in _POSES:
        return "m" if index[0] < 3 and index[1] == 3 else ""
    if name in _SCREWS:
        return _SCREWS[name][index[0] // 3]
    return UNITS.get(name, "")


def write_csv(columns: Sequence[Column], stream: IO[str], progress: Callable[[float], None] | None = None) -> None:
    """Writes columns as CSV: a header line with names and units, then plain numbers; nan for a missing value.

    Args:
        columns: All of the same length.
        stream: Destination, opened with newline="".
        progress: Called with the progress, 0 to 1, after every chunk of rows.
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
    """Writes recorded cycles, one row each, in SI units; the file's ending selects the format.

    .csv: a header line with units, then plain numbers; an array of a cycle becomes columns `q[1] [rad]`,
    `q[2] [rad]`, ..., a matrix `command_pose[1,1]`, ...; nan for a missing value. .npz: one array per field,
    `numpy.load(file)["q"]` of shape (N, n).

    Args:
        cycles: The rows, a structured array of shape (N,).
        file: Destination; an existing file is replaced.

    Raises:
        InvalidValueError: The ending is unknown, or the file cannot be written.
    """
    path = Path(fspath(file))
    if path.suffix not in _WRITERS:
        raise InvalidValueError("file", fspath(file), f"must end in {' or '.join(_WRITERS)}, which selects the format")
    try:
        with replacing(path) as stream:
            _WRITERS[path.suffix](cycles, stream)
    except OSError as error:
        raise InvalidValueError("file", fspath(file), f"cannot be written: {error.strerror}").coded(
            "file_unwritable", file=fspath(file)
        ) from error


def write_npz(cycles: NDArray[np.void], stream: IO[bytes]) -> None:
    """Writes recorded cycles as one array per field."""
    arrays: dict[str, Any] = {name: np.ascontiguousarray(cycles[name]) for name in _fields(cycles)}
    np.savez_compressed(stream, **arrays)


def _write_csv(cycles: NDArray[np.void], stream: IO[bytes]) -> None:
    lines = TextIOWrapper(stream, encoding="utf-8", newline="")
    write_csv(cycle_columns(cycles), lines)
    lines.detach()


def _fields(cycles: NDArray[np.void]) -> list[str]:
    return list(cycles.dtype.names or ())


_WRITERS = {".csv": _write_csv, ".npz": write_npz}
