"""Programs as JSON, with an exact round trip and errors that name the line."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rcilab.core.arrays import described
from rcilab.core.atomic_file import read_limited, replacing
from rcilab.core.errors import InvalidValueError, ModelError, VersionMismatchError
from rcilab.motion.json_fields import (
    excerpt,
    located,
    location,
    read_flag,
    read_number,
    read_object,
    read_text,
    read_vector,
)
from rcilab.motion.located_json import LongListError, Node, read_json, require_length
from rcilab.motion.waypoint import Waypoint, require_count, require_fit
from rcilab.motion.waypoint_types import ALLOWED, CHOICES, COMMON_FIELDS, MOST_WAYPOINTS
from rcilab.robots import RobotDescription, describe_robot

if TYPE_CHECKING:
    from rcilab.motion.program import Program

P = TypeVar("P")

FORMAT = "rcilab program"
VERSION = 1

_SCALARS = ("angle", "psi", "approach", "distance", "timeout", "count", *COMMON_FIELDS)
_TEXTS = ("frame", "text", *CHOICES)
_PROGRAM_KEYS = ("format", "version", "name", "model", "tool", "payload", "box", "start", "waypoints")


def program_text(program: Program) -> str:
    """Returns a program as JSON, one waypoint per line."""
    head = {"format": FORMAT, "version": VERSION, "name": program.name, "model": program.model}
    lines = [f"  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in head.items()]
    for key, numbers in (("tool", program.tool), ("payload", program.payload), ("box", program.box)):
        if numbers is not None:
            lines.append(f"  {json.dumps(key)}: {json.dumps(numbers)}")
    lines.append(f'  "start": {json.dumps(program.start)}')
    waypoints = ",\n".join(f"    {json.dumps(_as_json_object(waypoint))}" for waypoint in program.waypoints)
    lines.append(f'  "waypoints": [\n{waypoints}\n  ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def save_program(program: Program, file: str | PathLike[str]) -> None:
    """Writes a program as JSON.

    Raises:
        InvalidValueError: The name does not end in .json, or the file cannot be written.
    """
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("program file", described(file), "must be a file name")
    if Path(fspath(file)).suffix.lower() != ".json":
        raise InvalidValueError("program file", fspath(file), "must end in .json")
    try:
        with replacing(file) as stream:
            stream.write(program_text(program).encode())
    except OSError as error:
        raise InvalidValueError("program file", fspath(file), f"cannot be written: {error.strerror}").coded(
            "file_unwritable", file=fspath(file)
        ) from error


def load_program(file: str | PathLike[str], build: Callable[..., P]) -> P:
    """Returns the program in a file; arguments as of `read_program`.

    Raises:
        InvalidValueError: The file does not exist, or its program is not valid.
        VersionMismatchError: It has another version of this format.
    """
    if not isinstance(file, str | PathLike):
        raise InvalidValueError("program file", described(file), "must be a file name")
    path = Path(fspath(file))
    content = read_limited(path, "program file", lambda size: require_length(size, path.name))
    return read_program(content, path.name, build)


def read_program(content: bytes, name: str, build: Callable[..., P]) -> P:
    """Returns the program in a JSON text, built by `build` with the keyword arguments of `Program`.

    Args:
        content: JSON in UTF-8.
        name: Name of the text, for errors.
        build: Builds the program; raises InvalidValueError for an invalid value.

    Raises:
        InvalidValueError: The program is not valid; the message names line, key, value, bound and remedy.
        VersionMismatchError: It has another version of this format.
    """
    try:
        root = read_json(content, name, {"waypoints": MOST_WAYPOINTS})
    except LongListError as too_long:  # Reported before the rest is read.
        try:
            require_count(too_long.count)
        except InvalidValueError as error:
            raise located(error, name, Node([], too_long.line)) from error
        raise
    found = read_object(root, name, "a program", _PROGRAM_KEYS, "file_no_program")
    for key, expected in (("format", FORMAT), ("version", float(VERSION))):
        if key not in found:
            raise InvalidValueError(
                f"{name}, {key}", None, f'is missing; a program has "{key}": {json.dumps(_as_json_number(expected))}'
            ).coded("file_missing", file=name, key=key)
        value = found[key].value
        if key == "version" and value != expected:
            what = f"{name}, line {found[key].line}, version"
            advice = "the rcilab that wrote it reads it; a program written by hand has version 1"
            raise VersionMismatchError(what, _as_json_number(value), VERSION, advice)
        if value != expected:
            raise InvalidValueError(location(name, found[key], key), found[key].plain(), f"must be {expected!r}").coded(
                "file_no_program", file=name, line=found[key].line
            )
    for key in ("model", "start", "waypoints"):
        if key not in found:
            raise InvalidValueError(
                f"{name}, {key}", None, "is missing; a program has model, start and waypoints"
            ).coded("file_missing", file=name, key=key)
    texts = {key: read_text(name, found[key], key) for key in ("name", "model") if key in found}
    vectors = {key: read_vector(name, found[key], key) for key in ("start", "tool", "payload", "box") if key in found}
    waypoint_list = found["waypoints"]
    if not isinstance(waypoint_list.value, list):
        raise InvalidValueError(
            location(name, waypoint_list, "waypoints"), waypoint_list.plain(), "must be a list [{...}, {...}]"
        ).coded("file_kind", file=name, line=waypoint_list.line, key="waypoints")
    try:
        robot = describe_robot(str(texts["model"]))
    except ModelError as error:
        raise InvalidValueError(
            location(name, found["model"], "model"), texts["model"], f"is not a known model: {error}"
        ).coded("file_model", file=name, line=found["model"].line, model=excerpt(texts["model"])) from error
    try:
        require_count(len(waypoint_list.value))
    except InvalidValueError as error:
        raise located(error, name, waypoint_list) from error
    waypoints = tuple(_waypoint(node, number, name, robot) for number, node in enumerate(waypoint_list.value, 1))
    try:
        return build(waypoints=waypoints, **texts, **vectors)
    except InvalidValueError as error:
        key = "tool" if error.name == "wxyz" else error.name.split()[0]  # "box wxyz" is about "box".
        raise located(error, name, found.get(key, root)) from error


def _waypoint(node: Node, number: int, name: str, robot: RobotDescription) -> Waypoint:
    kind = f"waypoint {number}"
    keys = tuple(field.name for field in fields(Waypoint))
    found = read_object(node, name, kind, keys)
    if "type" not in found:
        raise InvalidValueError(
            f"{name}, line {node.line}, {kind}, type", None, f"is missing; known: {', '.join(ALLOWED)}"
        ).coded("file_missing_of", file=name, line=node.line, number=number, key="type")
    values: dict[str, Any] = {"type": read_text(name, found["type"], f"{kind}, type")}
    for key, value in found.items():
        if key == "type" or (value.value is None and key not in COMMON_FIELDS):
            continue
        what = f"{kind}, {key}"
        values[key] = _reader(key, value)(name, value, what)
    try:
        waypoint = Waypoint(**values)
        require_fit(waypoint, robot)
        return waypoint
    except InvalidValueError as error:
        raise located(
            error, name, found.get(error.name, node), f"waypoint {number} ({values['type']}), ", number
        ) from error


def _reader(key: str, node: Node) -> Callable[[str, Node, str], object]:
    if key in _SCALARS or (key == "signal" and not isinstance(node.value, str)):
        return read_number
    if key in _TEXTS or key == "signal":
        return read_text
    return read_flag if key == "level" else read_vector


def _as_json_number(value: object) -> object:
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _as_json_object(waypoint: Waypoint) -> dict[str, object]:
    keys = ("type", *ALLOWED[waypoint.type])
    values = {field.name: getattr(waypoint, field.name) for field in fields(Waypoint) if field.name in keys}
    return {key: value for key, value in values.items() if value is not None}
