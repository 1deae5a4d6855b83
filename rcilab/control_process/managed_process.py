"""A process of ours, forked from the fork server, with its output kept for error messages."""

from __future__ import annotations

import fcntl
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
_REPORT_TIMEOUT = 5.0  # [s] For a killed process to be gone and for the fork server's report of it: far above both.
_TAIL = 2000  # [bytes] of stderr that go into an error.
_NAME_SIZE = 15  # [bytes] of a process's name, in Linux.


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessTask:
    """What a process runs, and in which surroundings. Pickled here, run there."""

    module: str
    """Its `main(arguments)` is called and returns the exit code."""
    arguments: tuple[str, ...]
    environment: dict[str, str]
    folder: str | None
    """Its working folder; None: that of the fork server."""
    descriptors: tuple[int, ...]
    """The numbers under which it has the files that it inherits after stdout and stderr."""

    def _bootstrap(self, parent_sentinel: int) -> int:
        """Runs the task in the new process and does not return.

        Multiprocessing calls it as it would that of a `Process`. As after every fork without `exec`, what other parts
        registered for the interpreter's end is left out.
        """
        code = 1
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            os.setsid()
            self._take_files()
            with suppress(OSError):  # What `top` shows; not essential.
                Path("/proc/self/comm").write_text(f"rcilab {self.module.rpartition('.')[2]}"[:_NAME_SIZE])
            os.environ.clear()
            os.environ.update(self.environment)
            if self.folder is not None:
                os.chdir(self.folder)
            sys.argv[:] = [self.module, *self.arguments]
            code = int(import_module(self.module).main(self.arguments) or 0)
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:  # As the interpreter does; it is part of the error that the other side raises.
            traceback.print_exc()
        finally:
            with suppress(OSError, ValueError):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)

    def _take_files(self) -> None:
        """Gives the inherited files their numbers and closes all others.

        The others are multiprocessing's own. With the write end of its pipe open in a child the fork server would not
        end when the user's process does.
        """
        numbers = (1, 2, *self.descriptors)
        kept = [_duplicate(file, numbers) for file in multiprocessing.forkserver.get_inherited_fds() or ()]
        for file, number in zip(kept, numbers, strict=True):
            os.dup2(file, number)
        for file in map(int, os.listdir("/proc/self/fd")):
            if file not in (0, *numbers):
                with suppress(OSError):  # The one of `listdir`.
                    os.close(file)
        multiprocessing.forkserver._forkserver._forkserver_alive_fd = None  # pyright: ignore[reportAttributeAccessIssue]
        multiprocessing.resource_tracker._resource_tracker._fd = None  # pyright: ignore[reportAttributeAccessIssue]


def _duplicate(file: int, numbers: Collection[int]) -> int:
    """Returns another descriptor of a file, not one of these numbers; few are free where `ulimit -n` is low."""
    number = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, 3)
    while number in numbers:
        number = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, number + 1)
    return number


class ManagedProcess:
    """A process of ours with its output kept for error messages. It may not exist yet: the fork server loads first.

    Args:
        module: What to run: its `main` receives the arguments and returns the exit code.
        arguments: See above.
        name: What to call it in errors.
        descriptors: Open files it inherits, under the same numbers.

    Raises:
        ConnectionLostError: It could not be requested.
    """

    def __init__(self, module: str, arguments: Sequence[str], name: str, descriptors: Sequence[int] = ()) -> None:
        self.name = name
        self._pid: int | None = None
        self._handle: int | None = None
        self._exit_code: int | None = None
        self._is_reported = False  # Whether the fork server will not report anything more.
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
        """Process id; None as long as the process does not exist."""
        self.wait(0.0)
        return self._pid

    @property
    def is_alive(self) -> bool:
        """Whether it runs, or is about to."""
        return not self.wait(0.0)

    @property
    def how_it_ended(self) -> str:
        """In words, such as "signal 9 (SIGKILL)"."""
        if self.is_alive:
            return "it is running"
        if self._pid is not None:
            self._read_status(_REPORT_TIMEOUT)
        code = self._exit_code
        if code is None:
            return "unknown how"
        return f"signal {-code} ({signal.Signals(-code).name})" if code < 0 else f"exit code {code}"

    @property
    def last_words(self) -> str:
        """The end of what it wrote to stderr."""
        if self._stderr.closed:
            return ""
        # Not by seeking: the process shares the file's position with us and would overwrite its earlier output.
        descriptor = self._stderr.fileno()
        start = max(0, os.fstat(descriptor).st_size - _TAIL)
        return os.pread(descriptor, _TAIL, start).decode(errors="replace").strip()

    def end(self, timeout: float = _END_TIMEOUT) -> None:
        """Sends SIGTERM as soon as it exists, and SIGKILL when it has not ended after `timeout`, [s].

        May be called twice; how it ended remains known.
        """
        if self._stderr.closed:
            return
        if self._pid is None:
            self._read_status(timeout)
        self._signal(signal.SIGTERM)
        if not self.wait(timeout):
            self.kill()
        self.how_it_ended  # noqa: B018  Reads the exit code while the descriptors are open.
        self._is_reported = True
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
        for descriptor in (self._status, self._sentinel, self._stdout):
            os.close(descriptor)
        self._stderr.close()

    def kill(self) -> None:
        """Ends it at once and waits until it is gone."""
        if not self.wait(0.0) and self._pid is None:
            kill_fork_server()  # It does not respond, and will not fork this process any more.
        self._signal(signal.SIGKILL)
        self.wait(_REPORT_TIMEOUT)

    def wait(self, timeout: float) -> bool:
        """Returns whether it has ended, or is known never to start, within `timeout`, [s]."""
        if self._pid is None:
            self._read_status(timeout)
        if self._handle is not None:
            return bool(select.select([self._handle], [], [], timeout)[0])
        return self._pid is not None or self._is_reported

    def read_output(self) -> str:
        """Returns what was written to stdout since the last call; does not wait."""
        if not select.select([self._stdout], [], [], 0.0)[0]:
            return ""
        return os.read(self._stdout, 4096).decode(errors="replace")

    def _signal(self, number: int) -> None:
        if self._handle is not None and not self.wait(0.0):
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._handle, number)

    def _read_status(self, timeout: float) -> None:
        """Reads what the fork server reports next: the process id, then the exit code."""
        if self._is_reported or not select.select([self._status], [], [], timeout)[0]:
            return
        try:
            number = multiprocessing.forkserver.read_signed(self._status)
        except EOFError:  # The fork server is gone.
            self._is_reported = True
            return
        if self._pid is None:
            self._pid = number
            with suppress(ProcessLookupError):  # It has ended, and the fork server has reaped it.
                self._handle = os.pidfd_open(number)
        else:
            self._exit_code, self._is_reported = number, True


def _working_folder() -> str | None:
    try:
        return os.getcwd()
    except FileNotFoundError:  # The folder has been removed.
        return None


def parent_pid() -> int:
    """Returns the process id of our processes' parent, the fork server, which ends when this process does.

    Raises:
        ConnectionLostError: It could not be started.
    """
    try:
        return fork_server_pid()
    except OSError as error:
        raise ConnectionLostError(f"Python could not be started once more: {error}").coded("no_process") from error
