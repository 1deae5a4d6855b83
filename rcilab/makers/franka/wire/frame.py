"""TCP frames: twelve bytes of header and a payload, requests and responses alike."""

from __future__ import annotations

from struct import Struct
from typing import Any, NamedTuple

from rcilab.core.errors import DecodeError
from rcilab.makers.franka.wire.requests import Connect, Request
from rcilab.makers.franka.wire.versions import FciVersion, Status

_HEADER = Struct("<III")
HEADER_SIZE = _HEADER.size
NO_WALL = Struct("<3d16d?").pack(*(0.0,) * 3, *(float(k % 5 == 0) for k in range(16)), False)
"""Content of the answer to GetCartesianLimit without a wall: its size, its frame (column-major), whether it acts."""
LARGEST_REQUEST = 1024
"""Size of a request that ends the connection, in bytes: the largest one of the interface has 428."""


class Header(NamedTuple):
    """The first twelve bytes of a frame."""

    command: int
    command_id: int
    size: int
    """Of the whole frame, [bytes]."""


class FrameReader:
    """Cuts a TCP byte stream into frames, for any division into reads."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._consumed = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Takes the next bytes of the stream and returns the frames that they complete.

        Raises:
            DecodeError: A size is impossible; nothing after it can be decoded. The offset counts from the start of the
                stream.
        """
        self._buffer += data
        frames: list[bytes] = []
        while len(self._buffer) >= HEADER_SIZE:
            size = _HEADER.unpack_from(self._buffer)[2]
            if not HEADER_SIZE <= size <= LARGEST_REQUEST:
                raise DecodeError(f"frame size {size} is outside {HEADER_SIZE} to {LARGEST_REQUEST}", self._consumed)
            if len(self._buffer) < size:
                break
            frames.append(bytes(self._buffer[:size]))
            del self._buffer[:size]
            self._consumed += size
        return frames


def decode_header(frame: bytes) -> Header:
    """Returns the header of a frame."""
    return Header(*_HEADER.unpack_from(frame))


def decode_request(frame: bytes, version: FciVersion | None) -> Request:
    """Returns the request of a frame. A client may append bytes, which are ignored.

    Args:
        frame: The frame.
        version: The client's version; None before it is known: only Connect is decoded.

    Raises:
        DecodeError: Not a known command, or shorter than that command.
    """
    number = decode_header(frame).command
    commands = (Connect,) if version is None else version.commands
    if number >= len(commands):
        known = "a client begins with Connect (0)" if version is None else f"version {version.number} has none"
        raise DecodeError(f"unknown command {number}: {known}", 0)
    kind = commands[number]
    values: list[Any] = kind.layout.unpack(frame[: HEADER_SIZE + kind.layout.size], HEADER_SIZE)
    return kind(*values)


def encode_response(
    version: FciVersion, request: type[Request], command_id: int, status: Status, content: bytes = b""
) -> bytes:
    """Returns the frame of an answer; `command_id` echoes the request's, `content` follows the status."""
    size = HEADER_SIZE + 1 + len(content)
    header = _HEADER.pack(version.number_of(request), command_id, size)
    return header + bytes([version.status_number(request, status)]) + content


def encode_connect_response(command_id: int, status: Status, number: int) -> bytes:
    """Returns the answer to Connect, which is the same in every version.

    Args:
        command_id: The request's.
        status: SUCCESS or INCOMPATIBLE.
        number: The version of this controller.
    """
    return _CONNECT.pack(0, command_id, _CONNECT.size, status is not Status.SUCCESS, number)


_CONNECT = Struct("<IIIBH")
