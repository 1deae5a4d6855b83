"""The fork server: a process that has loaded what our processes need, and becomes one of them in a copy of itself.

To load the numerical libraries takes a control process or a virtual controller half a second of a core each time; a
copy of a process that has them takes some milliseconds. Started by `forked.py` as
`python -m rcilab.control_process.fork_server --socket FD`. It has one thread, as what forks must, and ends with whoever
started it. Its copies are its children: they see by `os.getppid()` that it is gone.
"""

from __future__ import annotations

import argparse
import fcntl
import gc
import os
import selectors
import signal
import socket
import sys
import traceback
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from rcilab.control_process.fork_order import FIRST_FILES, MOST_FILES, TOLD, Order

_NAME_SIZE = 15  # Of a process, in Linux.


@dataclass(frozen=True, slots=True)
class _Copy:
    """A child that lives."""

    pid: int
    handle: int
    channel: int


class ForkServer:
    """Forks when it is told to, and tells how its copies end. Owns the socket and everything that comes through it.

    Args:
        connection: Through which orders come.
    """

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._selector = selectors.DefaultSelector()
        self._selector.register(connection, selectors.EVENT_READ)
        self._copies: list[_Copy] = []

    def serve(self) -> Order | None:
        """Returns None when nobody can send orders any more; in a copy its order, with its files in place."""
        while True:
            for key, _ in self._selector.select():
                if isinstance(key.data, _Copy):
                    self._bury(key.data)
                    continue
                _, files, _, _ = socket.recv_fds(self._connection, 1, MOST_FILES)
                if len(files) < len(FIRST_FILES):
                    return None
                order = self._fork(files)
                if order is not None:
                    return order

    def _fork(self, files: list[int]) -> Order | None:
        """Returns the order in the copy, None in the fork server."""
        channel = files[FIRST_FILES.index("channel")]
        try:
            pid = os.fork()
        except OSError as error:
            os.write(files[FIRST_FILES.index("stderr")], str(error).encode())
            _tell(channel, 1)
            _close(files)
            return None
        if pid == 0:
            self._forget()
            return _take_files(files)
        copy = _Copy(pid, os.pidfd_open(pid), channel)
        with suppress(OSError):  # Whoever wanted it is gone; so are we, soon.
            with socket.socket(fileno=os.dup(channel)) as teller:
                socket.send_fds(teller, [TOLD.pack(pid)], [copy.handle])
        _close([file for file in files if file != channel])
        self._copies.append(copy)
        self._selector.register(copy.handle, selectors.EVENT_READ, copy)
        return None

    def _bury(self, copy: _Copy) -> None:
        _, status = os.waitpid(copy.pid, 0)
        _tell(copy.channel, os.waitstatus_to_exitcode(status))
        self._selector.unregister(copy.handle)
        self._copies.remove(copy)
        _close([copy.handle, copy.channel])

    def _forget(self) -> None:
        """In a copy: lets go of what belongs to the fork server."""
        self._selector.close()
        self._connection.close()
        for other in self._copies:
            _close([other.handle, other.channel])


def _tell(channel: int, number: int) -> None:
    with suppress(OSError):  # Nobody listens any more.
        os.write(channel, TOLD.pack(number))


def _close(files: Sequence[int]) -> None:
    for file in files:
        os.close(file)


def _take_files(files: Sequence[int]) -> Order:
    """Returns the order, and gives the files that it came with the numbers by which they are known."""
    order = Order.unpack(os.pread(files[0], os.fstat(files[0]).st_size, 0))
    kept = [_away_from({1, 2, *order.descriptors}, file) for file in files]
    _close(files)
    text, channel, stdout, stderr, *others = kept
    for source, number in zip((stdout, stderr, *others), (1, 2, *order.descriptors), strict=True):
        os.dup2(source, number)
    _close([text, channel, stdout, stderr, *others])
    return order


def _away_from(numbers: Collection[int], file: int) -> int:
    """Returns another descriptor of a file, none of these numbers; few are free where `ulimit -n` is low."""
    number = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, 3)
    while number in numbers:
        os.close(number)
        number = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, number + 1)
    return number


def become(order: Order) -> None:
    """Turns this process into what it was forked for; does not return.

    As after every fork that no `exec` follows, what other parts registered for the interpreter's end is left out.
    """
    code = 1
    try:
        os.setsid()  # Ctrl-C in the terminal is for the one who wanted it, who brings the arm to rest first.
        with suppress(OSError):  # What `top` shows; it goes without.
            Path("/proc/self/comm").write_text(f"rcilab {order.module.rpartition('.')[2]}"[:_NAME_SIZE])
        os.environ.clear()
        os.environ.update(order.environment)
        if order.folder is not None:
            os.chdir(order.folder)
        sys.argv[:] = [order.module, *order.arguments]
        code = int(import_module(order.module).main(order.arguments) or 0)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # As the interpreter does; whoever wanted us tells it.
        traceback.print_exc()
    finally:
        with suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def preload() -> None:
    """Loads what control processes and virtual controllers need. What fails here fails, and is told, in the copy."""
    with suppress(Exception):
        import rcilab.control_process.worker  # noqa: F401
        from rcilab.model.robot_model import load_model
        from rcilab.motion import plan_stop

        model = load_model("xMatePro7")
        model.rigid_body.gravity(model.home)  # The first one loads the library.
        zero = model.home * 0.0
        plan_stop(model.limits.joint, zero, zero + 0.1, zero)  # The first one loads the planner.
    gc.collect()
    gc.freeze()  # A copy need not look at it again, and so shares its memory for longer.


def main(argv: Sequence[str] | None = None) -> None:
    """Loads, and then forks until whoever started it is gone."""
    parser = argparse.ArgumentParser(prog="rcilab.control_process.fork_server", description=__doc__)
    parser.add_argument("--socket", type=int, required=True, metavar="FD", help="through which orders come")
    args = parser.parse_args(argv)
    # For us and all our copies: an interrupt is for who started us, who brings the arm to rest. A session of our own
    # keeps Ctrl-C away, but VS Code sends that of a kernel to every process below it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    preload()
    order = ForkServer(socket.socket(fileno=args.socket)).serve()
    if order is not None:
        become(order)


if __name__ == "__main__":
    main()
