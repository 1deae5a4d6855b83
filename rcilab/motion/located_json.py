"""JSON with the line of every value, for files that are written by hand or come from unknown sources.

Stricter than `json`: no NaN or infinity, no number beyond a double, no duplicate key, and bounded size and depth.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from json import JSONDecodeError, JSONDecoder
from types import MappingProxyType
from typing import TypeAlias

from rcilab.core.arrays import Unquoted
from rcilab.core.errors import InvalidValueError, plain_text

MAX_BYTES = 8_000_000
"""Largest text, [bytes]; tuning value: a program of 10 000 waypoints has 4 million."""
MAX_VALUES = 300_000
"""Largest number of values; tuning value: a program of 10 000 waypoints has 200 000."""
MAX_DEPTH = 8
"""Largest nesting depth of lists and objects; tuning value: a program needs 4."""

_WHITESPACE = re.compile(r"[ \t\r\n]*")
_NUMBER = re.compile(r"-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?(?![\w.])", re.ASCII)
_WORD = re.compile(r"[^\s,:\[\]{}\"]+")
_DECODER = JSONDecoder()  # For strings with escapes, and to count items.
_SHOWN = 60  # [characters] Of the text in an error.
_CONSTANTS = {"true": True, "false": False, "null": None}

Content: TypeAlias = "dict[str, Node] | list[Node] | str | float | bool | None"


@dataclass(frozen=True, slots=True)
class Node:
    """A value and its line."""

    value: Content
    """Every number is a float."""
    line: int
    """From 1."""

    def plain(self) -> object:
        """Returns the value without the lines."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        return [node.plain() for node in self.value] if isinstance(self.value, list) else self.value


class LongListError(Exception):
    """A list has more values than allowed; the rest of the text has not been checked."""

    def __init__(self, count: int, line: int) -> None:
        super().__init__(f"{count} values in line {line}")
        self.count, self.line = count, line


def require_length(size: int, name: str) -> None:
    """Requires a text that is not too long.

    Args:
        size: Its length, [bytes].
        name: Name of the text, for errors.

    Raises:
        InvalidValueError: It is too long.
    """
    if size > MAX_BYTES:
        raise InvalidValueError(name, Unquoted(f"{size / 1e6:.1f} MB"), f"is above {MAX_BYTES / 1e6:g} MB").coded(
            "file_large", file=name, size=f"{size / 1e6:.1f}", most=f"{MAX_BYTES / 1e6:g}"
        )


def read_json(content: bytes, name: str, max_items: Mapping[str, int] = MappingProxyType({})) -> Node:
    """Returns the content of a JSON text, with lines.

    Args:
        content: JSON in UTF-8.
        name: Name of the text, for errors.
        max_items: Largest number of values in the lists under these keys; other lists are bounded by
            the text's size alone.

    Raises:
        LongListError: One of those lists has more values.
        InvalidValueError: The text is not valid JSON, or exceeds a bound; the message names the line.
    """
    require_length(len(content), name)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = "is not UTF-8 text; save the file as JSON"
        raise InvalidValueError(f"{name}, line {line}", content[error.start : error.end], problem).coded(
            "file_no_text", file=name, line=line
        ) from error
    return _Reader(text, name, max_items).read()


