"""What arrives at the sockets of a virtual controller, as values."""

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
    """The connection is over."""

    peer: Peer
    reason: str


@dataclass(frozen=True, slots=True)
class FrameArrived:
    """A whole TCP frame."""

    peer: Peer
    frame: bytes


@dataclass(frozen=True, slots=True)
class DatagramArrived:
    """A UDP datagram of the client's."""

    datagram: bytes


@dataclass(frozen=True, slots=True)
class StrangerDetected:
    """The first UDP datagram on a connection that is not from its client; it is ignored, as all later ones are."""

    address: str
    client: str
    """Address of the client; "" while none is connected."""


@dataclass(frozen=True, slots=True)
class ClientRefused:
    """One client more than a channel takes tried to connect."""

    address: str
    holder: str


@dataclass(frozen=True, slots=True)
class ExtraSocketsReady:
    """Sockets of other parts, watched along with the controller's, have something to read."""

    sockets: list[socket.socket]


Arrival: TypeAlias = (
    ClientConnected
    | ClientDisconnected
    | FrameArrived
    | DatagramArrived
    | StrangerDetected
    | ClientRefused
    | ExtraSocketsReady
)
