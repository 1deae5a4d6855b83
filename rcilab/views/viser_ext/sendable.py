r"""No text can end a page: what is no Unicode travels with its escapes.

A lone surrogate (half a character, as `json` reads from "\ud800" and Python makes of a file name that is no UTF-8)
cannot be encoded. viser 1.1 meets it while it sends, closes the connection, and does so again with every page that
comes, because it repeats to a new page what it said to the others.

Unnecessary once viser encodes text with `errors="backslashreplace"`.
"""

from __future__ import annotations

from typing import Any


def install() -> None:
    """Has viser send such text with its escapes; everything else is encoded as ever. May be called again."""
    from viser.infra import _infra

    infra: Any = _infra
    if not isinstance(infra.msgspec, _Encoders):
        infra.msgspec = _Encoders(infra.msgspec)


def sendable(value: Any) -> Any:
    """Returns a message, its lists and dictionaries included, with the escapes of what is no Unicode."""
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, dict):
        return {sendable(key): sendable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(map(sendable, value))
    return value


class _Encoders:
    """Stands for the module `msgspec` where viser sends."""

    def __init__(self, real: Any) -> None:
        self._real, self.msgpack = real, self

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real.msgpack, name)

    def encode(self, message: Any) -> bytes:
        """Returns a message in the format of msgpack."""
        try:
            return self._real.msgpack.encode(message)
        except UnicodeEncodeError:
            return self._real.msgpack.encode(sendable(message))
