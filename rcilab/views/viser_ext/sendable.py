r"""Escaping of text that cannot be encoded, which would otherwise close the connection to a page.

A lone surrogate (half a character, which `json` reads from "\ud800", and which Python puts into a file name that is not
UTF-8) cannot be encoded. viser 1.1 fails when it sends the text and closes the connection, also for every new page,
because it sends previous messages to new pages.

Unnecessary once viser encodes text with `errors="backslashreplace"`.
"""

from __future__ import annotations

from typing import Any


def install() -> None:
    """Patches viser's encoder; other text is encoded as before. May be called again."""
    from viser.infra import _infra

    infra: Any = _infra
    if not isinstance(infra.msgspec, _Encoders):
        infra.msgspec = _Encoders(infra.msgspec)


def sendable(value: Any) -> Any:
    """Returns a message, including its lists and dictionaries, with lone surrogates escaped."""
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, dict):
        return {sendable(key): sendable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(map(sendable, value))
    return value


class _Encoders:
    """Replaces the module `msgspec` in viser's sender."""

    def __init__(self, real: Any) -> None:
        self._real, self.msgpack = real, self

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real.msgpack, name)

    def encode(self, message: Any) -> bytes:
        """Returns a message in msgpack format."""
        try:
            return self._real.msgpack.encode(message)
        except UnicodeEncodeError:
            return self._real.msgpack.encode(sendable(message))
