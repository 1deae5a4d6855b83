"""The fork server of this process: multiprocessing's, with the libraries of our processes preloaded.

Loading the numerical libraries takes a control process or a virtual controller half a second of a core; a fork of a
process that has loaded them takes milliseconds. The instance is separate from the one that multiprocessing gives to
user code, because it differs in preloaded modules, session and signal handling. Its preparation data never name the
user's `__main__`, so that a script without `if __name__ == "__main__"` does not run a second time.
"""

from __future__ import annotations

import errno
import fcntl
import os
import pickle
import resource
import signal
import sys
from collections.abc import Sequence
from multiprocessing.forkserver import ForkServer

_PRELOAD = "rcilab.control_process.forkserver_preload"
_MIN_FILES = 20  # Open ones. With 15 the fork server cannot receive those of a process; it inherits the limit.


def _new_server() -> ForkServer:
    server = ForkServer()
    server.set_forkserver_preload([_PRELOAD])
    return server


_server = _new_server()


def fork_server_pid() -> int:
    """Returns the process id of the fork server, the parent of every process it forks; starts it if necessary.

    Raises:
        OSError: It could not be started.
    """
    global _server
    _require_files()
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Inherited until it ignores interrupts.
    try:
        try:
            _server.ensure_running()
        except ChildProcessError:  # It ended, and the user's code reaped it.
            _replace_server()
            _server.ensure_running()
        except FileNotFoundError:  # The working folder was removed; only a preload needs it.
            _server.set_forkserver_preload([])
            _server.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    return _server._forkserver_pid  # pyright: ignore[reportAttributeAccessIssue]  It has no public name.


def fork(task: object, files: Sequence[int]) -> tuple[int, int]:
    """Requests a process; returns at once, even while the fork server is still loading.

    Args:
        task: Object that the new process unpickles; it then calls `task._bootstrap(parent_sentinel)`.
        files: Open descriptors that the process inherits; the caller still closes its own.

    Returns:
        A descriptor from which the process id and later the exit code can be read (`multiprocessing.forkserver.
        read_signed`), and one whose other end, in the process, closes when this process ends.

    Raises:
        OSError: The fork server could not be started or reached.
    """
    fork_server_pid()
    sent = pickle.dumps({"sys_path": sys.path}) + pickle.dumps(task)
    _require_free_files()
    status, pipe = _server.connect_to_new_process(list(files))
    try:
        if len(sent) > fcntl.fcntl(pipe, fcntl.F_GETPIPE_SZ):  # A large environment; writing must not wait.
            fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, len(sent))
        os.write(pipe, sent)
    except OSError:
        os.close(status)
        os.close(pipe)
        raise
    return status, pipe


def _require_files() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != resource.RLIM_INFINITY and soft < _MIN_FILES:
        if hard != resource.RLIM_INFINITY and hard < _MIN_FILES:
            raise OSError(errno.EMFILE, f"only {hard} files may be open, {_MIN_FILES} are needed: raise ulimit -n")
        resource.setrlimit(resource.RLIMIT_NOFILE, (_MIN_FILES, hard))


def _require_free_files() -> None:
    """Requires the descriptors for a socket and two pipes.

    Without them multiprocessing connects and sends nothing, which the fork server does not survive.
    """
    held: list[int] = []
    try:
        for _ in range(3):
            held += os.pipe()
    finally:
        for descriptor in held:
            os.close(descriptor)


def kill_fork_server() -> None:
    """Kills a fork server that does not respond. The processes forked from it detect its end and exit."""
    pid = _server._forkserver_pid  # pyright: ignore[reportAttributeAccessIssue]
    if pid is not None:
        os.kill(pid, signal.SIGKILL)
        _server._stop()  # pyright: ignore[reportAttributeAccessIssue]


def _replace_server() -> None:
    """Replaces the fork server in a fork of this process, such as one that multiprocessing makes."""
    global _server
    alive = _server._forkserver_alive_fd  # pyright: ignore[reportAttributeAccessIssue]
    if alive is not None:
        os.close(alive)  # The other fork server ends with the process that owns it.
    _server = _new_server()


os.register_at_fork(after_in_child=_replace_server)
