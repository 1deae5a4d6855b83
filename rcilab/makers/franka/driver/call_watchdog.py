"""The process of `CallLimit`: it disconnects a socket once the time of a call is over. A script without rcilab.

Until it has received the socket, the client library is connecting: then it looks for the connections of that process to
the controller, which the kernel lends to a process of the same user.

A library that polls the socket of a version 5 connection takes no notice of its end, but of an error of the query for
available bytes. That of a listening socket is one, so the socket listens afterwards, and has one connection waiting.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import select
import socket
import sys
import time
from contextlib import suppress

_PERIOD = 0.25  # [s] A tuning value: how much later than its time a call may end.
_SIZE = 16  # [bytes] Of an address of the kernel; zeros are AF_UNSPEC, which disconnects.
_PIDFD_GETFD = 438  # Number of the system call on every architecture; Python has no function for it.

_libc = ctypes.CDLL(None)


def main(memory: int, process: int, host: str, port: int) -> None:
    """Ends the call that passes its time; returns then, or when standard input is closed.

    Args:
        memory: Descriptor of the memory that is shared with `CallLimit`.
        process: Whose calls they are.
        host: IPv4 address of the controller,
        port: and its port.
    """
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    numbers = memoryview(mmap.mmap(memory, 0)).cast("d")
    messages, connections = socket.socket(fileno=sys.stdin.fileno()), list[int]()
    while True:
        if select.select([messages], [], [], _PERIOD)[0]:
            _, connections, _, _ = socket.recv_fds(messages, 1, 1)
            if not connections:
                return
        if 0.0 < numbers[0] < time.monotonic():
            numbers[1] = 1.0
            for descriptor in connections or _find_connections(process, (host, port)):
                _disconnect(descriptor)
            return


def _find_connections(process: int, peer: tuple[str, int]) -> list[int]:
    """Returns duplicates of the sockets of a process that are connected to a peer."""
    found: list[int] = []
    handle = os.pidfd_open(process)
    for name in os.listdir(f"/proc/{process}/fd"):
        with suppress(OSError):  # Closed meanwhile.
            if not os.readlink(f"/proc/{process}/fd/{name}").startswith("socket:"):
                continue
            descriptor = _libc.syscall(_PIDFD_GETFD, handle, int(name), 0)
            if descriptor >= 0 and _peer_of(descriptor) == peer:
                found.append(descriptor)
    return found


def _peer_of(descriptor: int) -> object:
    """Returns where a socket is connected to; None for one that is not."""
    sock = socket.socket(fileno=descriptor)
    try:
        return sock.getpeername()
    except OSError:
        return None
    finally:
        sock.detach()


def _disconnect(descriptor: int) -> None:
    _libc.connect(descriptor, bytes(_SIZE), _SIZE)
    listener = socket.socket(fileno=descriptor)
    with suppress(OSError):  # A newer library has closed it already.
        listener.bind(("127.0.0.1", 0))
        listener.listen(1)
        socket.create_connection(listener.getsockname()).close()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], int(sys.argv[4]))
