"""Paths of other programs as waypoints: G-code, and tables of positions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from rcilab.core.arrays import as_number, described
from rcilab.core.atomic_file import read_limited
from rcilab.core.errors import InvalidValueError, plain_text
from rcilab.i18n.translator import Remark
from rcilab.model.robot_model import RobotModel, require_model
from rcilab.motion.gcode import read_gcode
from rcilab.motion.joint import DEFAULT_SPEED, MIN_SPEED
from rcilab.motion.located_json import require_length
from rcilab.motion.path import Point
from rcilab.motion.path_move import PathMove
from rcilab.motion.path_table import read_path_table
from rcilab.motion.waypoint import Waypoint, require_count, vector_of
from rcilab.motion.waypoint_types import LARGEST_BLEND, Floats

GCODE_SUFFIXES = (".nc", ".gcode", ".ngc", ".tap")
PATH_SUFFIXES = (".csv", *GCODE_SUFFIXES)
"""Endings of the names of files with paths."""
TOOL_DOWN: Floats = (0.0, 0.0, 1.0, 0.0)
"""Orientation of a tool along -z of the frame, its x axis along -x."""

_FLAT = 1e-6  # [m] An arc that leaves its chord by less is a line: it would have no plane.
_NEARLY_FULL = 1e-2  # [rad] An arc that lacks less than this to a full turn is a circle: its ends are too close.
_DIGITS = 12  # After the point, of positions in m.
_BLEND_PART = 0.99
"""Part of half a move that a blend takes at most; the rest is for rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportedPath:
    """The waypoints of a path, and what was left out or changed."""

    waypoints: tuple[Waypoint, ...]
    notes: tuple[Remark, ...] = ()


def load_path(file: str | PathLike[str], model: RobotModel, **options: Any) -> ImportedPath:
    """Returns the waypoints of a path in a file; arguments as of `read_path`.

    Raises:
        InvalidValueError: The file does not exist, or its path is not valid; the message names the line.
    """
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("path", described(file), "must be a file name")
    path = Path(fspath(file))
    return read_path(
        read_limited(path, "path", lambda size: require_length(size, path.name)), path.name, model, **options
    )


def read_path(
    content: bytes,
    name: str,
    model: RobotModel,
    *,
    frame: str | None = None,
    wxyz: ArrayLike = TOOL_DOWN,
    speed: float = DEFAULT_SPEED,
    blend: float = 0.0,
) -> ImportedPath:
    """Returns the waypoints of a path.

    The first waypoint is a joint move, which leads there from anywhere; all others are lines, arcs and circles.

    Args:
        content: Content of the file.
        name: Its name, ending in one of `PATH_SUFFIXES`.
        model: The arm; its limits convert feeds.
        frame: Name of the frame that the path is given in; None: base.
        wxyz: Orientation of the tool in that frame, a unit quaternion, where the file has none.
        speed: Part of the limits for moves without a feed.
        blend: Radius of the corners, up to 1, [m]; as much of it as fits into half of the shorter neighbour.

    Raises:
        InvalidValueError: The path is not valid; the message names file, line, value and remedy.
    """
    require_model(model)
    suffix = Path(name).suffix.lower()
    if suffix not in PATH_SUFFIXES:
        raise InvalidValueError("path", name, f"must end in one of {', '.join(PATH_SUFFIXES)}").coded(
            "path_suffix", file=name, known=", ".join(PATH_SUFFIXES)
        )
    for what, value, low, high in (("speed", speed, MIN_SPEED, 1.0), ("blend", blend, 0.0, LARGEST_BLEND)):
        if not low <= as_number(value, what) <= high:
            error = InvalidValueError(what, value, f"must be from {low:g} to {high:g}")
            raise error.coded("span", low=f"{low:g}", high=f"{high:g}")
    require_length(len(content), name)
    notes: list[Remark] = []
    if suffix == ".csv":
        moves = read_path_table(content, name)
    else:
        moves, notes = read_gcode(content, name)
    if not moves:
        problem = "has no moves; it needs lines such as G1 X10 Y0 Z5 F600"
        raise InvalidValueError("path", name, problem).coded("path_no_moves", file=name)
    moves = _without_repetitions(moves)
    require_count(len(moves))
    speeds, changed = _speeds(moves, name, model.limits.cartesian.translation_velocity, speed)
    radii = _blends(moves, blend)
    tool = vector_of("wxyz", wxyz)
    waypoints: list[Waypoint] = []
    for index, (move, share, radius) in enumerate(zip(moves, speeds, radii, strict=True)):
        fields: dict[str, Any] = {"frame": frame, "speed": share, "blend": radius, "dwell": move.dwell}
        try:
            waypoints.append(_waypoint(move, tool, is_first=index == 0, **fields))
        except InvalidValueError as error:
            raise _placed(error, name, move.line) from error
    return ImportedPath(waypoints=tuple(waypoints), notes=(*notes, *changed))


