"""Joint samples of other programs: times and angles in a CSV or NPZ file at any rate."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from math import prod
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from rcilab.core.arrays import MAX_ANGLE, Array, JointPath, Unquoted, as_number, as_path, as_vector
from rcilab.core.atomic_file import read_limited
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import require_bytes, require_max_rows, require_rows
from rcilab.motion.npy_reader import Shapes, contains_numbers, read_arrays
from rcilab.motion.storage import KIND
from rcilab.motion.table import Table, read_table

AngleUnit: TypeAlias = Literal["rad", "deg"]

_ON_GRID = 1e-6
"""Tolerance of times at whole cycles, [s]: the rounding to six decimals."""

_MAX_TIME = 1e20
"""Largest time in a file, [s]: nanoseconds since 1970, read as seconds."""

_MANY_SAMPLES = 20
_TIME_KEYS = ("t", "time", "times")
_MOST_JOINTS = 7
_TIME = re.compile(r"(?:t|time|times|timestamp)[ _]*[\[(]?(s|ms|us|ns)?[\])]?")
_JOINT = re.compile(r"(?:(?:\w*[_./])?joint|q|j|axis)[ _]*(?:\[(\d{1,3})\]|(\d{1,3}))[ _]*[\[(]?(rad|deg|°)?[\])]?")
_SECONDS = {None: 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def is_on_grid(times: Array) -> bool:
    """Returns whether times, shape (N,), [s], are one controller cycle apart."""
    grid = times[0] + CYCLE_TIME * np.arange(len(times))
    return bool(np.abs(times - grid).max() < _ON_GRID)


def notes_on(times: Array) -> tuple[str, ...]:
    """Returns a note if many samples, shape (N,), [s], are a second or more apart: perhaps they are in milliseconds."""
    if len(times) < _MANY_SAMPLES or float(np.diff(times).min()) < 1.0:
        return ()
    span = float(times[-1] - times[0])
    return (f"the samples span {span:g} s, at least 1 s apart; if the times are in ms, name their column t [ms]",)


def read_samples(
    file: str | PathLike[str], rate_hz: float | None, unit: AngleUnit, max_rows: int
) -> tuple[Array, JointPath]:
    """Returns the times [s], shape (N,), and the joint angles [rad], shape (N, n), in a file.

    Arguments are those of `Motion.load_samples`.

    Raises:
        InvalidValueError: The file does not exist, or its samples are not valid; the message names the line.
    """
    require_max_rows(max_rows)
    if unit not in get_args(AngleUnit):
        raise InvalidValueError("unit", unit, f"is unknown; known: {', '.join(get_args(AngleUnit))}")
    if rate_hz is not None and not 0.0 < (rate_hz := as_number(rate_hz, "rate_hz", "Hz")) < math.inf:
        raise InvalidValueError("rate_hz", rate_hz, "must be above 0: samples per second [Hz]")
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("samples", file, "must be a file name")
    path = Path(fspath(file))
    if path.suffix.lower() not in _READERS:
        raise InvalidValueError("samples", str(path), f"must end in {' or '.join(_READERS)}")
    content = read_limited(path, "samples", lambda size: require_bytes(size, max_rows, "samples", path.name))
    times, q, locations = _READERS[path.suffix.lower()](content, path.name, rate_hz is not None, unit, max_rows)
    if times is None:
        if rate_hz is None:
            raise InvalidValueError(
                "samples",
                path.name,
                "has no times; add a column t [s] or, in Python, pass rate_hz, the samples per second",
            ).coded("table_no_times", file=path.name)
        times = np.arange(len(q)) / rate_hz
    elif rate_hz is not None:
        raise InvalidValueError("rate_hz", rate_hz, f"is not needed: {path.name} has times; omit it")
    _require_times(times, locations)
    _require_angles(q, locations)
    return times, q


def _from_csv(
    content: bytes, name: str, has_rate: bool, unit: AngleUnit, max_rows: int
) -> tuple[Array | None, Array, list[str]]:
    table = read_table(content, name, max_rows)
    locations = [f"{name}, line {line}" for line in table.lines]
    if table.header is not None:
        times, q = _by_header(table, table.header, name, unit)
        return times, q, locations
    first = 0 if has_rate else 1
    if table.columns == first:
        raise InvalidValueError(
            locations[0], "a single column", "needs a time and the joints; in Python, rate_hz replaces the time"
        )
    q = np.stack([table.column(i) for i in range(first, table.columns)], axis=1)
    if not has_rate:
        _require_times(table.column(0), locations, "; without a header the first column is the time: is it missing?")
    return None if has_rate else table.column(0), np.radians(q) if unit == "deg" else q, locations


def _by_header(table: Table, header: list[str], name: str, unit: AngleUnit) -> tuple[Array | None, Array]:
    """Returns times and angles from the columns with known names; others are ignored."""
    where = f"{name}, line {table.header_line}"
    times: Array | None = None
    joints: dict[int, Array] = {}
    for i, title in enumerate(header):
        text = title.lower()
        if time := _TIME.fullmatch(text):
            if times is not None:
                raise InvalidValueError(where, title, "is a second column of times; keep one of them").coded(
                    "table_twice"
                )
            times = table.column(i) * _SECONDS[time[1]]
        elif joint := _JOINT.fullmatch(text):
            number = int(joint[1] or joint[2])
            if number in joints:
                raise InvalidValueError(where, title, f"is a second column for joint {number}; keep one of them").coded(
                    "table_twice"
                )
            angles = table.column(i)
            joints[number] = np.radians(angles) if (joint[3] or unit) != "rad" else angles
    if sorted(joints) != list(range(1, len(joints) + 1)) or not joints:
        found = ", ".join(str(number) for number in sorted(joints)) or "none"
        problem = f"names the joints {found}; needs q1, q2, ... without a gap (t [s] for times, q1 [deg] for degrees)"
        if all(title.strip().lstrip("+-").isdecimal() for title in header):
            problem = "names no joints; begin with a line of names, q1, q2, ..., and use a point for decimals"
        raise InvalidValueError(where, ",".join(header), problem).coded("table_titles")
    return times, np.stack([joints[number] for number in sorted(joints)], axis=1)


def _from_npz(
    content: bytes, name: str, has_rate: bool, unit: AngleUnit, max_rows: int
) -> tuple[Array | None, Array, list[str]]:
    problem = "cannot be read: it is damaged, or not a NumPy archive; numpy.savez(file, t=..., q=...) writes one"
    arrays = read_arrays(
        content, "samples", name, problem, max_rows, lambda shapes: _require_shapes(shapes, name, max_rows)
    )
    if str(arrays.get("kind", "")) == KIND:
        raise InvalidValueError("samples", name, "is a saved motion; load it with Motion.load")
    if "q" not in arrays:
        found = ", ".join(arrays) or "nothing"
        raise InvalidValueError("samples", name, f"has no array q of joint angles (found: {found})")
    _require_numbers(arrays, name)
    q = as_path(arrays["q"], None, f"{name}, q", unit)
    key = next((key for key in _TIME_KEYS if key in arrays), None)
    times = None if key is None else as_vector(arrays[key], len(q), f"{name}, {key}", "s")
    locations = [f"{name}, row {row} (from 0)" for row in range(len(q))]
    return times, np.radians(q) if unit == "deg" else q, locations


def _require_numbers(arrays: Mapping[str, NDArray[Any]], name: str) -> None:
    for key in ("q", *_TIME_KEYS):
        if key in arrays and not contains_numbers(arrays[key]):
            raise InvalidValueError(f"{name}, {key}", Unquoted(f"array of {arrays[key].dtype}"), "needs real numbers")


def _require_shapes(shapes: Shapes, name: str, max_rows: int) -> None:
    """Requires arrays that are not too long or too wide, before they are read."""
    for key in ("q", *_TIME_KEYS):
        require_rows(next(iter(shapes.get(key, ())), 0), max_rows, "samples", name)
    q = shapes.get("q", ())
    if prod(q[1:]) > _MOST_JOINTS:
        raise InvalidValueError(f"{name}, q", f"array of shape {q}", f"must have at most {_MOST_JOINTS} joints")


_READERS = {".csv": _from_csv, ".npz": _from_npz}


def _require_times(times: Array, locations: list[str], hint: str = "") -> None:
    beyond = np.flatnonzero(np.abs(times) > _MAX_TIME)
    if beyond.size:
        i = int(beyond[0])
        problem = f"s is more than {_MAX_TIME:g}; are the times in s?"
        raise InvalidValueError(locations[i], float(times[i]), problem)
    not_later = np.flatnonzero(np.diff(times) <= 0.0)
    if not_later.size:
        i = int(not_later[0]) + 1
        problem = f"s is not later than the sample before, {times[i - 1]:g} s{hint}"
        raise InvalidValueError(locations[i], float(times[i]), problem).coded("table_order", before=f"{times[i - 1]:g}")


def _require_angles(q: Array, locations: list[str]) -> None:
    beyond = np.argwhere(np.abs(q) > MAX_ANGLE)
    if beyond.size:
        row, joint = (int(i) for i in beyond[0])
        problem = (
            f"rad of joint {joint + 1} is more than two turns; if the angles are in degrees, write so in a header, "
            f"q{joint + 1} [deg], or, in Python, pass unit='deg'"
        )
        raise InvalidValueError(locations[row], float(q[row, joint]), problem).coded("turns", joint=joint + 1)
