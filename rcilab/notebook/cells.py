"""What a cell has made ends when the cell runs again, when it is interrupted, and with the kernel.

A notebook has no window to close: a cell that is run again would leave its server, its process and its threads behind.
JupyterLab and VS Code name the cell with every run; where no front end does (nbclient), its text is its name.
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
    """What a cell may own."""

    def close(self) -> None:
        """Ends it; may be called twice."""
        ...

    def halt(self) -> None:
        """Stops what it moves; from any thread, without waiting."""
        ...


class CellRegistry:
    """Who was made by which cell. There is one for the kernel; tests make their own.

    Args:
        shell: IPython's shell; None outside of IPython, where everything ends with the process.
    """

    def __init__(self, shell: Any) -> None:
        self._shell = shell
        self._owned: dict[str, list[weakref.ref[CellResource]]] = {}
        self._keep: dict[int, CellResource] = {}  # An output may be the only one to hold a part.
        self._running = threading.Event()
        if shell is not None:
            shell.events.register("pre_run_cell", self.begin)
            shell.events.register("post_run_cell", self.end)
            _stop_on_interrupts(shell, self.halt)
            if self._current() is not None:  # It has begun before anybody listened.
                self._running.set()

    @property
    def is_running(self) -> bool:
        """Whether a cell runs at this moment."""
        return self._running.is_set()

    @property
    def is_calling(self) -> bool:
        """Whether it is code that calls and goes on afterwards: a cell, or a program outside of a notebook."""
        if self._shell is None:
            return True
        return self.is_running and threading.current_thread() is threading.main_thread()

    def adopt(self, thing: CellResource) -> None:
        """Ties something to the cell that is running now; what a press makes between two cells ends with its maker."""
        cell = self._current()
        if cell is not None:
            self._owned.setdefault(cell, []).append(weakref.ref(thing))
        self.keep(thing)

    def keep(self, thing: CellResource) -> None:
        """Has something end with the kernel only."""
        self._keep[id(thing)] = thing

    def forget(self, thing: CellResource) -> None:
        """Lets go of what has been closed."""
        self._keep.pop(id(thing), None)

    def begin(self, info: Any) -> None:
        """A cell is about to run: what its last run has made ends."""
        self._running.set()
        for reference in reversed(self._owned.pop(_name(info.cell_id, info.raw_cell), [])):
            thing = reference()
            if thing is not None:
                thing.close()

    def end(self, result: Any) -> None:
        """A cell has ended; if it was interrupted, everything that moves stops.

        A cell that awaits is cancelled by an interrupt, and may then have no result at all.
        """
        self._running.clear()
        if result is None or isinstance(result.error_in_exec, KeyboardInterrupt | asyncio.CancelledError):
            self.halt()

    def halt(self) -> None:
        """Stops whatever any cell moves; what cannot be stopped does not keep the others moving."""
        failures: list[Exception] = []
        for thing in list(self._keep.values()):
            try:
                thing.halt()
            except Exception as error:
                failures.append(error)
        if failures:
            raise ExceptionGroup("not everything could be stopped", failures)

    def close(self) -> None:
        """Ends everything."""
        self._owned.clear()
        for thing in reversed(list(self._keep.values())):
            with suppress(Exception):  # The process ends: what cannot be closed must not keep the others open.
                thing.close()

    def _current(self) -> str | None:
        parent = self._shell.get_parent() if hasattr(self._shell, "get_parent") else {}
        content = parent.get("content", {})
        if "code" not in content:
            return None
        return _name(parent.get("metadata", {}).get("cellId"), content["code"])


def kernel_cells() -> CellRegistry:
    """Returns the kernel's own."""
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
    """Has every interrupt of the kernel stop what moves, whatever its main thread does at that moment.

    ipykernel ignores an interrupt while it is idle, swallows one that comes while it handles a widget's message, and
    does not wake its event loop for one that is to cancel a cell which awaits. The interpreter informs a thread of
    each (`signal.set_wakeup_fd`), also while the main thread is in a library.
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
