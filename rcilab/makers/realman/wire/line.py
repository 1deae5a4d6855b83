"""Lines of the protocol: bytes to requests, answers to bytes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import msgspec

from rcilab.core.errors import DecodeError, InvalidValueError

LONGEST_LINE = 65536  # [bytes] Far beyond any request of the interface.
_END = b"\r\n"
_LARGEST = 2**31  # Integers of clients have 32 bits.


class LineReader:
    """Splits the bytes of a connection at CR LF. A line that ends with LF alone is not complete, as on a real arm."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Processes bytes and returns the complete lines, without their ends.

        Raises:
            DecodeError: A line is too long.
        """
        *lines, self._rest = (self._rest + data).split(_END)
        if len(self._rest) > LONGEST_LINE or any(len(line) > LONGEST_LINE for line in lines):
            raise DecodeError(f"a line is longer than {LONGEST_LINE} bytes; every line ends with CR LF")
        return [line for line in lines if line]


class Request(NamedTuple):
    """A request of a client."""

    command: str
    fields: Mapping[str, Any]
    """All members of the object; their values may be anything."""

    def integer(self, name: str, default: int | None = None) -> int:
        """Returns an integer.

        Raises:
            InvalidValueError: It is missing without a default, or is no integer of 32 bits.
        """
        value = self.fields.get(name, default)
        return _integer(name, value)

    def integers(self, name: str, count: int) -> tuple[int, ...]:
        """Returns a list of integers.

        Raises:
            InvalidValueError: It is missing, or is not `count` integers of 32 bits.
        """
        return _integers(name, self.fields.get(name), count)

    def flag(self, name: str, default: bool | None = None) -> bool:
        """Returns true or false; 0 and 1 count as such.

        Raises:
            InvalidValueError: It is missing without a default, or is neither.
        """
        value = self.fields.get(name, default)
        if value not in (True, False):
            raise InvalidValueError(name, value, "must be true or false")
        return bool(value)

    def text(self, name: str) -> str:
        """Returns a text.

        Raises:
            InvalidValueError: It is missing, or is no text.
        """
        value = self.fields.get(name)
        if not isinstance(value, str):
            raise InvalidValueError(name, value, "must be a text")
        return value

    def inner(self, name: str) -> Request:
        """Returns an object inside this one, to read its members.

        Raises:
            InvalidValueError: It is missing, or is no object.
        """
        value = self.fields.get(name)
        if not isinstance(value, dict):
            raise InvalidValueError(name, value, "must be an object")
        return Request(self.command, value)


def decode_request(line: bytes) -> Request:
    """Returns the request of a line.

    Raises:
        DecodeError: It is no JSON object with a command.
    """
    try:
        content = msgspec.json.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DecodeError(f"no valid JSON: {error}") from error
    command = content.get("command") if isinstance(content, dict) else None
    if not isinstance(command, str):
        raise DecodeError("no object with a command")
    return Request(command, content)


def encode_answer(answer: Mapping[str, object]) -> bytes:
    """Returns the line of an answer."""
    return msgspec.json.encode(answer) + _END


def _integer(name: str, value: object) -> int:
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or not -_LARGEST <= value < _LARGEST:
        raise InvalidValueError(name, value, "must be an integer of 32 bits")
    return value


def _integers(name: str, value: object, count: int) -> tuple[int, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise InvalidValueError(name, value, f"must be {count} integers")
    return tuple(_integer(name, item) for item in value)
