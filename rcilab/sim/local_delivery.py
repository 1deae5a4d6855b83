"""Whether datagrams to an address arrive at a program on this machine."""

from __future__ import annotations

import errno
import socket


def is_local_address(address: str) -> bool:
    """Returns whether an IPv4 address is one of this machine, in its network namespace."""
    return _bind_error(address, 0) != errno.EADDRNOTAVAIL


def is_received_locally(address: str, port: int) -> bool:
    """Returns whether a socket of this machine receives the datagrams for an address and port.

    The port is bound for a moment; a client binds it before it connects, so this does not interfere.
    """
    return _bind_error(address, port) == errno.EADDRINUSE


def _bind_error(address: str, port: int) -> int | None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, port))
        except OSError as error:
            return error.errno
    return None
