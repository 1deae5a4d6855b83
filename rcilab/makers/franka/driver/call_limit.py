"""A time limit for the calls of a client library.

The bindings of libfranka wait for an answer without a limit and hold Python's global lock meanwhile, so no thread of
this process can end a call, and Ctrl-C has no effect. Another process does (`call_watchdog.py`): it has a duplicate of
the library's TCP socket, and disconnects it once the time is over, for which the library raises an error.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

_SCRIPT = Path(__file__).with_name("call_watchdog.py")
_PR_SET_PTRACER = 0x59616D61  # Of prctl.


class CallLimit:
    """The time of the call in progress. One at a time; any thread may start and stop it.

    Attributes:
        seconds: Limit of the newest call, [s].

    Args:
        host: IPv4 address of the controller that the library connects to.
        port: Its TCP port.
    """

    def __init__(self, host: str, port: int) -> None:
        self.seconds = 0.0
        memory = os.memfd_create("call limit")
        self._messages, messages = socket.socketpair()
        try:
            os.truncate(memory, mmap.PAGESIZE)
            self._numbers = memoryview(mmap.mmap(memory, 0)).cast(
                "d"
            )  # When the call has to end; whether it was ended.
            command = [sys.executable, "-I", "-S", os.fspath(_SCRIPT), str(memory), str(os.getpid()), host, str(port)]
            self._process = subprocess.Popen(
                command,
                stdin=messages.fileno(),
                pass_fds=(memory,),
                start_new_session=True,  # Ctrl-C in a terminal is for this process only.
            )
        finally:
            os.close(memory)
            messages.close()
        _allow_access(self._process.pid)

    @property
    def has_ended(self) -> bool:
        """Whether a call was ended, and the connection with it."""
        return self._numbers[1] > 0.0

    def watch(self, tcp: socket.socket) -> None:
        """Limits the calls that wait at a socket, in place of those that connect."""
        socket.send_fds(self._messages, [b"."], [tcp.fileno()])
        _allow_access(0)

    def start(self, seconds: float) -> None:
        """Gives a call that begins a number of seconds."""
        self.seconds = seconds
        self._numbers[0] = time.monotonic() + seconds

    def stop(self) -> None:
        """Ends the time: the call has returned."""
        self._numbers[0] = 0.0

    def close(self) -> None:
        """Ends the process. May be called twice."""
        self._messages.close()
        self._process.kill()
        self._process.wait()


def _allow_access(process: int) -> None:
    """Allows a process to duplicate descriptors of this one, where Linux restricts it (Yama); 0: none."""
    ctypes.CDLL(None).prctl(_PR_SET_PTRACER, process, 0, 0, 0)
