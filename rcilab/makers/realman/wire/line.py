"""Lines of the protocol: bytes to requests, answers to bytes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import msgspec

from rcilab.core.errors import DecodeError, InvalidValueError

LONGEST_LINE = 65536  # [bytes] Far beyond any request of the interface.
LONGEST_FILE = 200_000  # [bytes] Of a program, about 4000 points; rcilab's own value.
_END = b"\r\n"
_REQUEST = b'{"command"'
_LARGEST = 2**31  # Integers of clients have 32 bits.


class LineReader:
    """Splits the bytes of a connection at CR LF. A line that ends with LF alone is not complete, as on a real arm.

    Behind a line that announces a file, the file is one frame, whatever it contains. What is sent behind it, before the
    next request, is dropped: the client library 1.1.6 adds some bytes of its buffer.
    """

    def __init__(self) -> None:
        self._rest = b""
        self._file = 0  # [bytes] Of the file that follows.
        self._is_behind_file = False

    def feed(self, data: bytes) -> list[bytes]:
        """Processes bytes and returns the complete lines, without their ends.

        Raises:
            DecodeError: A line is too long.
        """
        self._rest += data
        frames: list[bytes] = []
        while (frame := self._take()) is not None:
            if frame:
                frames.append(frame)
        return frames

    def _take(self) -> bytes | None:
        """Returns the next frame, which is empty for an empty line; None if it is not complete."""
        if self._file:
            if len(self._rest) < self._file:
                return None
            file, self._rest, self._file = self._rest[: self._file], self._rest[self._file :], 0
            self._is_behind_file = True
            return file
        line, end, rest = self._rest.partition(_END)
        if len(line) > LONGEST_LINE:
            raise DecodeError(f"a line is longer than {LONGEST_LINE} bytes; every line ends with CR LF")
        if not end:
            return None
        if self._is_behind_file:
            line = line[max(line.find(_REQUEST), 0) :]
            self._is_behind_file = False
        self._rest, self._file = rest, _announced_file(line)
        return line


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
        raise DecodeError(str(error)) from error
    command = content.get("command") if isinstance(content, dict) else None
    if not isinstance(command, str):
        raise DecodeError("no object with a command")
    return Request(command, content)


def file_size(request: Request) -> int:
    """Returns the size of the file that a request announces, [bytes].

    Raises:
        InvalidValueError: It is missing, or is not 1 to `LONGEST_FILE`; then no file follows.
    """
    size = request.integer("file_size")
    if not 1 <= size <= LONGEST_FILE:
        raise InvalidValueError("file_size", size, f"must be 1 to {LONGEST_FILE} bytes")
    return size


def _announced_file(line: bytes) -> int:
    if b"run_project" not in line:
        return 0
    try:
        request = decode_request(line)
        return file_size(request) if request.command == "run_project" else 0
    except (DecodeError, InvalidValueError):
        return 0


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
