"""A child process, forked from the fork server, with its output saved for error messages."""

from __future__ import annotations

import fcntl
import math
import multiprocessing.forkserver
import multiprocessing.resource_tracker
import os
import select
import signal
import sys
import tempfile
import traceback
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import IO

from rcilab.control_process.fork_server import fork, fork_server_pid, kill_fork_server
from rcilab.core.errors import ConnectionLostError

_END_TIMEOUT = 3.0  # [s] Between SIGTERM and SIGKILL.
_REPORT_TIMEOUT = 5.0  # [s] For a killed process to end and for the fork server to report it; both take far less.
_TAIL = 2000  # [bytes] of stderr that an error contains.
_NAME_SIZE = 15  # [bytes] of a process's name, in Linux.


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessTask:
    """The task of a process and its environment. Pickled here and run in the new process."""

    module: str
    """Its `main(arguments)` is called and returns the exit code."""
    arguments: tuple[str, ...]
    environment: dict[str, str]
    folder: str | None
    """Working folder; None: that of the fork server."""
    descriptors: tuple[int, ...]
    """Descriptor numbers of the inherited files after stdout and stderr."""

    def _bootstrap(self, parent_sentinel: int) -> int:
        """Runs the task in the new process and does not return.

        Multiprocessing calls it as it calls `Process._bootstrap`. As after every fork without `exec`, functions that
        were registered with `atexit` are not called.
        """
        code = 1
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            os.setsid()
            self._install_files()
            with suppress(OSError):  # The name in `top`; not essential.
                Path("/proc/self/comm").write_text(f"rcilab {self.module.rpartition('.')[2]}"[:_NAME_SIZE])
            os.environ.clear()
            os.environ.update(self.environment)
            if self.folder is not None:
                os.chdir(self.folder)
            sys.argv[:] = [self.module, *self.arguments]
            code = int(import_module(self.module).main(self.arguments) or 0)
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:  # As the interpreter does; the parent's error contains it.
            traceback.print_exc()
        finally:
            with suppress(OSError, ValueError):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)

    def _install_files(self) -> None:
        """Moves the inherited files to their numbers and closes all others.

        The others belong to multiprocessing. If a child kept the write end of its pipe open, the fork server would
        not end with the user's process.
        """
        numbers = (1, 2, *self.descriptors)
        copies = [_duplicate(file, numbers) for file in multiprocessing.forkserver.get_inherited_fds() or ()]
        for file, number in zip(copies, numbers, strict=True):
            os.dup2(file, number)
        for file in map(int, os.listdir("/proc/self/fd")):
            if file not in (0, *numbers):
                with suppress(OSError):  # The descriptor that `listdir` used.
                    os.close(file)
        multiprocessing.forkserver._forkserver._forkserver_alive_fd = None  # pyright: ignore[reportAttributeAccessIssue]
        multiprocessing.resource_tracker._resource_tracker._fd = None  # pyright: ignore[reportAttributeAccessIssue]


def _duplicate(file: int, numbers: Collection[int]) -> int:
    """Returns another descriptor of a file, outside these numbers; few are free if `ulimit -n` is low."""
    number = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, 3)
    while number in numbers:
        number = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, number + 1)
    return number


