"""The address of a robot, and our own addresses and ports for it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from ipaddress import AddressValueError, IPv4Address
from urllib.parse import parse_qsl, urlsplit

from rcilab.core.errors import InvalidValueError
from rcilab.makers.network import find_route
from rcilab.makers.rokae.bounds import DEFAULT_PORT

SPARE_LOOPBACK = "127.0.0.3"
"""Our address if the robot has the one that we would have used; any other in 127/8 would do."""

_NAME = re.compile(r"(?=.{1,253}$)[a-z0-9_]([a-z0-9_-]{0,61}[a-z0-9_])?(\.[a-z0-9_]([a-z0-9_-]{0,61}[a-z0-9_])?)*")
_KNOWN_OPTIONS = ("udp_port", "client_port", "world_port")
_EXAMPLE = "rci://192.168.0.160:1337"


@dataclass(frozen=True, slots=True, kw_only=True)
class RciAddress:
    """A parsed `rci://HOST:PORT[?udp_port=N&client_port=M&world_port=W]`."""

    host: str
    port: int = DEFAULT_PORT
    """TCP port of the controller."""
    udp_port: int | None = None
    """Where the controller receives commands; None: at the same number as `port`."""
    client_port: int | None = None
    """Where the controller sends states; None: to the same number as `port`, the default of the RCI."""

    world_port: int | None = None
    """Simulation port of a virtual controller; None: unknown, or a real robot."""

    @property
    def is_here(self) -> bool:
        """Whether it is a loopback address: a virtual controller on this machine."""
        try:
            return IPv4Address(self.host).is_loopback
        except AddressValueError:
            return self.host == "localhost"

    @property
    def command_port(self) -> int:
        """UDP port for commands."""
        return self.port if self.udp_port is None else self.udp_port

    @property
    def state_port(self) -> int:
        """Our UDP port for states."""
        return self.port if self.client_port is None else self.client_port

    def __str__(self) -> str:
        options = [f"{name}={getattr(self, name)}" for name in _KNOWN_OPTIONS if getattr(self, name) is not None]
        return f"rci://{self.host}:{self.port}" + ("?" + "&".join(options) if options else "")


def parse_address(text: str) -> RciAddress:
    """Returns the parts of a robot's address.

    Args:
        text: `rci://HOST:PORT?udp_port=N&client_port=M`; everything but the host may be left out.

    Raises:
        InvalidValueError: It is not such an address; the message says which part is wrong.
    """
    if not isinstance(text, str) or not text.strip():
        raise InvalidValueError("address", text, f"is not a valid address; write it like {_EXAMPLE}")
    text = text.strip()
    if "[" in text or text.rpartition("://")[2].count(":") > 1:
        raise InvalidValueError(
            "address", text, f"looks like IPv6, which is not supported; write the robot's IPv4 address, like {_EXAMPLE}"
        )
    if not any(mark in text for mark in ":.") and text != "localhost":  # "foo", or a robot's name: a typing error.
        raise InvalidValueError("address", text, f"is not a valid address; write it like {_EXAMPLE}")
    parts = urlsplit(text if "://" in text else f"rci://{text}")
    if parts.scheme != "rci":
        raise InvalidValueError("address", text, f"begins with {parts.scheme}://, needs rci://, like {_EXAMPLE}")
    if not parts.hostname or parts.username or parts.path not in ("", "/"):
        raise InvalidValueError("address", text, f"must be a host and a port, like {_EXAMPLE}")
    _require_host(text, parts.hostname)
    try:
        port = parts.port
    except ValueError:
        raise InvalidValueError("address", text, "has a port that is not a number from 1 to 65535") from None
    options: dict[str, int] = {}
    for name, value in parse_qsl(parts.query, keep_blank_values=True):
        if name not in _KNOWN_OPTIONS:
            raise InvalidValueError(
                "address", text, f"has the unknown option {name}; known: {', '.join(_KNOWN_OPTIONS)}"
            )
        options[name] = _port(text, name, value)
    return RciAddress(
        host=parts.hostname,
        port=DEFAULT_PORT if port is None else _port(text, "port", str(port)),
        udp_port=options.get("udp_port"),
        client_port=options.get("client_port"),
        world_port=options.get("world_port"),
    )


@dataclass(frozen=True, slots=True)
class Route:
    """The four ends of a connection, as (address, port)."""

    robot_tcp: tuple[str, int]
    robot_udp: tuple[str, int]
    local_tcp: tuple[str, int]
    local_udp: tuple[str, int]


def choose_route(address: RciAddress) -> Route:
    """Returns our address for the connection to a robot.

    The robot sends states to the address of our TCP connection, so both are bound to one specific address, never to
    the wildcard: that would also take the port from a virtual controller on the same machine (and receive our own
    commands). If the robot is at our own address and needs the same port number there, our end uses another loopback
    address.

    Raises:
        ConnectionLostError: The host name has no address, or no network of ours leads there.
    """
    route = find_route(address)
    host, local = route.host, route.local
    if local == host and address.state_port == address.command_port:
        local = SPARE_LOOPBACK
    return Route(
        robot_tcp=(host, address.port),
        robot_udp=(host, address.command_port),
        local_tcp=(local, 0),
        local_udp=(local, address.state_port),
    )


def _require_host(text: str, host: str) -> None:
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
            "address", text, f"has the host {host!r}: an IPv4 address has four numbers from 0 to 255, like {_EXAMPLE}"
        ) from None
    if address.is_unspecified or address.is_multicast or address.is_reserved:
        raise InvalidValueError("address", text, f"has the host {host}, which is not the address of one machine")


def _port(text: str, name: str, value: str) -> int:
    if not value.isdecimal() or not 1 <= int(value) <= 65535:
        raise InvalidValueError("address", text, f"has {name} {value!r}, needs a number from 1 to 65535")
    return int(value)
