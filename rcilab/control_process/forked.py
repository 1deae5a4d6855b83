"""Processes of ours as copies of the fork server, which starts with the first of them and ends with this process."""

from __future__ import annotations

import atexit
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress

from rcilab.control_process.fork_order import TOLD, Order

_WORD_TIMEOUT = 5.0  # [s] For a process that was ended to be gone, and for the fork server's word on it; a choice.
_LIBRARIES = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # What forks must have one thread.


class ForkServer:
    """The fork server as seen from here. It takes orders from the start, and follows them once it has loaded.

    Raises:
        OSError: It could not be started.
    """

    def __init__(self) -> None:
        self._connection, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "rcilab.control_process.fork_server", "--socket", str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**os.environ, **_LIBRARIES},
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Process id: the parent of every copy."""
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def send(self, order: Order, files: Sequence[int]) -> None:
        """Sends an order with the files that go with it; returns at once."""
        text = os.memfd_create("order")
        try:
            os.write(text, order.pack())
            self._connection.setblocking(False)
            socket.send_fds(self._connection, [b"!"], [text, *files])
        finally:
            os.close(text)

    def end(self) -> None:
        """Ends it; what it has forked sees that, and ends in its own way."""
        self._connection.close()
        self._process.kill()
        self._process.wait()

    def forget(self) -> None:
        """Lets go of it in a fork of this process: it belongs to the other one."""
        self._connection.close()
        self._process.returncode = 0  # Not our child.

    def leave_behind(self) -> None:
        """Leaves it to the end of this process, at which its connection ends, and not earlier: others may go on."""
        self._connection.detach()
        self._process.returncode = 0  # It is not waited for, and that is no mistake.


_server: ForkServer | None = None
_lock = threading.Lock()


def fork_server() -> ForkServer:
    """Returns the fork server of this process; starts one where there is none, or the last one has died.

    Raises:
        OSError: It could not be started.
    """
    global _server
    with _lock:
        if _server is not None and not _server.is_alive:
            _server.end()
            _server = None
        if _server is None:
            _server = ForkServer()
        return _server


def _forget() -> None:
    """Makes sure that a fork of this process, such as Python's `multiprocessing` makes them, gets its own."""
    global _server, _lock
    _lock = threading.Lock()
    if _server is not None:
        _server.forget()
        _server = None


@atexit.register
def _leave_behind() -> None:
    if _server is not None:
        _server.leave_behind()


os.register_at_fork(after_in_child=_forget)


class Forked:
    """A process that is a copy of the fork server. It may still have to come to be: that takes as long as loading.

    Args:
        order: What it is.
        files: Its stdout, its stderr, and what belongs to the descriptors of the order; they stay the caller's.

    Raises:
        OSError: It could not be asked for.
    """

    def __init__(self, order: Order, files: Sequence[int]) -> None:
        self._server = fork_server()
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._pid: int | None = None
        self._handle: int | None = None
        self._exit_code: int | None = None
        self._is_told = False  # Whether there is nothing more to hear.
        with theirs:
            self._server.send(order, [theirs.fileno(), *files])

    @property
    def pid(self) -> int | None:
        """Process id; None as long as it is none."""
        self.wait(0.0)
        return self._pid

    @property
    def exit_code(self) -> int | None:
        """As `subprocess` has it: minus the number of a signal that ended it; None: it runs, or nobody saw its end."""
        if self.wait(0.0):
            self._listen(_WORD_TIMEOUT)
            self._is_told = True
        return self._exit_code

    def wait(self, timeout: float) -> bool:
        """Returns whether it has ended, or is known never to be, within `timeout`, [s]."""
        if self._handle is None:
            self._listen(timeout)
        if self._handle is None:
            return self._is_told
        return bool(select.select([self._handle], [], [], timeout)[0])

    def terminate(self, timeout: float) -> bool:
        """Asks it to end (SIGTERM) as soon as it is there; returns whether it has within `timeout`, [s]."""
        if self._handle is None:
            self._listen(timeout)
        self._signal(signal.SIGTERM)
        return self.wait(timeout)

    def kill(self) -> None:
        """Ends it at once and waits until it is gone."""
        if not self.wait(0.0) and self._pid is None:
            self._server.end()  # Whoever has not followed an order until now never will.
        self._signal(signal.SIGKILL)
        self.wait(_WORD_TIMEOUT)

    def close(self) -> None:
        """Lets go of it, once it has ended; how is still known."""
        self.exit_code  # noqa: B018
        self._channel.close()
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None

    def _signal(self, number: int) -> None:
        if self._handle is not None and not self.wait(0.0):
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, number)

    def _listen(self, timeout: float) -> None:
        """Takes in what the fork server says next."""
        if self._is_told or not select.select([self._channel], [], [], timeout)[0]:
            return
        told, handles, _, _ = socket.recv_fds(self._channel, TOLD.size, 1)
        if handles:
            self._pid, self._handle = TOLD.unpack(told)[0], handles[0]
            os.set_inheritable(self._handle, False)
        else:  # An empty message: the fork server is gone.
            self._exit_code, self._is_told = TOLD.unpack(told)[0] if told else None, True
