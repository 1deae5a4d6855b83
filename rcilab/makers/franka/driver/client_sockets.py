"""The sockets of a client library, to wait at them.

The bindings of libfranka keep Python's global lock while they wait. So a driver waits at duplicates of their sockets,
and calls a library once what it reads is there. Nothing but outdated or foreign datagrams is read here. Answers of the
controller are read by the calls that request them, whose time is limited from outside (`CallLimit`).
"""

from __future__ import annotations

import os
import select
import socket
import stat
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from rcilab.core.errors import ConnectionLostError
from rcilab.makers.franka.driver.call_limit import CallLimit

Client = TypeVar("Client")

_FD = "/proc/self/fd"
_ID_SIZE = 8  # [bytes] A state begins with its number.
_MS = 1000.0


class ClientSockets:
    """Duplicates of a client's two sockets. Owned by one thread.

    Attributes:
        limit: Time limit of the client's calls.

    Args:
        limit: As the attribute.
        tcp: Connected to the controller.
        udp: Where states arrive.
        state_size: Size of a state, [bytes].
        name: Name of the controller in errors.
    """

    def __init__(self, limit: CallLimit, tcp: socket.socket, udp: socket.socket, state_size: int, name: str) -> None:
        self.limit = limit
        limit.watch(tcp)
        self._tcp, self._udp = tcp, udp
        self._state_size = state_size
        self._name = name
        self._host = tcp.getpeername()[0]
        self._head = bytearray(_ID_SIZE)
        self._states_ready = select.poll()
        self._states_ready.register(udp, select.POLLIN)
        self._states_ready.register(tcp, select.POLLRDHUP)
        self._is_open = select.poll()
        self._is_open.register(tcp, select.POLLRDHUP)

    def wait_for_state(self, after: int, timeout: float) -> bool:
        """Returns whether a state with a number above `after` has arrived within a timeout, [s].

        Raises:
            ConnectionLostError: The controller has closed the connection, or a call was ended.
        """
        if self.limit.has_ended:
            raise self._lost()
        deadline = time.monotonic() + timeout
        while True:
            events = self._states_ready.poll(max(0.0, deadline - time.monotonic()) * _MS)
            if not events:
                return False
            if len(events) == 1 and events[0][0] == self._tcp.fileno():
                raise self._lost()
            if self._is_state(after):
                return True

    def require_open(self) -> None:
        """Checks that the connection is open.

        Raises:
            ConnectionLostError: The controller has closed it, or has not answered a call in time.
        """
        if self.limit.has_ended or self._is_open.poll(0):
            raise self._lost()

    def abort(self) -> None:
        """Ends the connection of the client, too, which then neither sends nor waits any more."""
        with suppress(OSError):
            self._tcp.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Closes the duplicates. May be called twice."""
        self.limit.close()
        self._tcp.close()
        self._udp.close()

    def _is_state(self, after: int) -> bool:
        """Returns whether the next datagram is a state with a number above `after`; drops it if not."""
        flags = socket.MSG_PEEK | socket.MSG_TRUNC | socket.MSG_DONTWAIT
        try:
            size, sender = self._udp.recvfrom_into(self._head, _ID_SIZE, flags)
        except (BlockingIOError, InterruptedError):
            return False
        if size == self._state_size and sender[0] == self._host and int.from_bytes(self._head, "little") > after:
            return True
        with suppress(BlockingIOError):
            self._udp.recv(1, socket.MSG_DONTWAIT)
        return False

    def _lost(self) -> ConnectionLostError:
        limit = self.limit
        reason = f"it did not answer within {limit.seconds:g} s" if limit.has_ended else "it closed the connection"
        return ConnectionLostError(
            f"{self._name}: the connection is lost ({reason}); look whether the controller runs, and connect again"
        )


def open_with_sockets(
    open_client: Callable[[], Client], state_size: int, peer: tuple[str, int], name: str, timeout: float
) -> tuple[Client, ClientSockets]:
    """Returns a new client and its sockets.

    Args:
        open_client: Connects a client.
        state_size: Size of a state, [bytes].
        peer: IPv4 address and TCP port of the controller.
        name: Name of the controller in errors.
        timeout: For the client to connect, [s].

    Raises:
        ConnectionLostError: The client raised an error, was not connected in time, or did not open a TCP and a UDP
            socket.
    """
    limit = CallLimit(*peer)
    try:
        return _open_with_sockets(open_client, state_size, limit, peer[1], name, timeout)
    except BaseException:
        limit.close()
        raise


def _open_with_sockets(
    open_client: Callable[[], Client], state_size: int, limit: CallLimit, port: int, name: str, timeout: float
) -> tuple[Client, ClientSockets]:
    before = _open_sockets().keys()
    limit.start(timeout)
    try:
        client = open_client()
        limit.stop()
    except Exception as error:  # The libraries have no common base class.
        if limit.has_ended:
            raise ConnectionLostError(
                f"{name}: the controller answers, but the client library got no answer within {timeout:g} s; close "
                "other clients of this controller, or restart it, and connect again"
            ) from error
        raise ConnectionLostError(
            f"{name}: the controller answers, but the client library cannot connect "
            f"({str(error).removeprefix('libfranka: ')}); check that no firewall drops the datagrams (UDP) in which "
            "its states arrive, and connect again"
        ) from error
    tcp = udp = None
    for number in (fd for inode, fd in _open_sockets().items() if inode not in before):
        duplicate = socket.socket(fileno=os.dup(number))  # Its flags are the client's: they stay as they are.
        if tcp is None and _is_connection(duplicate, port):
            tcp = duplicate
        elif udp is None and duplicate.type == socket.SOCK_DGRAM:
            udp = duplicate
        else:
            duplicate.close()
    if tcp is None or udp is None:
        raise ConnectionLostError(f"{name}: the client library is not connected; connect again")
    return client, ClientSockets(limit, tcp, udp, state_size, name)


def _open_sockets() -> dict[int, int]:
    """Returns the descriptor of each socket of this process, by inode."""
    found: dict[int, int] = {}
    for name in os.listdir(_FD):
        with suppress(OSError):  # That of the listing itself is closed.
            status = os.fstat(int(name))
            if stat.S_ISSOCK(status.st_mode):
                found[status.st_ino] = int(name)
    return found


def _is_connection(sock: socket.socket, port: int) -> bool:
    if sock.type != socket.SOCK_STREAM:
        return False
    try:
        return sock.getpeername()[1] == port
    except OSError:
        return False
