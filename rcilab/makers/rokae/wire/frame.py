"""TCP frames: ten bytes of header and a payload, requests and responses alike."""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import Any, NamedTuple, TypeVar

from rcilab.core.errors import DecodeError, InvalidValueError
from rcilab.core.message_layout import Field, Layout
from rcilab.makers.rokae.wire.requests import REQUESTS, Request
from rcilab.makers.rokae.wire.responses import (
    DIGITAL_INPUT,
    MODEL,
    MOTOR_STATE,
    SAFETY_STOP,
    STATUS,
    STATUS_TYPES,
    DigitalInputResponse,
    ModelResponse,
    MotorStateResponse,
    Response,
    SafetyStopResponse,
    StatusResponse,
)
from rcilab.makers.rokae.wire.statuses import CommandCode, GuideStatus, SafetyStop, SettingStatus

HEADER = Layout(
    "frame header",
    (
        Field("length", "u16", order="big"),  # Of the whole frame, with these two bytes.
        Field("command_id", "u32", order="big"),
        Field("command", "u32", order="big"),
    ),
)
(_HEADER,) = HEADER.structs
_E = TypeVar("_E", bound=IntEnum)
_LENGTH = Struct(">H")

MAX_FRAME_SIZE = HEADER.size + MODEL.size
"""Length of the longest frame, the answer to LoadRobotModel, in bytes."""


class Header(NamedTuple):
    """The first ten bytes of a frame."""

    length: int
    command_id: int
    command: int


class FrameReader:
    """Cuts a TCP byte stream into frames, for any division into reads."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._consumed = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Takes the next bytes of the stream and returns the frames that they complete.

        Raises:
            DecodeError: A length field is impossible; nothing after it can be decoded, so every later call raises
                too. The offset counts from the start of the stream.
        """
        self._buffer += data
        frames: list[bytes] = []
        while len(self._buffer) >= _LENGTH.size:
            (length,) = _LENGTH.unpack_from(self._buffer)
            if not HEADER.size <= length <= MAX_FRAME_SIZE:
                raise DecodeError(f"frame length {length} is outside {HEADER.size} to {MAX_FRAME_SIZE}", self._consumed)
            if len(self._buffer) < length:
                break
            frames.append(bytes(self._buffer[:length]))
            del self._buffer[:length]
            self._consumed += length
        return frames


def decode_header(frame: bytes) -> Header:
    """Returns the header of a frame.

    Raises:
        DecodeError: The frame is shorter than a header, or its length differs from the one in its header.
    """
    if len(frame) < HEADER.size:
        raise DecodeError(f"frame of {len(frame)} bytes, a header alone has {HEADER.size}", len(frame))
    header = Header(*_HEADER.unpack_from(frame))
    if header.length != len(frame):
        raise DecodeError(f"frame of {len(frame)} bytes, its header says {header.length}")
    return header


def encode_request(request: Request, command_id: int) -> bytes:
    """Returns the frame of a request.

    Raises:
        InvalidValueError: The id does not fit into 32 bits.
    """
    payload = request.layout.pack([getattr(request, field.name) for field in request.layout.fields])
    return _encode_frame(request.code, command_id, payload)


def decode_request(frame: bytes) -> tuple[int, Request]:
    """Returns the command id and the request of a frame.

    Raises:
        DecodeError: Not a frame, not a known command, or not of the length of that command.
    """
    header = decode_header(frame)
    try:
        kind = REQUESTS[CommandCode(header.command)]
    except ValueError:
        raise DecodeError(f"unknown command {header.command}", HEADER.offset("command")) from None
    return header.command_id, kind(*kind.layout.unpack(frame, HEADER.size))


def encode_response(command: CommandCode, command_id: int, response: Response) -> bytes:
    """Returns the frame of a response to `command`; `command_id` echoes the request's."""
    match response:
        case StatusResponse(status=status):
            payload = STATUS.pack([status])
        case MotorStateResponse(power=power):
            payload = MOTOR_STATE.pack([power])
        case DigitalInputResponse(status=status, level=level):
            payload = DIGITAL_INPUT.pack([status, level])
        case SafetyStopResponse(state=state):
            payload = SAFETY_STOP.pack([state])
        case ModelResponse():
            payload = MODEL.pack(
                [
                    response.status,
                    response.dh,
                    response.dimensions,
                    response.dynamics_with_friction,
                    response.dynamics,
                ]
            )
    return _encode_frame(command, command_id, payload)


def decode_response(command: CommandCode, frame: bytes) -> tuple[int, Response]:
    """Returns the command id and the content of a response to `command`.

    Raises:
        DecodeError: Not a frame, another command's, of the wrong length, or with an unknown status.
    """
    header = decode_header(frame)
    if header.command != command:
        raise DecodeError(
            f"response to command {header.command}, expected one to {command.name} ({int(command)})",
            HEADER.offset("command"),
        )
    return header.command_id, _decode_payload(command, frame)


def _encode_frame(command: CommandCode, command_id: int, payload: bytes) -> bytes:
    if not 0 <= command_id < 2**32:
        raise InvalidValueError("command_id", command_id, "needs to fit into 32 bits")
    return _HEADER.pack(HEADER.size + len(payload), command_id, command) + payload


def _decode_payload(command: CommandCode, frame: bytes) -> Response:
    values: list[Any]
    if command == CommandCode.GET_MOTOR_STATE:
        values = MOTOR_STATE.unpack(frame, HEADER.size)
        return MotorStateResponse(power=values[0])
    if command == CommandCode.GET_SAFETY_STOP_STATE:
        values = SAFETY_STOP.unpack(frame, HEADER.size)
        return SafetyStopResponse(state=_member(SafetyStop, values[0]))
    if command == CommandCode.GET_DI_STATE:
        values = DIGITAL_INPUT.unpack(frame, HEADER.size)
        return DigitalInputResponse(status=_member(SettingStatus, values[0]), level=values[1])
    if command == CommandCode.LOAD_ROBOT_MODEL:
        values = MODEL.unpack(frame, HEADER.size)
        status, dh, dimensions, dynamics_with_friction, dynamics = values
        return ModelResponse(
            status=_member(GuideStatus, status),
            dh=dh,
            dimensions=dimensions,
            dynamics_with_friction=dynamics_with_friction,
            dynamics=dynamics,
        )
    values = STATUS.unpack(frame, HEADER.size)
    return StatusResponse(status=_member(STATUS_TYPES[command], values[0]))


def _member(kind: type[_E], value: int) -> _E:
    try:
        return kind(value)
    except ValueError:
        raise DecodeError(f"{kind.__name__} has no value {value}", HEADER.size) from None
