"""Requests and responses of the simulation port as lines of JSON.

    {"id": 1, "request": "push", "wrench": [0, 0, -20, 0, 0, 0], "link": 4}        request
    {"id": 1, "ok": true}                                                         done
    {"id": 1, "ok": false, "error": "..."}                                        refused
    {"id": 1, "ok": true, "status": {...}}                                        the response to "status"

Optional fields may be omitted. One object per line, UTF-8, no line longer than `LONGEST_LINE`.
"""

from __future__ import annotations

import json
from dataclasses import MISSING, fields
from typing import Any, NoReturn, cast

from rcilab.core.errors import DecodeError, InvalidValueError
from rcilab.sim.api.answers import Done, Refused, WorldAnswer, WorldStatus, status_as_dict, status_from_dict
from rcilab.sim.api.faults import NetworkFaults
from rcilab.sim.api.requests import REQUESTS, WorldRequest

LONGEST_LINE = 65536
"""[bytes], the end of line included; a status has about 1000, and 350 more for each bound that a fault names."""

_LARGEST_ID = 2**53  # Whole numbers up to here survive every JSON library.


class LineReader:
    """Cuts a byte stream into lines, however the bytes were split or joined on the way."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Takes the next bytes and returns the lines they complete, without their ends.

        Raises:
            DecodeError: A line is too long; nothing after it can be understood.
        """
        self._buffer += data
        *lines, rest = self._buffer.split(b"\n")
        if max(map(len, (*lines, rest))) >= LONGEST_LINE:
            raise DecodeError(f"a line is longer than {LONGEST_LINE} bytes", LONGEST_LINE)
        self._buffer = bytearray(rest)
        return [bytes(line) for line in lines]


def encode_world_request(request: WorldRequest, request_id: int) -> bytes:
    """Returns the line of a request; fields with their default values are omitted."""
    content: dict[str, Any] = {"id": request_id, "request": request.name}
    for item in fields(request):
        value: Any = getattr(request, item.name)
        if value != item.default:
            content[item.name] = value.as_dict() if isinstance(value, NetworkFaults) else value
    return _encode(content)


def decode_world_request(line: bytes) -> tuple[int, WorldRequest | Refused]:
    """Returns the id and the request in a line, or the reason why it is not a valid request.

    Raises:
        DecodeError: It is not a JSON object, or its id is not a number; the message says why.
    """
    content = _decode(line)
    request_id = _pop_id(content)
    try:
        return request_id, _request(content)
    except DecodeError as error:
        return request_id, Refused(error.problem)


def _request(content: dict[str, Any]) -> WorldRequest:
    name = content.pop("request", None)
    kind = REQUESTS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise DecodeError(f"unknown request {_shown(name)}; known: {', '.join(REQUESTS)}")
    known = [item.name for item in fields(kind)]
    unknown = sorted(content.keys() - known)
    if unknown:
        raise DecodeError(f"{name} has no {_shown(unknown[0])}; it has: {', '.join(known) or 'nothing'}")
    for item in fields(kind):
        if item.name not in content and item.default is MISSING:
            raise DecodeError(f"{name} needs {item.name}")
    try:
        return kind(**content)
    except InvalidValueError as error:
        raise DecodeError(f"{name}: {error}") from error


_LONGEST_REASON = 200  # [characters] A wrong value may be as long as the line.
_SEPARATE_FIELDS = ("auto_limit", "pid", "record", "tool", "load", "box", "soft_limits", "inputs", "on_loss")
"""Fields that were added to the status later, and are sent outside of it."""


def encode_world_answer(answer: WorldAnswer, request_id: int) -> bytes:
    """Returns the line of a response to the request with this id; 0 if no id could be read."""
    content: dict[str, Any] = {"id": request_id, "ok": not isinstance(answer, Refused)}
    match answer:
        case Refused(reason, code, facts):
            content["error"] = reason
            if code:
                content |= {"code": code, "facts": dict(facts)}
        case WorldStatus():
            content["status"] = status_as_dict(answer)
            # Next to the status: clients of older releases refuse a status with an unknown name.
            content |= {name: content["status"].pop(name) for name in _SEPARATE_FIELDS}
        case Done():
            pass
    return _encode(content)


def decode_world_answer(line: bytes) -> tuple[int, WorldAnswer]:
    """Returns the id and the response in a line.

    Raises:
        DecodeError: It is not a response; the message says why.
    """
    content = _decode(line)
    request_id = _pop_id(content)
    if content.get("ok") is False:
        return request_id, _refused(content)
    if content.get("ok") is not True:
        raise DecodeError("an answer needs ok: true or false")
    if "status" not in content:
        return request_id, Done()
    if not isinstance(content["status"], dict):
        raise DecodeError("status: not a JSON object")
    try:
        separate = {name: content[name] for name in _SEPARATE_FIELDS if name in content}
        return request_id, status_from_dict({**content["status"], **separate})
    except (InvalidValueError, TypeError, ValueError) as error:
        raise DecodeError(f"status: {str(error)[:_LONGEST_REASON]}") from error


def _refused(content: dict[str, Any]) -> Refused:
    reason, code, facts = str(content.get("error", "")), content.get("code"), content.get("facts")
    if isinstance(code, str) and isinstance(facts, dict):
        return Refused(reason, code, cast("dict[str, object]", facts))
    return Refused(reason)


def _encode(content: dict[str, Any]) -> bytes:
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def _decode(line: bytes) -> dict[str, Any]:
    if len(line) > LONGEST_LINE:
        raise DecodeError(f"a line is longer than {LONGEST_LINE} bytes", LONGEST_LINE)
    try:
        content: object = json.loads(line.decode("utf-8"), parse_constant=_refuse)
    except RecursionError as error:
        raise DecodeError("not valid JSON: nested too deeply") from error
    except ValueError as error:  # Not UTF-8, or not JSON.
        raise DecodeError(f"not valid JSON: {error}", getattr(error, "pos", getattr(error, "start", 0))) from error
    if not isinstance(content, dict):
        raise DecodeError("not a JSON object")
    return cast("dict[str, Any]", content)


def _pop_id(content: dict[str, Any]) -> int:
    request_id = content.pop("id", 0)
    if not isinstance(request_id, int) or isinstance(request_id, bool) or not 0 <= request_id <= _LARGEST_ID:
        raise DecodeError(f"id {_shown(request_id)} is not a whole number from 0 to {_LARGEST_ID}")
    return request_id


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not a number")


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
