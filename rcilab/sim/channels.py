"""TCP and UDP channels of a virtual controller, and the link between a maker's server and the sockets.

A maker lists its channels. The sockets (`endpoint`) read them, `arm_server` passes received data to the maker's
`MakerServer`, and the maker sends through a `ClientLink`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeAlias

LOWEST_CLIENT_PORT = 1024  # Lowest port that datagrams are sent to; ports below are privileged.


class Framer(Protocol):
    """Splits the bytes of one TCP connection into frames."""

    def feed(self, data: bytes) -> list[bytes]:
        """Processes bytes and returns the complete frames.

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
    """A TCP port. The first one of a controller is its main channel: its client controls the robot."""

    name: str = "port"
    """Its name as an option of an address, `?NAME=PORT`; that of the first channel is omitted."""
    protocol: str
    """Its protocol as written in a message, such as "RCI"."""
    port: int
    """0 takes any free one."""
    default_port: int | None = None
    """The port that an address may omit; None: the main channel's."""
    open_framer: Callable[[], Framer] = IgnoredBytes
    """Returns the framer of a new connection."""
    max_clients: int = 1
    """Largest number of simultaneous clients; further ones are refused."""
    option: str | None = "--port"
    """Command line option that changes the port, for an error message; None: its clients insist on it."""
    socket_path: Path | None = None
    """Unix-domain socket that clients on this machine try before the port; it is opened if the user may not open a port
    of the controller."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UdpChannel:
    """A UDP port, for datagrams from and to one client of the main channel. A controller has one, or none.

    A client of another channel can receive datagrams from it, at a port of its own (`ClientLink.direct_datagrams`).

    Only datagrams from the client's address (or the configured one) and its state port are accepted. If the client may
    send from another port, the port of its first datagram is accepted until one arrives from the state port. Others
    are unknown senders: they are ignored and counted.
    """

    name: str = "udp_port"
    """Its name as an option of an address."""
    port: int | None = None
    """None: the number of the main channel; 0: any free one."""
    target_port: int | None = None
    """The client's port for states; None: the number of the main channel; 0: unknown until
    `ClientLink.direct_datagrams`."""
    is_state_port_only: bool = False
    """Whether clients send from their state port in any case."""
    option: str = "--udp-port"
    """Command line option that changes the port, for an error message."""


Channel: TypeAlias = TcpChannel | UdpChannel


@dataclass(frozen=True, slots=True, eq=False)
class Peer:
    """A connected client."""

    address: str
    channel: TcpChannel


class ClientLink(Protocol):
    """Sends data from a maker's server to its clients. No method blocks."""

    def send_frame(self, peer: Peer, frame: bytes) -> None:
        """Sends bytes with a single call. A client that does not read them is disconnected."""
        ...

    def send_datagram(self, datagram: bytes, peer: Peer | None = None) -> None:
        """Sends a datagram to the current destination; does nothing without a client.

        Args:
            datagram: The bytes.
            peer: A client of another channel than the main one, for the port that it named; None: the destination of
                states.
        """
        ...

    def direct_datagrams(self, peer: Peer, port: int) -> bool:
        """Directs datagrams to a port of this client while it is connected; returns False for an invalid port.

        For a client of the main channel this is the destination of states, and datagrams are accepted from there.
        """
        ...

    def drop(self, peer: Peer, reason: str) -> None:
        """Ends a connection."""
        ...

    def log(self, kind: str, text: str, /, **facts: object) -> None:
        """Logs an event for the operator; see `ControllerLog.write`."""
        ...
