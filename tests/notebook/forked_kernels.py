"""Kernels that are copies of one process, which has loaded what most lessons load before their first word.

Others' libraries only: whatever rcilab loads, each kernel loads itself, and so it hears whatever that has to say.
"""

from __future__ import annotations

import multiprocessing
import os
import runpy
import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from tests.waiting import wait_for

_CONTEXT = multiprocessing.get_context("forkserver")
_LOADED = ["tests.notebook.kernel_libraries"]


class ForkedKernel:
    """A kernel, as `subprocess.Popen` would show it to Jupyter."""

    def __init__(
        self, command: Sequence[str], env: Mapping[str, str] | None = None, cwd: str | None = None, **ignored: Any
    ) -> None:
        _CONTEXT.set_forkserver_preload(_LOADED)
        self._process = _CONTEXT.Process(
            target=_become, args=(list(command), dict(env or os.environ), cwd), daemon=True
        )
        with patch.dict(sys.modules["__main__"].__dict__, {"__file__": None, "__spec__": None}):  # pytest: not for it.
            self._process.start()
        assert self._process.pid is not None
        self.pid: int = self._process.pid
        self.stdin = self.stdout = self.stderr = None
        wait_for(lambda: os.getpgid(self.pid) == self.pid, what="a group of its own")  # Whom Jupyter will signal.

    @property
    def returncode(self) -> int | None:
        """Its exit code, once it has ended."""
        return self._process.exitcode

    def poll(self) -> int | None:
        """Returns its exit code, once it has ended."""
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int | None:
        """Waits for its end."""
        self._process.join(timeout)
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        """Sends it a signal."""
        os.kill(self.pid, number)

    def terminate(self) -> None:
        """Asks it to end."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Ends it."""
        self.send_signal(signal.SIGKILL)


@contextmanager
def forked_kernels() -> Iterator[None]:
    """Makes what Jupyter starts meanwhile such a kernel."""
    with patch("jupyter_client.provisioning.local_provisioner.launch_kernel", ForkedKernel):
        yield


def _become(command: list[str], environment: dict[str, str], directory: str | None) -> None:
    """Runs `python -m MODULE ARGUMENTS…` in a copy of the process."""
    os.setsid()
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(directory or ".")
    module = command.index("-m") + 1
    sys.argv = [*command[module:], f"--IPKernelApp.parent_handle={os.getppid()}"]  # It ends with us.
    runpy.run_module(command[module], run_name="__main__", alter_sys=True)
