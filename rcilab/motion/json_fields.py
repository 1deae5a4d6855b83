"""Reads objects, texts, numbers and lists from located JSON; every error names file, line and key."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.core.arrays import Unquoted
from rcilab.core.errors import InvalidValueError, plain_text
from rcilab.motion.located_json import Node

_EXCERPT_LENGTH = 40  # [characters] Of a value in an error message.


def read_object(node: Node, name: str, kind: str, keys: Sequence[str], code: str = "file_kind") -> dict[str, Node]:
    """Returns the entries of an object that has no other keys than these.

    Args:
        node: The value.
        name: Name of the file.
        kind: What the object is, such as "a program".
        keys: Allowed keys.
        code: Of the error for something else.

    Raises:
        InvalidValueError: It is not an object, or has another key.
    """
    if not isinstance(node.value, dict):
        raise InvalidValueError(f"{name}, line {node.line}", node.plain(), f"must be {kind}: an object {{...}}").coded(
            code, file=name, line=node.line, key=kind
        )
    for key, value in node.value.items():
        if key not in keys:
            raise InvalidValueError(
                f"{name}, line {value.line}, {kind}, {key}", value.plain(), f"is unknown; known: {', '.join(keys)}"
            ).coded("file_unknown", file=name, line=value.line, key=excerpt(key))
    return node.value


def read_text(name: str, node: Node, key: str) -> str:
    """Returns a text; arguments as of `read_vector`."""
    if not isinstance(node.value, str):
        raise _wrong_type(name, node, key, "must be text in double quotes")
    return node.value


def read_number(name: str, node: Node, key: str) -> float:
    """Returns a number; arguments as of `read_vector`."""
    if not isinstance(node.value, float):
        raise _wrong_type(name, node, key, "must be a number")
    return node.value


def read_flag(name: str, node: Node, key: str) -> bool:
    """Returns a truth value; arguments as of `read_vector`."""
    if not isinstance(node.value, bool):
        raise _wrong_type(name, node, key, "must be true or false")
    return node.value


def read_list(name: str, node: Node, key: str) -> list[Node]:
    """Returns a list; arguments as of `read_vector`."""
    if not isinstance(node.value, list):
        raise _wrong_type(name, node, key, "must be a list [{...}, {...}]")
    return node.value


def read_vector(name: str, node: Node, key: str) -> tuple[float, ...]:
    """Returns a list of numbers.

    Args:
        name: Name of the file.
        node: The value.
        key: Its key.

    Raises:
        InvalidValueError: It is something else.
    """
    if not isinstance(node.value, list):
        raise _wrong_type(name, node, key, "must be a list of numbers [...]")
    return tuple(read_number(name, item, f"{key}, number {i}") for i, item in enumerate(node.value, 1))


def located(error: InvalidValueError, name: str, node: Node, prefix: str = "", number: int = 0) -> InvalidValueError:
    """Returns an error of a value with its place in the file.

    Args:
        error: The error.
        name: Name of the file.
        node: The value.
        prefix: What the value belongs to, such as "waypoint 3, ".
        number: Number of the waypoint; 0 for a value of none.
    """
    value = Unquoted("nothing") if error.value is None else error.value
    placed = InvalidValueError(f"{name}, line {node.line}, {prefix}{error.name}", value, error.requirement)
    reason = error if error.code else error.requirement
    facts: dict[str, object] = {"file": name, "line": node.line, "key": error.name, "value": excerpt(error.value)}
    if number:
        return placed.coded("file_waypoint", number=number, reason=reason, **facts)
    return placed.coded("file_value", reason=reason, **facts)


def location(name: str, node: Node, key: str) -> str:
    """Returns where a value is, for errors."""
    return f"{name}, line {node.line}, {key}"


def excerpt(value: object) -> str:
    """Returns the beginning of a value as plain text."""
    return plain_text("" if value is None else str(value), _EXCERPT_LENGTH)


def _wrong_type(name: str, node: Node, key: str, problem: str) -> InvalidValueError:
    return InvalidValueError(location(name, node, key), node.plain(), problem).coded(
        "file_kind", file=name, line=node.line, key=key
    )
