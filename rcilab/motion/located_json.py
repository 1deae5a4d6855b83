"""JSON with the line of every value, for files that people write by hand and that others may have spoiled.

Stricter than `json`: no NaN or infinity, no number beyond a double, no key twice, and only so much size and depth.
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
from rcilab.core.errors import InvalidValueError

LONGEST = 8_000_000
"""Largest text, [bytes]; tuning value: a program of 10 000 waypoints has 4 million."""
DEEPEST = 8
"""How deep lists and objects may be in each other; tuning value: a program needs 4."""

_BLANK = re.compile(r"[ \t\r\n]*")
_NUMBER = re.compile(r"-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?(?![\w.])", re.ASCII)
_WORD = re.compile(r"[^\s,:\[\]{}\"]+")
_DECODER = JSONDecoder()  # For text, with its escapes, and for what is only counted.
_CONSTANTS = {"true": True, "false": False, "null": None}

Content: TypeAlias = "dict[str, Node] | list[Node] | str | float | bool | None"


@dataclass(frozen=True, slots=True)
class Node:
    """A value and where it stands."""

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
    """A list has more values than its reader takes; nothing behind them was looked at."""

    def __init__(self, count: int, line: int) -> None:
        super().__init__(f"{count} values in line {line}")
        self.count, self.line = count, line


def read_json(content: bytes, name: str, most: Mapping[str, int] = MappingProxyType({})) -> Node:
    """Returns what a text holds, with lines.

    Args:
        content: JSON in UTF-8.
        name: What to call it in an error.
        most: How many values the lists under these keys may hold; other lists are bounded by the text alone.

    Raises:
        LongListError: One of those lists holds more.
        InvalidValueError: It is no JSON, or not what this reader takes; the message names the line.
    """
    if len(content) > LONGEST:
        raise InvalidValueError(name, Unquoted(f"{len(content) / 1e6:.1f} MB"), f"is above {LONGEST / 1e6:g} MB").coded(
            "file_large", file=name, size=f"{len(content) / 1e6:.1f}", most=f"{LONGEST / 1e6:g}"
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = "is no text in UTF-8; save it as JSON"
        raise InvalidValueError(f"{name}, line {line}", content[error.start : error.end], problem).coded(
            "file_no_text", file=name, line=line
        ) from error
    return _Reader(text, name, most).read()


class _Reader:
    """Walks through one text. Owned by the call of `read_json` that made it."""

    def __init__(self, text: str, name: str, most: Mapping[str, int]) -> None:
        self._text, self._name, self._most = text, name, most
        self._at = 0
        self._breaks = [match.start() for match in re.finditer("\n", text)]

    def read(self) -> Node:
        node = self._value(0)
        if self._next():
            raise self._error("follows after the end of the first value; a file holds one object")
        return node

    def _value(self, depth: int, key: str = "") -> Node:
        mark = self._next()
        line = self._line()
        if mark and mark in "{[":
            if depth == DEEPEST:
                raise self._error(f"opens more than {DEEPEST} levels; a program needs 4")
            self._at += 1
            return Node(self._object(depth) if mark == "{" else self._list(depth, self._most.get(key)), line)
        if mark == '"':
            return Node(self._string(), line)
        number = _NUMBER.match(self._text, self._at)
        if number is not None:
            value = float(number[0])
            if value in (float("inf"), -float("inf")):
                raise self._error("is beyond the largest number, 1.8e308")
            self._at = number.end()
            return Node(value, line)
        word = _WORD.match(self._text, self._at)
        if word is None or word[0] not in _CONSTANTS:
            raise self._error('is no value; JSON has numbers with a point, "text", true, false, null, [...] and {...}')
        self._at = word.end()
        return Node(_CONSTANTS[word[0]], line)

    def _object(self, depth: int) -> dict[str, Node]:
        found: dict[str, Node] = {}
        if self._takes("}"):
            return found
        while True:
            if self._next() != '"':
                raise self._error('is no key; a key is text in double quotes, such as "speed"')
            start = self._at
            key = self._string()
            if key in found:
                self._at = start
                raise self._error(f"is there already, in line {found[key].line}; keep one").coded(
                    "file_json_twice", file=self._name, line=self._line(), key=key, first=found[key].line
                )
            if not self._takes(":"):
                raise self._error(f"is no colon; one must follow the key {key!r}")
            found[key] = self._value(depth + 1, key)
            if self._takes("}"):
                return found
            if not self._takes(","):
                raise self._error("is neither a comma nor the end of the object }")

    def _list(self, depth: int, most: int | None) -> list[Node]:
        start, line = self._at - 1, self._line()
        found: list[Node] = []
        if self._takes("]"):
            return found
        while True:
            found.append(self._value(depth + 1))
            if most is not None and len(found) > most:
                raise LongListError(self._count(start, len(found)), line)
            if self._takes("]"):
                return found
            if not self._takes(","):
                raise self._error("is neither a comma nor the end of the list ]")

    def _count(self, start: int, least: int) -> int:
        """Returns how many values the list at a place has, without their lines; `least` where it is not sound."""
        try:
            return len(_DECODER.raw_decode(self._text, start)[0])
        except (ValueError, RecursionError):
            return least

    def _string(self) -> str:
        try:
            value, self._at = _DECODER.raw_decode(self._text, self._at)
        except JSONDecodeError as error:
            raise self._error(f"is no text: {error.msg.lower()}") from error
        return value

    def _next(self) -> str:
        """Returns the next character that is no blank, or nothing at the end."""
        match = _BLANK.match(self._text, self._at)
        assert match is not None
        self._at = match.end()
        return self._text[self._at : self._at + 1]

    def _takes(self, mark: str) -> bool:
        if self._next() != mark:
            return False
        self._at += 1
        return True

    def _line(self) -> int:
        return bisect_right(self._breaks, self._at - 1) + 1

    def _error(self, problem: str) -> InvalidValueError:
        word = _WORD.match(self._text, self._at)
        shown = word[0] if word else self._text[self._at : self._at + 20].split("\n")[0]
        found = Unquoted(shown[:60]) if shown else Unquoted("the end of the text")
        error = InvalidValueError(f"{self._name}, line {self._line()}", found, problem)
        if not shown:
            return error.coded("file_json_end", file=self._name, line=self._line())
        return error.coded("file_json", file=self._name, line=self._line(), found=str(found))
