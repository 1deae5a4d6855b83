"""Detects whether the notebook's page is open, by heartbeats that every front end answers without a script of ours.

Two numbers are linked in the browser (ipywidgets' jsdlink). The kernel increments one, and the other comes back from
every page that has this notebook open, shown or hidden: a browser slows the timers of a background tab down to one a
minute, but not its messages. A tab that is closed or reloaded, and a lost network, do not answer.

Answers come to one thread of the kernel, the listener. While it is busy, with a cell or with the work of a click, they
wait. So the listener is queried as well, and a heartbeat counts as missed only while the listener answers.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from functools import cache
from typing import Any

import ipywidgets
import traitlets

from rcilab.notebook.subshell_routing import handle_during_cells
from rcilab.notebook.widget_sharing import shared_style_widget

INTERVAL = 0.5  # [s] Between two heartbeats.
MAX_MISSED = 5  # Number of consecutive heartbeats, 2.5 s, that may stay without an answer while the listener is free.
_UNRESPONSIVE_TIME = INTERVAL * MAX_MISSED  # [s] Time without an answer after which a click would have to wait, too.


class _Answer(ipywidgets.IntText):
    """A number that only the page changes, and that needs no echo."""

    value = traitlets.CInt(0).tag(sync=True, echo_update=False)


@cache
def kernel_heartbeat() -> BrowserHeartbeat:
    """Returns the instance of the kernel."""
    return BrowserHeartbeat()


class BrowserHeartbeat:
    """Sends heartbeats; counts those missed while the listener is free, none before the first answer."""

    def __init__(self) -> None:
        self.is_cell_running: Callable[[], bool] = lambda: False
        """Whether the kernel runs a cell; the registry of cells sets it."""
        self._widgets: tuple[Any, ...] = ()
        self._lock = threading.RLock()
        self._asked = float("-inf")
        self._last_seen: float | None = None
        self._missed = 0  # Heartbeats without an answer while the listener was free.
        self._listener_loop: asyncio.AbstractEventLoop | None = None
        self._is_main = False  # Whether the listener is the thread that runs cells.
        self._is_listener_asked = False

    @property
    def was_seen(self) -> bool:
        """Whether a page has ever answered."""
        return self._last_seen is not None

    @property
    def is_gone(self) -> bool:
        """Whether a page was open and no longer answers the heartbeats of `beat`."""
        return self._missed >= MAX_MISSED

    @property
    def is_kernel_busy(self) -> bool:
        """Whether a cell runs and the kernel handles no message of the page: a click waits for the end of the cell."""
        last = self._last_seen
        is_overdue = last is not None and time.monotonic() - last > _UNRESPONSIVE_TIME
        return is_overdue and self.is_cell_running() and not self.is_gone

    def beat(self) -> None:
        """Sends a heartbeat if one is due; call it several times a second while the answer matters."""
        now = time.monotonic()
        with self._lock:
            if now - self._asked < INTERVAL:
                return
            self._asked = now
            self._ask_listener()
            self.open()
            self._widgets[0].value += 1

    def open(self) -> None:
        """Creates the linked numbers in the page, unless they exist; they close with every other widget."""
        with self._lock:
            if self._widgets and self._widgets[0].comm is not None:
                return
            question, answer = shared_style_widget(ipywidgets.IntText), shared_style_widget(_Answer)
            handle_during_cells(answer)
            answer.observe(self._on_answer, names="value")
            self._widgets = question, answer, ipywidgets.jsdlink((question, "value"), (answer, "value"))

    def _on_answer(self, change: Any) -> None:
        """Called in the listener's thread."""
        self._last_seen, self._missed = time.monotonic(), 0
        self._is_main = threading.current_thread() is threading.main_thread()
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:  # The caller runs outside a kernel.
            loop = None
        if loop is not self._listener_loop:
            self._listener_loop, self._is_listener_asked = loop, False

    def _ask_listener(self) -> None:
        loop = self._listener_loop
        if loop is None:
            return
        if loop.is_closed():  # The page has closed its subshell.
            self._missed += 1
        elif not self._is_listener_asked:
            self._is_listener_asked = True
            try:
                loop.call_soon_threadsafe(self._on_listener_answer)
            except RuntimeError:  # Closed just now.
                self._is_listener_asked = False

    def _on_listener_answer(self) -> None:
        """Called in the listener's thread."""
        self._is_listener_asked = False
        if not (self._is_main and self.is_cell_running()):  # While a cell awaits, this runs, but no message is handled.
            self._missed += 1
