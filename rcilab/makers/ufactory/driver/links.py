"""Connections to the ports of a controller, before and in addition to those of the client library.

A virtual controller of a user who may not open port 502 listens at Unix-domain sockets. The client library connects to
these, if they exist, whatever address it is given; so it may use them only where nothing answers at the address.
"""

from __future__ import annotations

import socket
import time
from struct import Struct
from typing import NamedTuple

from rcilab.core.errors import ConnectionLostError, DecodeError, ModelError
from rcilab.makers.address import ControllerAddress
from rcilab.makers.network import find_route, no_robot_error
from rcilab.makers.ufactory.robots import ROBOTS
from rcilab.makers.ufactory.wire.frame import PRIVATE, FrameReader, decode_frame
from rcilab.makers.ufactory.wire.functions import Function
from rcilab.makers.ufactory.wire.identity import IDENTITIES
from rcilab.makers.ufactory.wire.unix_sockets import unix_socket_path

_REQUEST = Struct(">HHHB")


class Endpoint(NamedTuple):
    """Where a controller listens."""

    host: str
    """IPv4 address."""
    is_local: bool
    """Whether it listens at Unix-domain sockets."""

    def connect(self, port: int, timeout: float) -> socket.socket:
        """Returns a connection to one of its ports.

        Raises:
            OSError: No connection within the timeout, [s].
        """
        if not self.is_local:
            return socket.create_connection((self.host, port), timeout)
        link = socket.socket(socket.AF_UNIX)
        try:
            link.settimeout(timeout)
            link.connect(str(unix_socket_path(port)))
        except OSError:
            link.close()
            raise
        return link


def find_arm(address: ControllerAddress, timeout: float) -> tuple[str, Endpoint]:
    """Returns the name of the arm at an address, and where its controller listens.

    Args:
        address: Address of the controller.
        timeout: For the connection and for the answer, [s].

    Raises:
        ConnectionLostError: No controller answers.
        ModelError: It has an arm that rcilab does not know.
    """
    endpoint = Endpoint(find_route(address).host, is_local=False)
    start = time.monotonic()
    try:
        try:
            link = endpoint.connect(address.port, timeout)
        except ConnectionRefusedError:
            if not (address.is_here and unix_socket_path(address.port).exists()):
                raise
            endpoint = endpoint._replace(is_local=True)
            link = endpoint.connect(address.port, timeout)
    except OSError as error:
        advice = (
            "check that the control box is switched on, that the IP address is the "
            "one on its label, and the cable; a virtual one is started with, for example: rcilab controller --model "
            "xArm7"
        )
        raise no_robot_error(address, error, time.monotonic() - start, timeout, advice) from error
    with link:
        try:
            version = _read_version(link)
        except (OSError, DecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise ConnectionLostError(
                f"what answers at {address} is not a controller of a UFACTORY arm, or it is not ready yet ({reason}); "
                "check the address, and connect again"
            ) from error
    return _name_of(version, address), endpoint


def _read_version(link: socket.socket) -> str:
    """Returns what a controller reports about itself: axes, type, two serial numbers, firmware."""
    link.sendall(_REQUEST.pack(1, PRIVATE[0], 1, Function.GET_VERSION))
    reader = FrameReader()
    while True:
        received = link.recv(4096)
        if not received:
            raise ConnectionResetError("it closed the connection")
        for frame in reader.feed(received):
            answer = decode_frame(frame)
            if answer.function == Function.GET_VERSION:
                return answer.payload[1:].partition(b"\0")[0].decode("ascii", "replace")


def _name_of(version: str, address: ControllerAddress) -> str:
    kind = tuple(version.split(",")[:2])
    for name, identity in IDENTITIES.items():
        if kind == (str(identity.axes), str(identity.type)) and name in ROBOTS:
            return name
    raise ModelError(
        f"the controller at {address} has an arm that rcilab does not know ({version!r}: axes, type, serial numbers, "
        f"firmware); it drives {', '.join(ROBOTS)}"
    )
