"""Paths in tables: a CSV of positions, with orientations and speeds if it has columns for them."""

from __future__ import annotations

import re

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.errors import InvalidValueError
from rcilab.core.file_bounds import DEFAULT_MAX_ROWS
from rcilab.core.spatial import Pose
from rcilab.motion.path_move import PathMove
from rcilab.motion.table import Table, read_table
from rcilab.motion.waypoint import require_count
from rcilab.motion.waypoint_types import MAX_COORDINATE

_POSITION = re.compile(r"(?:\w*[_. ])?([xyz])[ _]*[\[(]?(um|mm|cm|m|in)?[\])]?")
_QUATERNION = re.compile(r"q[_ ]?([wxyz])")
_ROTATION = re.compile(r"(roll|pitch|yaw)[ _]*[\[(]?(rad|deg|°)?[\])]?")
_SPEED = re.compile(r"(?:speed|feed|v)[ _]*[\[(]?(m/s|mm/s|mm/min|in/min|%)?[\])]?")
_METRES = {None: 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
_FEEDS = {"m/s": 1.0, "mm/s": 1e-3, "mm/min": 1e-3 / 60.0, "in/min": 0.0254 / 60.0}
_SHARES = {None: 1.0, "%": 0.01}


def read_path_table(content: bytes, name: str) -> list[PathMove]:
    """Returns the moves to the rows of a table; see `Program.from_path` for its columns.

    Raises:
        InvalidValueError: The table is not valid; the message names file, line, value and remedy.
    """
    table = read_table(content, name, DEFAULT_MAX_ROWS)
    require_count(len(table.lines))
    positions, wxyz, feeds, shares = _columns(table, name)
    return [
        PathMove(
            line=line,
            position=(float(x), float(y), float(z)),
            wxyz=None if wxyz is None else tuple(wxyz[row].tolist()),
            feed=None if feeds is None else float(feeds[row]),
            speed=None if shares is None else float(shares[row]),
        )
        for row, (line, (x, y, z)) in enumerate(zip(table.lines, positions, strict=True))
    ]


def _columns(table: Table, name: str) -> tuple[Array, Array | None, Array | None, Array | None]:
    """Returns positions [m], quaternions, feeds [m/s] and parts of the limits, each None if it has no column."""
    if table.header is None:
        if table.columns != 3:
            problem = "columns; without a header there must be three, x, y and z in m"
            raise InvalidValueError(f"{name}, line {table.lines[0]}", table.columns, problem).coded("path_columns")
        return np.stack([table.column(i) for i in range(3)], axis=1), None, None, None
    where = f"{name}, line {table.header_line}"
    found: dict[str, Array] = {}
    for index, title in enumerate(table.header):
        key, factor = _meaning(title.lower())
        if key in found:
            raise InvalidValueError(where, title, f"is a second column for {key}; keep one of them").coded(
                "table_twice"
            )
        if key:
            found[key] = table.column(index) * factor
    rotations = [key for key in ("roll", "pitch", "yaw") if key in found]
    quaternion = [key for key in ("qw", "qx", "qy", "qz") if key in found]
    for present, needed in ((rotations, 3), (quaternion, 4)):
        if present and len(present) != needed:
            problem = "is not a whole orientation; it has roll, pitch, yaw, or qw, qx, qy, qz"
            raise InvalidValueError(where, ",".join(present), problem).coded("path_orientation")
    if not {"x", "y", "z"} <= found.keys() or (rotations and quaternion):
        problem = (
            "must name x, y and z, and at most one orientation, roll, pitch, yaw or qw, qx, qy, qz; units are written "
            "as x [mm]"
        )
        raise InvalidValueError(where, ",".join(table.header), problem).coded("path_titles", title="x [mm]")
    wxyz = np.stack([found[key] for key in quaternion], axis=1) if quaternion else None
    if rotations:
        angles = zip(*(found[key] for key in rotations), strict=True)
        wxyz = np.array([Pose.from_rpy((0.0, 0.0, 0.0), rpy).wxyz for rpy in angles])
    for key in "xyz":
        beyond = np.flatnonzero(np.abs(found[key]) > MAX_COORDINATE)
        if beyond.size:
            row = int(beyond[0])
            problem = f"m is beyond {MAX_COORDINATE:g} m; if it is in another unit, name its column {key} [mm]"
            raise InvalidValueError(f"{name}, line {table.lines[row]}", float(found[key][row]), problem).coded(
                "path_beyond", most=f"{MAX_COORDINATE:g}", title=f"{key} [mm]"
            )
    return np.stack([found[key] for key in "xyz"], axis=1), wxyz, found.get("feed"), found.get("speed")


def _meaning(title: str) -> tuple[str, float]:
    """Returns what a column is, "" if it is something else, and the factor to its unit."""
    if match := _QUATERNION.fullmatch(title):
        return f"q{match[1]}", 1.0
    if match := _ROTATION.fullmatch(title):
        return match[1], np.pi / 180.0 if match[2] in ("deg", "°") else 1.0
    if match := _SPEED.fullmatch(title):
        unit = match[1]
        return ("feed", _FEEDS[unit]) if unit in _FEEDS else ("speed", _SHARES[unit])
    if match := _POSITION.fullmatch(title):
        return match[1], _METRES[match[2]]
    return "", 1.0
