"""Closes what a cell has created when the cell runs again and when the kernel ends; an interrupt stops its motions.

A notebook has no window to close: without this, a cell that runs again would leave its server, process and threads.
JupyterLab and VS Code send the cell's id with every run; for other front ends (nbclient) the text is the id.
"""

from __future__ import annotations

import asyncio
import atexit
import hashlib
import os
import signal
import socket
import sys
import threading
import weakref
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from typing import Any, Protocol

from rcilab.notebook.browser_watchdog import BrowserWatchdog


class CellResource(Protocol):
    """A resource that a cell may own."""

    def close(self) -> None:
        """Closes the resource; may be called twice."""
        ...

    def halt(self) -> None:
        """Stops the motion that the resource controls; from any thread, without waiting."""
        ...


class CellRegistry:
    """Assigns resources to cells. The kernel has one instance; tests create their own.

    Args:
        shell: IPython's shell; None outside of IPython, where resources end with the process.
    """

    def __init__(self, shell: Any) -> None:
        self._shell = shell
        self._owned: dict[str, list[weakref.ref[CellResource]]] = {}
        self._keep: dict[int, CellResource] = {}  # An output may hold the only other reference to a part.
        self._running = threading.Event()
        if shell is not None:
            shell.events.register("pre_run_cell", self.begin)
            shell.events.register("post_run_cell", self.end)
            _stop_on_interrupts(shell, self.halt)
            if self._current() is not None:  # The running cell began before this object existed.
                self._running.set()

    @property
    def is_running(self) -> bool:
        """Whether a cell is running."""
        return self._running.is_set()

    @property
    def is_calling(self) -> bool:
        """Whether the caller is code that continues afterwards: a cell, or a program outside of a notebook."""
        if self._shell is None:
            return True
        return self.is_running and threading.current_thread() is threading.main_thread()

    def adopt(self, resource: CellResource) -> None:
        """Assigns a resource to the running cell; one that a click creates between two cells ends with its creator."""
        cell = self._current()
        if cell is not None:
            self._owned.setdefault(cell, []).append(weakref.ref(resource))
        self.keep(resource)

    def keep(self, resource: CellResource) -> None:
        """Assigns a resource to the kernel."""
        self._keep[id(resource)] = resource

    def forget(self, resource: CellResource) -> None:
        """Removes a closed resource."""
        self._keep.pop(id(resource), None)

    def begin(self, info: Any) -> None:
        """Closes the resources of a cell's last run; called before the cell runs."""
        self._running.set()
        for reference in reversed(self._owned.pop(_name(info.cell_id, info.raw_cell), [])):
            resource = reference()
            if resource is not None:
                resource.close()

    def end(self, result: Any) -> None:
        """Stops all motions if the cell that has ended was interrupted; called after every cell.

        A cell that awaits is cancelled by an interrupt, and may then have no result.
        """
        self._running.clear()
        if result is None or isinstance(result.error_in_exec, KeyboardInterrupt | asyncio.CancelledError):
            self.halt()

    def halt(self) -> None:
        """Stops the motions of all cells; an error does not prevent the others from being stopped."""
        failures: list[Exception] = []
        for resource in list(self._keep.values()):
            try:
                resource.halt()
            except Exception as error:
                failures.append(error)
        if failures:
            raise ExceptionGroup("not everything could be stopped", failures)

    def close(self) -> None:
        """Ends all resources."""
        self._owned.clear()
        for resource in reversed(list(self._keep.values())):
            with suppress(Exception):  # The process ends: an error must not prevent the rest from being closed.
                resource.close()

    def _current(self) -> str | None:
        parent = self._shell.get_parent() if hasattr(self._shell, "get_parent") else {}
        content = parent.get("content", {})
        if "code" not in content:
            return None
        return _name(parent.get("metadata", {}).get("cellId"), content["code"])


def kernel_cells() -> CellRegistry:
    """Returns the instance of the kernel."""
    global _kernel_cells
    if _kernel_cells is None:
        shell = None
        if "IPython" in sys.modules:
            from IPython.core.getipython import get_ipython

            shell = get_ipython()
        _kernel_cells = CellRegistry(shell)
        atexit.register(_kernel_cells.close)
        if getattr(shell, "kernel", None) is not None and find_spec("ipywidgets") is not None:
            _kernel_cells.keep(BrowserWatchdog(lambda: kernel_cells().is_running))
    return _kernel_cells


_kernel_cells: CellRegistry | None = None


def _name(cell_id: str | None, code: str | None) -> str:
    return cell_id or hashlib.sha256((code or "").encode()).hexdigest()


def _stop_on_interrupts(shell: Any, act: Callable[[], None]) -> None:
    """Makes every interrupt of the kernel stop all motions, whatever its main thread does at that moment.

    ipykernel ignores an interrupt while it is idle, drops one that comes while it handles a widget's message, and does
    not wake its event loop for an interrupt that should cancel an awaiting cell. Therefore Python reports every
    interrupt to a thread (`signal.set_wakeup_fd`), also while the main thread is inside a library.
    """
    kernel = getattr(shell, "kernel", None)
    if kernel is None or not hasattr(kernel, "io_loop"):
        return
    reader, writer = socket.socketpair()
    writer.setblocking(False)

    def watch() -> None:
        with reader, writer:
            while numbers := reader.recv(64):
                if former >= 0:
                    with suppress(OSError):
                        os.write(former, numbers)
                if signal.SIGINT in numbers:
                    act()
                    kernel.io_loop.add_callback(_do_nothing)  # Wakes the loop, which then cancels the cell.

    def install() -> None:
        nonlocal former
        former = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
        kernel.saved_sigint_handler = _do_nothing  # An ignored signal wakes no thread.
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, _do_nothing)
        threading.Thread(target=watch, name="interrupts", daemon=True).start()

    former = -1
    if threading.current_thread() is threading.main_thread():
        install()
    else:
        kernel.io_loop.add_callback(install)


def _do_nothing(*_: object) -> None:
    pass
