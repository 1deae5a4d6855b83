"""The wire of the hand, version 3: frames over TCP with ten bytes of header, states over UDP."""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import NamedTuple, TypeAlias

from rcilab.core.errors import DecodeError

VERSION = 3
_HEADER = Struct("<HII")
HEADER_SIZE = _HEADER.size
LARGEST_REQUEST = 256
"""Size of a request that ends the connection, in bytes: the largest one has 50."""


class HandCommand(IntEnum):
    """The command of a frame."""

    CONNECT = 0
    HOMING = 1
    GRASP = 2
    MOVE = 3
    STOP = 4


class HandStatus(IntEnum):
    """The answer to every command but Connect, whose 1 means another version."""

    SUCCESS = 0
    FAIL = 1
    UNSUCCESSFUL = 2
    ABORTED = 3


class HandConnect(NamedTuple):
    """Begins a connection: the client's version, and its port for states."""

    version: int
    udp_port: int


class Homing(NamedTuple):
    """Opens and closes the fingers, which finds their largest width."""


class Grasp(NamedTuple):
    """Closes the fingers on an object, and holds it."""

    width: float
    """Expected width of the object, [m]."""
    epsilon_inner: float
    """By how much it may be narrower, [m]."""
    epsilon_outer: float
    """By how much it may be wider, [m]."""
    speed: float
    """[m/s]."""
    force: float
    """[N]."""


class MoveFingers(NamedTuple):
    """Moves the fingers to a width."""

    width: float
    """[m]."""
    speed: float
    """[m/s]."""


class StopFingers(NamedTuple):
    """Stops the fingers, and lets go."""


HandRequest: TypeAlias = HandConnect | Homing | Grasp | MoveFingers | StopFingers

_REQUESTS = {
    HandCommand.CONNECT: (HandConnect, Struct("<HH")),
    HandCommand.HOMING: (Homing, Struct("<")),
    HandCommand.GRASP: (Grasp, Struct("<5d")),
    HandCommand.MOVE: (MoveFingers, Struct("<2d")),
    HandCommand.STOP: (StopFingers, Struct("<")),
}
_STATE = Struct("<I2d?H")
_RESPONSE = Struct("<HIIH")
_CONNECT_RESPONSE = Struct("<HIIHH")


class HandFrameReader:
    """Cuts a TCP byte stream into frames, for any division into reads."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._consumed = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Takes the next bytes of the stream and returns the frames that they complete.

        Raises:
            DecodeError: A size is impossible; the offset counts from the start of the stream.
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


def decode_hand_request(frame: bytes) -> tuple[int, HandRequest]:
    """Returns the command id and the request of a frame.

    Raises:
        DecodeError: Not a known command, or shorter than that command.
    """
    number, command_id, _ = _HEADER.unpack_from(frame)
    if number not in tuple(HandCommand):
        raise DecodeError(f"unknown command {number}: the hand has 0 to {max(HandCommand)}", 0)
    kind, layout = _REQUESTS[HandCommand(number)]
    if len(frame) < HEADER_SIZE + layout.size:
        raise DecodeError(f"{kind.__name__}: {len(frame)} bytes, needs {HEADER_SIZE + layout.size}", len(frame))
    return command_id, kind(*layout.unpack_from(frame, HEADER_SIZE))


def encode_hand_response(request: HandRequest, command_id: int, status: HandStatus) -> bytes:
    """Returns the frame of an answer; that to Connect names the version of the hand."""
    (command,) = (command for command, (kind, _) in _REQUESTS.items() if isinstance(request, kind))
    if isinstance(request, HandConnect):
        return _CONNECT_RESPONSE.pack(command, command_id, _CONNECT_RESPONSE.size, status, VERSION)
    return _RESPONSE.pack(command, command_id, _RESPONSE.size, status)


def encode_hand_state(message_id: int, width: float, max_width: float, *, is_grasped: bool, temperature: int) -> bytes:
    """Returns a state datagram, 23 bytes.

    Args:
        message_id: Number of the state.
        width: Distance of the fingers, [m].
        max_width: Largest distance, 0 before homing, [m].
        is_grasped: Whether an object is held.
        temperature: Of the hand, [degC].
    """
    return _STATE.pack(message_id, width, max_width, is_grasped, temperature)
