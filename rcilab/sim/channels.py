"""What a virtual controller listens on, and what it can do with its clients: the words between a maker and the sockets.

A maker lists its channels. The sockets (`endpoint`) read them, `arm_server` hands what arrives to the maker's
`MakerServer`, and the maker sends through a `Link`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

LOWEST_CLIENT_PORT = 1024  # Where datagrams may be sent to: ports below are other programs', and privileged.


class Framer(Protocol):
    """Cuts the bytes of one TCP connection into frames."""

    def feed(self, data: bytes) -> list[bytes]:
        """Takes bytes and returns the frames that are complete.

        Raises:
            DecodeError: They are not of this protocol; the connection ends.
        """
        ...


class IgnoredBytes:
    """The framer of a channel on which only the controller sends."""

    def feed(self, data: bytes) -> list[bytes]:
        """Returns no frame."""
        return []


@dataclass(frozen=True, slots=True, kw_only=True)
class TcpChannel:
    """A TCP port. The first of a controller is its main one: its clients hold the controller."""

    name: str = "port"
    """Its name as an option of an address, `?NAME=PORT`; that of the first channel is not written."""
    protocol: str
    """Its protocol as written in a message, such as "RCI"."""
    port: int
    """0 takes any free one."""
    usual_port: int | None = None
    """The port that addresses need not name; None: the main channel's."""
    open_framer: Callable[[], Framer] = IgnoredBytes
    """Returns the framer of a new connection."""
    most_clients: int = 1
    """At once; further ones are refused."""
    option: str = "--port"
    """What to change when the port cannot be used."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UdpChannel:
    """A UDP port, for datagrams from and to one client of the main channel. A controller has one, or none.

    Datagrams count that come from the address of that client, or of the configured one, and from the port that states
    go to. A client that sends from another port is taken at its first datagram's, until one comes from where states go.
    Others are unknown senders: they are ignored and counted.
    """

    name: str = "udp_port"
    """Its name as an option of an address."""
    port: int | None = None
    """None: the number of the main channel; 0: any free one."""
    target_port: int | None = None
    """The client's port that states go to; None: the number of the main channel; 0: unknown until
    `Link.direct_datagrams`."""
    option: str = "--udp-port"
    """What to change when the port cannot be used."""


Channel: TypeAlias = TcpChannel | UdpChannel


@dataclass(frozen=True, slots=True, eq=False)
class Peer:
    """A connected client."""

    address: str
    channel: TcpChannel


class Link(Protocol):
    """How a maker's server reaches its clients. Nothing here waits."""

    def send_frame(self, peer: Peer, frame: bytes) -> None:
        """Sends bytes with a single call. A client that does not read them is dropped."""
        ...

    def send_datagram(self, datagram: bytes) -> None:
        """Sends a datagram to where they go; without a client, nowhere."""
        ...

    def direct_datagrams(self, peer: Peer, port: int) -> bool:
        """Has datagrams go to a port of this client's, as long as it is connected; returns False for a bad port."""
        ...

    def drop(self, peer: Peer, reason: str) -> None:
        """Ends a connection."""
        ...

    def log(self, line: str, /) -> None:
        """Takes the line about a refused request for the operator; after some lines, they are counted."""
        ...
