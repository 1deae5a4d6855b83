"""Events at the sockets of a virtual controller."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import TypeAlias

from rcilab.sim.channels import Peer


@dataclass(frozen=True, slots=True)
class ClientConnected:
    """A client connected."""

    peer: Peer


@dataclass(frozen=True, slots=True)
class ClientDisconnected:
    """A connection ended."""

    peer: Peer
    reason: str


@dataclass(frozen=True, slots=True)
class FrameArrived:
    """A complete TCP frame."""

    peer: Peer
    frame: bytes


@dataclass(frozen=True, slots=True)
class DatagramArrived:
    """A UDP datagram of the client."""

    datagram: bytes


@dataclass(frozen=True, slots=True)
class UnknownSenderDetected:
    """The first UDP datagram that is not from the client; it is ignored, like all later ones."""

    address: str
    client: str
    """Address of the client; "" without one."""


@dataclass(frozen=True, slots=True)
class ClientRefused:
    """A channel refused a client because of its limit."""

    address: str
    holders: tuple[str, ...]
    """Addresses of the clients that are connected."""


@dataclass(frozen=True, slots=True)
class ExtraSocketsReady:
    """Additional sockets are readable."""

    sockets: list[socket.socket]


Arrival: TypeAlias = (
    ClientConnected
    | ClientDisconnected
    | FrameArrived
    | DatagramArrived
    | UnknownSenderDetected
    | ClientRefused
    | ExtraSocketsReady
)
