"""Frames of the control port: six bytes of header, then a function and its payload."""

from __future__ import annotations

from struct import Struct
from typing import NamedTuple

from rcilab.core.errors import DecodeError

MODBUS, HEARTBEAT = 0, 1
"""Protocols of standard Modbus, and of the frame that keeps a connection alive."""
PRIVATE = (2, 3)
"""Protocols of the private commands; 3 is chosen by clients of newer firmware."""
HEADER_SIZE = 6
LARGEST_FRAME = 2048
"""Size of a frame that ends the connection, [bytes]: the largest request of the interface has some 300."""
STATUS_ERROR, STATUS_WARNING, STATUS_NOT_READY, STATUS_INVALID = 0x40, 0x20, 0x10, 0x08
"""Bits of the status byte of a response."""

_HEADER = Struct(">HHH")
_RESPONSE = Struct(">HHHBB")
_FEEDBACK = Struct(">HHHBBBBHBQ")
_FEEDBACK_FUNCTION = 0xFF


class Frame(NamedTuple):
    """A request."""

    transaction: int
    """Number of the client, echoed by the response."""
    protocol: int
    function: int
    """Function code; in standard Modbus the unit id."""
    payload: bytes


class Feedback(NamedTuple):
    """A frame that the controller sends unasked: what became of a command."""

    transaction: int
    """That of the command."""
    protocol: int
    status: int
    kind: int
    """1 motion started, 2 motion ended or discarded, 4 trigger, 32 and 64 start and end of other commands."""
    function: int
    task: int
    """Number of the command in the queue."""
    result: int
    """0 success, 1 failed, 2 discarded."""
    microseconds: int
    """Time of the controller."""


class FrameReader:
    """Cuts a byte stream into frames, for any division into reads."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._consumed = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Takes the next bytes of the stream and returns the frames that they complete.

        Raises:
            DecodeError: A protocol or a length is impossible; nothing after it can be decoded. The offset counts from
                the start of the stream.
        """
        self._buffer += data
        frames: list[bytes] = []
        while len(self._buffer) >= HEADER_SIZE:
            _, protocol, length = _HEADER.unpack_from(self._buffer)
            if protocol not in (MODBUS, HEARTBEAT, *PRIVATE):
                raise DecodeError(f"protocol {protocol} is unknown; known: 0, 1, 2, 3", self._consumed + 2)
            size = HEADER_SIZE + length
            if not HEADER_SIZE < size <= LARGEST_FRAME:
                raise DecodeError(f"length {length} is outside 1 to {LARGEST_FRAME - HEADER_SIZE}", self._consumed + 4)
            if len(self._buffer) < size:
                break
            frames.append(bytes(self._buffer[:size]))
            del self._buffer[:size]
            self._consumed += size
        return frames


def decode_frame(frame: bytes) -> Frame:
    """Returns the parts of a frame that `FrameReader` has cut."""
    transaction, protocol, _ = _HEADER.unpack_from(frame)
    return Frame(transaction, protocol, frame[HEADER_SIZE], frame[HEADER_SIZE + 1 :])


def encode_response(request: Frame, status: int, payload: bytes = b"") -> bytes:
    """Returns the response of the private protocol to a request."""
    length = 2 + len(payload)
    return _RESPONSE.pack(request.transaction, request.protocol, length, request.function, status) + payload


def encode_modbus_response(request: Frame, pdu: bytes) -> bytes:
    """Returns the response of standard Modbus to a request."""
    header = _HEADER.pack(request.transaction, request.protocol, 1 + len(pdu))
    return header + bytes([request.function]) + pdu


def encode_feedback(feedback: Feedback) -> bytes:
    """Returns the frame of a feedback."""
    length = _FEEDBACK.size - HEADER_SIZE
    return _FEEDBACK.pack(*feedback[:2], length, _FEEDBACK_FUNCTION, *feedback[2:])
