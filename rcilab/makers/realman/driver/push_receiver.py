"""The states that a controller pushes to a UDP port, read without the client library and counted.

A pushed state has no time. Its number here is the count of states, 5 ms each: the clock of a motion. It stands still
while states are lost, so that a motion continues where the arm is instead of leaping ahead; `received_ns` has when
each one arrived.
"""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

from rcilab.core.errors import ConnectionLostError, DecodeError
from rcilab.makers.network import RECEIVE_BUFFER, HostRoute
from rcilab.makers.realman.bounds import PUSH_PERIOD
from rcilab.makers.realman.wire.pushed_state import PushedState, decode_push

_LARGEST = 65536  # [bytes]
_MS = 1000.0


class NumberedPush(NamedTuple):
    """A pushed state and the number of its cycle."""

    number: int
    """In milliseconds since the first one."""
    pushed: PushedState


class PushReceiver:
    """A UDP port for pushed states. Owned by one thread.

    Attributes:
        received_ns: When the newest one arrived, monotonic, [ns].

    Args:
        route: The controller, whose states alone are taken, and our address.
        n: Number of joints.
        name: Name of the controller in errors.

    Raises:
        ConnectionLostError: There is no free port at our address.
    """

    def __init__(self, route: HostRoute, n: int, name: str) -> None:
        self.received_ns = time.monotonic_ns()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            self._socket.bind((route.local, 0))
        except OSError as error:
            self._socket.close()
            raise ConnectionLostError(
                f"{name}: cannot receive states at {route.local}: {error.strerror or error}"
            ) from error
        self._socket.setblocking(False)
        self._host, self._n = route.host, n
        self._number = 0
        self._ready = select.poll()
        self._ready.register(self._socket, select.POLLIN)

    @property
    def port(self) -> int:
        """Where states arrive."""
        port: int = self._socket.getsockname()[1]
        return port

    def poll(self, timeout: float) -> Sequence[NumberedPush]:
        """Returns every state that has arrived, oldest first; waits up to a timeout, [s], for the first."""
        deadline = time.monotonic() + timeout
        while True:
            found = self._receive()
            left = deadline - time.monotonic()
            if found or left <= 0.0:
                return found
            self._ready.poll(left * _MS)

    def close(self) -> None:
        """Closes the port. May be called twice."""
        self._socket.close()

    def _receive(self) -> list[NumberedPush]:
        found: list[NumberedPush] = []
        while True:
            try:
                datagram, sender = self._socket.recvfrom(_LARGEST)
            except (BlockingIOError, ConnectionError):
                return found
            if sender[0] != self._host:
                continue
            with suppress(DecodeError):  # Of another program.
                pushed = decode_push(datagram, self._n)
                self.received_ns = time.monotonic_ns()
                self._number += PUSH_PERIOD
                found.append(NumberedPush(self._number, pushed))
