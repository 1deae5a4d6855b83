"""The address of a robot, and our own addresses and ports for it."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.makers.address import is_loopback, split_address
from rcilab.makers.network import find_route
from rcilab.makers.rokae.bounds import DEFAULT_PORT

SPARE_LOOPBACK = "127.0.0.3"
"""Our address if the robot has the one that we would have used; any other in 127/8 would do."""

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
        return is_loopback(self.host)

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
    host, port, options = split_address(text, "rci", _EXAMPLE, _KNOWN_OPTIONS)
    return RciAddress(
        host=host,
        port=DEFAULT_PORT if port is None else port,
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
