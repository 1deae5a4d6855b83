"""The parts of a controller's address that all makers write alike: SCHEME://HOST:PORT?option=N."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from ipaddress import AddressValueError, IPv4Address
from typing import NamedTuple
from urllib.parse import parse_qsl, urlsplit

from rcilab.core.errors import InvalidValueError

_NAME = re.compile(r"(?=.{1,253}$)[a-z0-9_]([a-z0-9_-]{0,61}[a-z0-9_])?(\.[a-z0-9_]([a-z0-9_-]{0,61}[a-z0-9_])?)*")


class AddressParts(NamedTuple):
    """The parts of an address."""

    host: str
    port: int | None
    options: Mapping[str, int]
    """The ports given as options, by name."""


def split_address(text: str, scheme: str, example: str, known: tuple[str, ...]) -> AddressParts:
    """Returns the parts of an address.

    Args:
        text: `SCHEME://HOST:PORT?option=N`; everything but the host may be left out.
        scheme: The scheme it must have, if it has one.
        example: A valid address, for errors.
        known: Names of the options; each is a port.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    if not isinstance(text, str) or not text.strip():
        raise InvalidValueError("address", text, f"is not a valid address; write it like {example}")
    text = text.strip()
    if "[" in text or text.rpartition("://")[2].count(":") > 1:
        raise InvalidValueError(
            "address", text, f"looks like IPv6, which is not supported; write the robot's IPv4 address, like {example}"
        )
    if not any(mark in text for mark in ":.") and text != "localhost":  # "foo", or a robot's name: a typing error.
        raise InvalidValueError("address", text, f"is not a valid address; write it like {example}")
    parts = urlsplit(text if "://" in text else f"{scheme}://{text}")
    if parts.scheme != scheme:
        raise InvalidValueError("address", text, f"begins with {parts.scheme}://, needs {scheme}://, like {example}")
    if not parts.hostname or parts.username or parts.path not in ("", "/"):
        raise InvalidValueError("address", text, f"needs a host, like {example}")
    _require_host(text, parts.hostname, example)
    try:
        port = parts.port
    except ValueError:
        raise InvalidValueError("address", text, "has a port that is not a number from 1 to 65535") from None
    options: dict[str, int] = {}
    for name, value in parse_qsl(parts.query, keep_blank_values=True):
        if name not in known:
            raise InvalidValueError("address", text, f"has the unknown option {name}; known: {', '.join(known)}")
        options[name] = _port(text, name, value)
    return AddressParts(parts.hostname, None if port is None else _port(text, "port", str(port)), options)


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerAddress:
    """A parsed `SCHEME://HOST:PORT[?world_port=W]`: all of an address whose other ports clients find themselves."""

    scheme: str
    host: str
    port: int
    """TCP port of the controller."""
    world_port: int | None = None
    """Simulation port of a virtual controller; None: unknown, or a real robot."""

    @property
    def is_here(self) -> bool:
        """Whether it is a loopback address: a virtual controller on this machine."""
        return is_loopback(self.host)

    def __str__(self) -> str:
        option = "" if self.world_port is None else f"?world_port={self.world_port}"
        return f"{self.scheme}://{self.host}:{self.port}{option}"


def parse_controller_address(
    text: str, *, scheme: str, port: int, example: str, ignored: tuple[str, ...] = (), is_port_fixed: bool = False
) -> ControllerAddress:
    """Returns the parts of an address whose only option of use is the simulation port.

    Args:
        text: The address; everything but the host may be left out.
        scheme: The scheme it must have, if it has one.
        port: TCP port of the controller, where the address has none.
        example: A valid address, for errors.
        ignored: Options with ports that a virtual controller prints and clients find by themselves.
        is_port_fixed: Whether clients of the interface connect to that port only.

    Raises:
        InvalidValueError: It is not such an address; the message names the wrong part.
    """
    parts = split_address(text, scheme, example, ("world_port", *ignored))
    if is_port_fixed and parts.port not in (None, port):
        raise InvalidValueError(
            "address", text, f"has port {parts.port}: clients of this interface connect to {port} only; leave it out"
        )
    return ControllerAddress(
        scheme=scheme, host=parts.host, port=parts.port or port, world_port=parts.options.get("world_port")
    )


def is_loopback(host: str) -> bool:
    """Returns whether a host is this machine, by a loopback address."""
    try:
        return IPv4Address(host).is_loopback
    except AddressValueError:
        return host == "localhost"


def _require_host(text: str, host: str, example: str) -> None:
    """Raises if no machine can have this address or name; whether one has it, only the network knows."""
    if not host.rpartition(".")[2].isdecimal():
        if not _NAME.fullmatch(host):
            raise InvalidValueError(
                "address", text, f"has the host {host!r}, which is not a valid name or IPv4 address"
            )
        return
    try:
        address = IPv4Address(host)
    except AddressValueError:
        raise InvalidValueError(
            "address", text, f"has the host {host!r}: an IPv4 address has four numbers from 0 to 255, like {example}"
        ) from None
    if address.is_unspecified or address.is_multicast or address.is_reserved:
        raise InvalidValueError("address", text, f"has the host {host}, which is not the address of one machine")


def _port(text: str, name: str, value: str) -> int:
    if not value.isdecimal() or not 1 <= int(value) <= 65535:
        raise InvalidValueError("address", text, f"has {name} {value!r}, needs a number from 1 to 65535")
    return int(value)