class ManagedProcess:
    """A child process with its output saved for error messages. It may not exist yet: the fork server loads first.

    Args:
        module: Module to run: its `main` receives the arguments and returns the exit code.
        arguments: Arguments of `main`.
        name: Name in errors.
        descriptors: Open files that it inherits, under the same numbers.

    Raises:
        ConnectionLostError: It could not be requested.
    """

    def __init__(self, module: str, arguments: Sequence[str], name: str, descriptors: Sequence[int] = ()) -> None:
        self.name = name
        self._pid: int | None = None
        self._handle: int | None = None
        self._exit_code: int | None = None
        self._is_reported = False  # Whether the fork server reports nothing more.
        self._stderr: IO[bytes] = tempfile.TemporaryFile()
        self._stdout, stdout = os.pipe()
        task = ProcessTask(
            module=module,
            arguments=tuple(arguments),
            environment=dict(os.environ),
            folder=_working_folder(),
            descriptors=tuple(descriptors),
        )
        try:
            self._status, self._sentinel = fork(task, [stdout, self._stderr.fileno(), *descriptors])
        except OSError as error:
            os.close(self._stdout)
            self._stderr.close()
            raise ConnectionLostError(f"{name} could not be started: {error}").coded("no_process") from error
        finally:
            os.close(stdout)

    @property
    def pid(self) -> int | None:
        """Process id; None until the process exists."""
        self.wait(0.0)
        return self._pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs or is being started."""
        return not self.wait(0.0)

    @property
    def exit_description(self) -> str:
        """How it ended, as text: "signal 9 (SIGKILL)", "exit code 1"."""
        if self.is_alive:
            return "it is running"
        if self._pid is not None:
            self._read_status(_REPORT_TIMEOUT)
        code = self._exit_code
        if code is None:
            return "exit status unknown"
        return f"signal {-code} ({signal.Signals(-code).name})" if code < 0 else f"exit code {code}"

    @property
    def stderr_tail(self) -> str:
        """The end of its stderr output."""
        if self._stderr.closed:
            return ""
        # No seek: the process shares the file position and would overwrite its earlier output.
        descriptor = self._stderr.fileno()
        start = max(0, os.fstat(descriptor).st_size - _TAIL)
        return os.pread(descriptor, _TAIL, start).decode(errors="replace").strip()

    def end(self, timeout: float = _END_TIMEOUT) -> None:
        """Sends SIGTERM once it exists, and SIGKILL if it has not ended after `timeout`, [s].

        May be called twice; `exit_description` remains available.
        """
        if self._stderr.closed:
            return
        if self._pid is None:
            self._read_status(timeout)
        self._signal(signal.SIGTERM)
        if not self.wait(timeout):
            self.kill()
        self.exit_description  # noqa: B018  Reads the exit code while the descriptors are open.
        self._is_reported = True
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
        for descriptor in (self._status, self._sentinel, self._stdout):
            os.close(descriptor)
        self._stderr.close()

    def kill(self) -> None:
        """Kills it and waits until it has ended."""
        if not self.wait(0.0) and self._pid is None:
            kill_fork_server()  # It does not respond: it will not fork this process.
        self._signal(signal.SIGKILL)
        self.wait(_REPORT_TIMEOUT)

    def wait(self, timeout: float) -> bool:
        """Returns whether it has ended, or can no longer start, within `timeout`, [s]."""
        if self._pid is None:
            self._read_status(timeout)
        if self._handle is not None:
            return _is_readable(self._handle, timeout)
        return self._pid is not None or self._is_reported

    def read_output(self) -> str:
        """Returns the stdout output since the last call; does not wait."""
        if not _is_readable(self._stdout, 0.0):
            return ""
        return os.read(self._stdout, 4096).decode(errors="replace")

    def _signal(self, number: int) -> None:
        if self._handle is not None and not self.wait(0.0):
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, number)

    def _read_status(self, timeout: float) -> None:
        """Reads the next report of the fork server: the process id, then the exit code."""
        if self._is_reported or not _is_readable(self._status, timeout):
            return
        try:
            number = multiprocessing.forkserver.read_signed(self._status)
        except EOFError:  # The fork server has ended.
            self._is_reported = True
            return
        if self._pid is None:
            self._pid = number
            with suppress(ProcessLookupError):  # It has ended, and the fork server has reaped it.
                self._handle = os.pidfd_open(number)
        else:
            self._exit_code, self._is_reported = number, True


def _is_readable(descriptor: int, timeout: float) -> bool:
    """Returns whether a descriptor, of any number, can be read or is at its end within a time, [s]."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(math.ceil(1e3 * timeout)))


def _working_folder() -> str | None:
    try:
        return os.getcwd()
    except FileNotFoundError:  # The folder was removed.
        return None


def parent_pid() -> int:
    """Returns the process id of the fork server: the parent of our processes, which ends with this process.

    Raises:
        ConnectionLostError: It could not be started.
    """
    try:
        return fork_server_pid()
    except OSError as error:
        raise ConnectionLostError(f"a second Python process could not be started: {error}").coded(
            "no_process"
        ) from error
