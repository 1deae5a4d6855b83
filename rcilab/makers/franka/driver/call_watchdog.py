"""The process of `CallLimit`: it disconnects a socket once the time of a call is over. A script without rcilab.

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


def main(tcp: int, memory: int) -> None:
    """Ends the call that passes its time; returns then, or when standard input is closed.

    Args:
        tcp: Descriptor of the socket.
        memory: Descriptor of the memory that is shared with `CallLimit`.
    """
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    numbers = memoryview(mmap.mmap(memory, 0)).cast("d")
    while not select.select([sys.stdin], [], [], _PERIOD)[0]:
        if 0.0 < numbers[0] < time.monotonic():
            numbers[1] = 1.0
            _disconnect(tcp)
            return


def _disconnect(descriptor: int) -> None:
    ctypes.CDLL(None).connect(descriptor, bytes(_SIZE), _SIZE)
    listener = socket.socket(fileno=descriptor)
    with suppress(OSError):  # A newer library has closed it already.
        listener.bind(("127.0.0.1", 0))
        listener.listen(1)
        socket.create_connection(listener.getsockname()).close()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
