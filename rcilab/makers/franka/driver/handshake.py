"""What is at an address: a short connection of our own, before the client library connects.

The client libraries wait without a time limit for a controller that does not answer or closes the connection, and each
of them has one version of the interface only.
"""

from __future__ import annotations

import socket
import time
from contextlib import suppress
from struct import Struct

from rcilab.core.errors import ConnectionLostError
from rcilab.makers.address import ControllerAddress
from rcilab.makers.network import find_route, no_robot_error

_SILENCE = 0.5  # [s] After which a controller that ends no connection counts as waiting for a request. A tuning value.
_CONNECT = Struct("<IIIHH")
_ANSWER = Struct("<IIIBH")


def find_version(address: ControllerAddress, version: int, timeout: float) -> int:
    """Returns the version of the interface at an address.

    Args:
        address: Address of the controller.
        version: The version to ask for: a controller of another one answers with its own.
        timeout: For the connection and for the answer, [s].

    Raises:
        ConnectionLostError: No controller answers in time, or it has another client.
    """
    route = find_route(address)
    start = time.monotonic()
    with socket.socket() as tcp, socket.socket(type=socket.SOCK_DGRAM) as udp:
        tcp.settimeout(timeout)
        udp.bind((route.local, 0))
        try:
            tcp.connect((route.host, address.port))
        except OSError as error:
            advice = (
                "check that it is switched on, that FCI is activated in Desk and "
                "the joints are unlocked, that the IP address is the one shown there, and the cable; a virtual one is "
                "started with, for example: rcilab controller --model FR3"
            )
            raise no_robot_error(address, error, time.monotonic() - start, timeout, advice) from error
        deadline = time.monotonic() + timeout
        try:
            tcp.sendall(_CONNECT.pack(0, 0, _CONNECT.size, version, udp.getsockname()[1]))
            answer = _receive(tcp, _ANSWER.size, deadline)
            found = _ANSWER.unpack(answer)[-1]
            tcp.shutdown(socket.SHUT_WR)
            with suppress(TimeoutError):
                while _receive_some(tcp, 4096, deadline):  # Until the controller is ready for the next client.
                    pass
        except TimeoutError as error:
            raise ConnectionLostError(
                f"{address}: what is there accepted the connection and did not answer within {timeout:g} s; check "
                "that it is a Franka controller and that it has started, and connect again"
            ).coded("other_protocol", address=str(address)) from error
        except OSError as error:
            how = f"ended the connection before its first answer ({error.strerror or error})"
            if _ends_at_once(route.host, address.port):
                raise ConnectionLostError(
                    f"{address}: the controller {how}, probably because another client is connected: it takes one at "
                    "a time; close that one and connect again"
                ).coded("other_client", address=str(address)) from error
            raise ConnectionLostError(
                f"{address}: what is there {how}; check that it is a Franka controller with FCI activated in Desk"
            ).coded("other_protocol", address=str(address)) from error
    return found


def _ends_at_once(host: str, port: int) -> bool:
    """Returns whether a controller ends a connection over which nothing was sent: it has another client."""
    with socket.socket() as tcp:
        tcp.settimeout(_SILENCE)
        try:
            tcp.connect((host, port))
            return not tcp.recv(1)
        except TimeoutError:
            return False
        except OSError:
            return True


def _receive(tcp: socket.socket, size: int, deadline: float) -> bytes:
    received = b""
    while len(received) < size:
        piece = _receive_some(tcp, size - len(received), deadline)
        if not piece:
            raise ConnectionResetError("it closed the connection")
        received += piece
    return received


def _receive_some(tcp: socket.socket, size: int, deadline: float) -> bytes:
    left = deadline - time.monotonic()
    if left <= 0.0:
        raise TimeoutError
    tcp.settimeout(left)
    return tcp.recv(size)