def _waypoint(move: PathMove, tool: Floats, *, is_first: bool, **fields: Any) -> Waypoint:
    fields |= {"position": _rounded(move.position), "wxyz": move.wxyz or tool}
    arc = move.arc
    if is_first:
        return Waypoint(type="joint", **fields)
    if arc is None or arc.radius * (1.0 - math.cos(0.5 * min(arc.angle, math.pi))) < _FLAT:
        return Waypoint(type="line", **fields)
    if arc.angle > math.tau - _NEARLY_FULL:
        del fields["position"], fields["wxyz"]
        angle = None if arc.angle == math.tau else arc.angle
        return Waypoint(type="circle", center=_rounded(arc.center), axis=arc.axis, angle=angle, **fields)
    return Waypoint(type="arc", via=_rounded(arc.via), **fields)


def _rounded(point: Point) -> Floats:
    """Returns a point without the rounding errors of units, [m]."""
    return tuple(round(number, _DIGITS) for number in point)


def _without_repetitions(moves: Sequence[PathMove]) -> list[PathMove]:
    """Returns the moves without those to the place of the one before, where the tool would stop."""
    kept = [moves[0]]
    for move in moves[1:]:
        before = kept[-1]
        if move.arc is None and (move.position, move.wxyz) == (before.position, before.wxyz):
            kept[-1] = before.with_dwell(move.dwell)
        else:
            kept.append(move)
    return kept


def _blends(moves: Sequence[PathMove], blend: float) -> list[float]:
    """Returns the blend radius at the end of each move, [m]; none at the last one."""
    rooms = [math.inf]  # A joint move leads to the first one.
    rooms += [_BLEND_PART * move.largest_blend(before.position) for before, move in pairwise(moves)]
    radii = [min(blend, *pair) for pair in pairwise(rooms)]
    return [*radii, 0.0]


def _speeds(moves: Sequence[PathMove], name: str, limit: float, usual: float) -> tuple[list[float], list[Remark]]:
    """Returns the part of the limits for each move, and notes on those that are out of range.

    Args:
        moves: The moves.
        name: Name of the file.
        limit: Largest speed of the tool, [m/s].
        usual: Part of the limits for moves without a feed.
    """
    shares: list[float] = []
    beyond: dict[str, list[int]] = {"path_fast": [], "path_slow": []}
    for move in moves:
        share = move.feed / limit if move.feed is not None else usual if move.speed is None else move.speed
        if not share > 0.0:
            error = InvalidValueError("speed", share, "must be above 0")
            raise _placed(error.coded("span", low="0", high="1"), name, move.line)
        if share > 1.0:
            beyond["path_fast"].append(move.line)
        elif share < MIN_SPEED:
            beyond["path_slow"].append(move.line)
        shares.append(min(max(share, MIN_SPEED), 1.0))
    texts = {
        "path_fast": "is faster than the arm can be; the tool moves with its largest speed, {0:.4g} m/s",
        "path_slow": "is slower than programs can be; the tool moves with {0:.4g} m/s",
    }
    speeds = {"path_fast": limit, "path_slow": MIN_SPEED * limit}
    return shares, [
        Remark(
            f"{name}, line {lines[0]}: the feed {texts[code].format(speeds[code])} (lines: {len(lines)})",
            code, file=name, line=lines[0], count=len(lines), speed=speeds[code],
        )
        for code, lines in beyond.items()
        if lines
    ]  # fmt: skip


def _placed(error: InvalidValueError, name: str, line: int) -> InvalidValueError:
    """Returns the error of a value with its line."""
    placed = InvalidValueError(f"{name}, line {line}, {error.name}", error.value, error.requirement)
    reason = error if error.code else error.requirement
    value = plain_text("" if error.value is None else str(error.value), 40)
    return placed.coded("file_value", file=name, line=line, key=error.name, value=value, reason=reason)
