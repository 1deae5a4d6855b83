"""Kernels that have loaded already what others brought: forked from a process that waits for orders.

A kernel and the libraries that lessons draw and compute with take a second of a processor to load, every time the same.
rcilab is not among them: each kernel loads of it what its lesson asks for.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import warnings
from contextlib import suppress
from importlib import import_module
from pathlib import Path

LOADED = (
    "ipykernel.ipkernel", "ipykernel.kernelapp", "ipywidgets", "matplotlib.backends.backend_agg", "matplotlib.pyplot",
    "meshcat", "numpy", "pinocchio", "ruckig",
)  # fmt: skip
LAUNCHER = "ipykernel_launcher"
NULL = os.open(os.devnull, os.O_RDWR)


class Fork:
    """As much of a `Popen` as a kernel's manager needs."""

    stdin = stdout = stderr = None

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._handle = os.pidfd_open(pid)

    def __del__(self) -> None:
        os.close(self._handle)

    def poll(self) -> int | None:
        return self.wait(0.0)

    def wait(self, timeout: float | None = None) -> int | None:
        return 0 if select.select([self._handle], [], [], timeout)[0] else None

    def send_signal(self, signum: int) -> None:
        signal.pidfd_send_signal(self._handle, signum)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


class WarmKernels:
    """A process that has everything loaded and becomes a kernel as often as it is asked to. It ends with `close`."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def launch(self, cmd: list[str], *, env: dict[str, str], cwd: str | None = None, **others: object) -> Fork:
        """Stands in for `jupyter_client.launcher.launch_kernel`."""
        arguments = cmd[cmd.index(LAUNCHER) + 1 :]
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({"arguments": arguments, "environment": env, "folder": cwd}) + "\n")
        self._process.stdin.flush()
        return Fork(int(self._process.stdout.readline()))

    def close(self) -> None:
        with self._process:
            assert self._process.stdin is not None
            self._process.stdin.close()


def main() -> None:
    os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"  # Read while matplotlib loads.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # Of meshcat, as everywhere.
        for name in LOADED:
            import_module(name)
    for line in sys.stdin:
        if os.fork() == 0:
            become_kernel(**json.loads(line))
            return
        bury()
    bury()


def bury() -> None:
    with suppress(ChildProcessError):  # There is none.
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def become_kernel(arguments: list[str], environment: dict[str, str], folder: str | None) -> None:
    from ipykernel.kernelapp import IPKernelApp

    os.setsid()
    print(os.getpid(), flush=True)
    os.dup2(NULL, 0)
    os.dup2(2, 1)
    os.environ.clear()
    os.environ.update(environment)
    if folder is not None:
        os.chdir(folder)
    sys.path.remove(str(Path(__file__).parent))
    ends_with = f"--IPKernelApp.parent_handle={os.getppid()}"
    IPKernelApp.launch_instance(argv=[*arguments, ends_with])


if __name__ == "__main__":
    main()