class _Reader:
    """Parses one text. Owned by one call of `read_json`."""

    def __init__(self, text: str, name: str, max_items: Mapping[str, int]) -> None:
        self._text, self._name, self._max_items = text, name, max_items
        self._position = self._values = 0
        self._line_breaks = [match.start() for match in re.finditer("\n", text)]

    def read(self) -> Node:
        if not self._peek():
            raise InvalidValueError(self._name, Unquoted("the text"), "is empty").coded(
                "file_json_end", file=self._name, line=1
            )
        node = self._value(0)
        if self._peek():
            raise self._error("follows the end of the first value; a file contains one object")
        return node

    def _value(self, depth: int, key: str = "") -> Node:
        character = self._peek()
        line = self._line()
        self._values += 1
        if self._values > MAX_VALUES:
            raise self._error(f"is one value more than {MAX_VALUES}, the most in a file")
        if character and character in "{[":
            if depth == MAX_DEPTH:
                raise self._error(f"opens more than {MAX_DEPTH} levels; a program needs 4")
            self._position += 1
            return Node(self._object(depth) if character == "{" else self._list(depth, self._max_items.get(key)), line)
        if character == '"':
            return Node(self._string(), line)
        number = _NUMBER.match(self._text, self._position)
        if number is not None:
            value = float(number[0])
            if value in (float("inf"), -float("inf")):
                raise self._error("is beyond the largest number, 1.8e308")
            self._position = number.end()
            return Node(value, line)
        word = _WORD.match(self._text, self._position)
        if word is None or word[0] not in _CONSTANTS:
            raise self._error(
                'is not a value; JSON has numbers with a point, "text", true, false, null, [...] and {...}'
            )
        self._position = word.end()
        return Node(_CONSTANTS[word[0]], line)

    def _object(self, depth: int) -> dict[str, Node]:
        found: dict[str, Node] = {}
        if self._accept("}"):
            return found
        while True:
            if self._peek() != '"':
                raise self._error('is not a key; a key is text in double quotes, such as "speed"')
            start = self._position
            key = self._string()
            if key in found:
                shown, first = self._text[start : self._position], found[key].line
                self._position = start
                raise self._error(f"is a duplicate of the key in line {first}; keep one", shown).coded(
                    "file_json_twice", file=self._name, line=self._line(), key=plain_text(key, _SHOWN), first=first
                )
            if not self._accept(":"):
                raise self._error(f"is not a colon; the key {key!r} needs one")
            found[key] = self._value(depth + 1, key)
            if self._accept("}"):
                return found
            if not self._accept(","):
                raise self._error("is neither a comma nor the end of the object }")

    def _list(self, depth: int, max_items: int | None) -> list[Node]:
        start, line = self._position - 1, self._line()
        found: list[Node] = []
        if self._accept("]"):
            return found
        while True:
            found.append(self._value(depth + 1))
            if max_items is not None and len(found) > max_items:
                raise LongListError(self._count_items(start, len(found)), line)
            if self._accept("]"):
                return found
            if not self._accept(","):
                raise self._error("is neither a comma nor the end of the list ]")

    def _count_items(self, start: int, least: int) -> int:
        """Returns the number of values in the list at `start`, or `least` if the list is not valid."""
        try:
            return len(_DECODER.raw_decode(self._text, start)[0])
        except (ValueError, RecursionError):
            return least

    def _string(self) -> str:
        try:
            value, self._position = _DECODER.raw_decode(self._text, self._position)
        except JSONDecodeError as error:
            raise self._error(f"is not valid text: {error.msg.lower()}") from error
        return value

    def _peek(self) -> str:
        """Skips whitespace and returns the next character, or "" at the end."""
        match = _WHITESPACE.match(self._text, self._position)
        assert match is not None
        self._position = match.end()
        return self._text[self._position : self._position + 1]

    def _accept(self, character: str) -> bool:
        if self._peek() != character:
            return False
        self._position += 1
        return True

    def _line(self) -> int:
        return bisect_right(self._line_breaks, self._position - 1) + 1

    def _error(self, problem: str, shown: str = "") -> InvalidValueError:
        if not shown:
            word = _WORD.match(self._text, self._position)
            shown = word[0] if word else self._text[self._position : self._position + 20].split("\n")[0]
        shown = plain_text(shown, _SHOWN)
        found = Unquoted(shown or "the end of the text")
        error = InvalidValueError(f"{self._name}, line {self._line()}", found, problem)
        if not shown:
            return error.coded("file_json_end", file=self._name, line=self._line())
        return error.coded("file_json", file=self._name, line=self._line(), found=shown)
