"""Whether the page is open: it answers heartbeats without a script of our own, in every notebook front end.

Two numbers are tied together in the browser (ipywidgets' link). One is counted up here, and the other comes back from
every page that has this notebook open, shown or hidden: a browser slows the timers of a background tab down to one a
minute, but not its messages. A tab that is closed or reloaded, and a lost network, do not answer.

Answers come to one thread of the kernel, the listener. While it is busy, with a cell or with the work of a click, they
wait. So the listener is asked as well, and only the time in which it answers counts as silence of the page.
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

from rcilab.notebook.subshell_routing import hear_at_once
from rcilab.notebook.widget_sharing import lean

INTERVAL = 0.5  # [s] Between two heartbeats.
PATIENCE = 5  # Number of consecutive heartbeats, 2.5 s, that may stay without an answer while the listener is free.
_DEAF = INTERVAL * PATIENCE  # [s] Time without an answer after which a click would have to wait, too.


class _Answer(ipywidgets.IntText):
    """A number that only the page changes, and that needs no echo."""

    value = traitlets.CInt(0).tag(sync=True, echo_update=False)


@cache
def kernel_heart() -> BrowserHeartbeat:
    """Returns the instance of the kernel."""
    return BrowserHeartbeat()


class BrowserHeartbeat:
    """Asks the page for heartbeats while the listener is free. Without any answer so far, none is missed."""

    def __init__(self) -> None:
        self.is_cell_running: Callable[[], bool] = lambda: False
        """Whether the kernel runs a cell; the registry of cells sets it."""
        self._widgets: tuple[Any, ...] = ()
        self._lock = threading.RLock()
        self._asked = float("-inf")
        self._last_seen: float | None = None
        self._missed = 0  # Heartbeats without an answer while the listener was free.
        self._ear: asyncio.AbstractEventLoop | None = None
        self._is_main = False  # Whether the listener is the thread that runs cells.
        self._asking_ear = False

    @property
    def was_seen(self) -> bool:
        """Whether a page has ever answered."""
        return self._last_seen is not None

    @property
    def is_gone(self) -> bool:
        """Whether a page was open and is closed now, as far as `beat` has asked."""
        return self._missed >= PATIENCE

    @property
    def is_deaf(self) -> bool:
        """Whether a cell runs and the kernel handles no message of the page: a click waits for the end of the cell."""
        last = self._last_seen
        is_silent = last is not None and time.monotonic() - last > _DEAF
        return is_silent and self.is_cell_running() and not self.is_gone

    def beat(self) -> None:
        """Sends a heartbeat if it is time to; to be called several times a second as long as the answer matters."""
        now = time.monotonic()
        with self._lock:
            if now - self._asked < INTERVAL:
                return
            self._asked = now
            self._ask_ear()
            self.open()
            self._widgets[0].value += 1

    def open(self) -> None:
        """Creates the tied numbers in the page, unless they exist; they close with every other widget."""
        with self._lock:
            if self._widgets and self._widgets[0].comm is not None:
                return
            question, answer = lean(ipywidgets.IntText), lean(_Answer)
            hear_at_once(answer)
            answer.observe(self._on_answer, names="value")
            self._widgets = question, answer, ipywidgets.jsdlink((question, "value"), (answer, "value"))

    def _on_answer(self, change: Any) -> None:
        """In the listener's thread."""
        self._last_seen, self._missed = time.monotonic(), 0
        self._is_main = threading.current_thread() is threading.main_thread()
        try:
            ear = asyncio.get_running_loop()
        except RuntimeError:  # The caller has no kernel that could be asked.
            ear = None
        if ear is not self._ear:
            self._ear, self._asking_ear = ear, False

    def _ask_ear(self) -> None:
        ear = self._ear
        if ear is None:
            return
        if ear.is_closed():  # The page has closed it.
            self._missed += 1
        elif not self._asking_ear:
            self._asking_ear = True
            try:
                ear.call_soon_threadsafe(self._on_awake)
            except RuntimeError:  # Closed just now.
                self._asking_ear = False

    def _on_awake(self) -> None:
        """In the listener's thread."""
        self._asking_ear = False
        if not (self._is_main and self.is_cell_running()):  # A cell that awaits lets this run, but no message.
            self._missed += 1
