"""Whether the page is still there: a browser that counts, without a script of our own and in every notebook.

ipywidgets' play control counts in the browser; hidden, it is a heartbeat. When the tab is closed, the page reloaded or
the network gone, it falls silent.
"""

from __future__ import annotations

import time
from typing import Any

import ipywidgets

from rcilab.notebook.cells import kernel_cells
from rcilab.notebook.lean import lean

INTERVAL = 500  # [ms] A page in the background is throttled to once a second.
SILENCE = 2.5  # [s] A choice: so long a page may be silent before it counts as gone.


class Heart:
    """Beats in every page that shows `widget`. No page has ever been seen in a run without a browser."""

    def __init__(self) -> None:
        self.widget: Any = lean(
            ipywidgets.Play, min=0, max=2**30, interval=INTERVAL, show_repeat=False, classes=("rl-heart",)
        )
        self._heard: float | None = None
        self._beat = 0.0
        self.widget.observe(self._on_beat, names="value")

    @property
    def was_seen(self) -> bool:
        """Whether a page has ever answered."""
        return self._heard is not None

    @property
    def is_gone(self) -> bool:
        """Whether a page was there and is not any more. While a cell runs the kernel may be deaf: it is not gone."""
        if self._heard is None:
            return False
        if kernel_cells().is_running:
            self._heard = time.monotonic()
        return time.monotonic() - self._heard > SILENCE

    @property
    def is_deaf(self) -> bool:
        """Whether a cell runs and the kernel hears the page no more: a press there waits for the end of the cell."""
        return self.was_seen and kernel_cells().is_running and time.monotonic() - self._beat > SILENCE

    def start(self) -> None:
        """Begins to listen."""
        self._heard = None
        self.widget.playing = True

    def stop(self) -> None:
        """Ends it."""
        self.widget.playing = False

    def _on_beat(self, change: Any) -> None:
        self._heard = self._beat = time.monotonic()
