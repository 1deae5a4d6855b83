"""Whether the page is still there: it is asked, and answers without a script of our own, in every notebook.

A number of ours is tied to another in the browser (ipywidgets' link). Counted up here, it comes back from every page
that has this notebook open, shown or hidden: a browser slows the timers of a tab in the background down to one a
minute, but not what arrives for it. A tab that is closed or loaded anew, and a network that is gone, do not answer.

Only who listens may call that silence. Answers come to one thread of the kernel, the ear; while it is busy, with a
cell or with what a press has set going, they wait. So the ear is asked as well, and only its answers count as time.
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

INTERVAL = 0.5  # [s] Between two questions.
PATIENCE = 5  # So many questions in a row may stay without an answer while there is a listener, 2.5 s.
_DEAF = INTERVAL * PATIENCE  # [s] Without an answer, whyever: a press would wait as well.


class _Answer(ipywidgets.IntText):
    """A number that only the page changes, and that needs no echo."""

    value = traitlets.CInt(0).tag(sync=True, echo_update=False)


@cache
def kernel_heart() -> BrowserHeartbeat:
    """Returns the kernel's own."""
    return BrowserHeartbeat()


class BrowserHeartbeat:
    """Asks the page for heartbeats while there is a listener. Where no page ever answered, none is missed."""

    def __init__(self) -> None:
        self.is_cell_running: Callable[[], bool] = lambda: False
        """Whether the kernel runs a cell; the registry of cells sets it."""
        self._widgets: tuple[Any, ...] = ()
        self._lock = threading.RLock()
        self._asked = float("-inf")
        self._heard: float | None = None
        self._missed = 0  # Questions without an answer that the ear was awake for.
        self._ear: asyncio.AbstractEventLoop | None = None
        self._is_main = False  # Whether the ear is the thread that runs cells.
        self._asking_ear = False

    @property
    def was_seen(self) -> bool:
        """Whether a page has ever answered."""
        return self._heard is not None

    @property
    def is_gone(self) -> bool:
        """Whether a page was there and is not any more, as far as `beat` has asked."""
        return self._missed >= PATIENCE

    @property
    def is_deaf(self) -> bool:
        """Whether a cell runs and the kernel does not hear the page: a press there waits for the end of the cell."""
        heard = self._heard
        is_silent = heard is not None and time.monotonic() - heard > _DEAF
        return is_silent and self.is_cell_running() and not self.is_gone

    def beat(self) -> None:
        """Asks, if it is time to; to be called several times a second for as long as the answer matters."""
        now = time.monotonic()
        with self._lock:
            if now - self._asked < INTERVAL:
                return
            self._asked = now
            self._ask_ear()
            self.open()
            self._widgets[0].value += 1

    def open(self) -> None:
        """Puts into the page what will answer, if it is not there yet or was closed with every other widget."""
        with self._lock:
            if self._widgets and self._widgets[0].comm is not None:
                return
            question, answer = lean(ipywidgets.IntText), lean(_Answer)
            hear_at_once(answer)
            answer.observe(self._on_answer, names="value")
            self._widgets = question, answer, ipywidgets.jsdlink((question, "value"), (answer, "value"))

    def _on_answer(self, change: Any) -> None:
        """In the ear's thread."""
        self._heard, self._missed = time.monotonic(), 0
        self._is_main = threading.current_thread() is threading.main_thread()
        try:
            ear = asyncio.get_running_loop()
        except RuntimeError:  # Whatever has called us, it is no kernel that could be asked whether it listens.
            ear = None
        if ear is not self._ear:
            self._ear, self._asking_ear = ear, False

    def _ask_ear(self) -> None:
        ear = self._ear
        if ear is None:
            return
        if ear.is_closed():  # The page has taken it along.
            self._missed += 1
        elif not self._asking_ear:
            self._asking_ear = True
            try:
                ear.call_soon_threadsafe(self._on_awake)
            except RuntimeError:  # Closed just now.
                self._asking_ear = False

    def _on_awake(self) -> None:
        """In the ear's thread."""
        self._asking_ear = False
        if not (self._is_main and self.is_cell_running()):  # A cell that awaits lets us in, but no message.
            self._missed += 1
