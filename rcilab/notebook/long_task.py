"""Long tasks in a background thread, with a progress bar and Cancel."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Generic

import ipywidgets

from rcilab.core.background_job import BackgroundJob, Context, ProgressCallback, Result
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import Text
from rcilab.notebook.cells import kernel_cells
from rcilab.notebook.subshell_routing import handle_during_cells
from rcilab.notebook.widget_sharing import shared_style_widget

_POLL_INTERVAL = 0.1  # [s] Between two reads of the progress.


class LongTask(Generic[Context, Result]):
    """One task of a part at a time; bar and button are visible meanwhile.

    Args:
        text: Catalogue of the part.
        name: Name of the threads.
        on_result: Called with the subject and the result of the task, by the watching thread.
        on_idle: Called when no task is in progress any more, whatever the result.
        shown_after: Shortest duration of a task with a progress bar, [s].
    """

    def __init__(
        self,
        text: Text,
        name: str,
        on_result: Callable[[Context, Result | RcilabError], None],
        on_idle: Callable[[], None],
        *,
        shown_after: float = 0.0,
    ) -> None:
        self._name, self._on_result, self._on_idle, self._shown_after = name, on_result, on_idle, shown_after
        self._work: BackgroundJob[Context, Result] = BackgroundJob(name)
        self._ending = threading.Event()
        self._watcher: threading.Thread | None = None
        self.progress: Any = shared_style_widget(
            ipywidgets.FloatProgress, min=0.0, max=1.0, layout=ipywidgets.Layout(width="14em", display="none")
        )
        self.cancel: Any = shared_style_widget(
            ipywidgets.Button,
            description=text("learn.cancel"),
            tooltip=text("learn.cancel"),
            icon="times",
            layout=ipywidgets.Layout(width="auto", display="none"),
        )
        handle_during_cells(self.cancel)
        self.cancel.on_click(lambda _: self.request_cancel())

    @property
    def is_busy(self) -> bool:
        """Whether a task is in progress."""
        return self._work.progress is not None

    def start(self, context: Context, run: Callable[[ProgressCallback], Result]) -> None:
        """Starts a task; the one in progress is cancelled.

        Args:
            context: Its subject; passed to `on_result` with the result.
            run: Carries out the task.
        """
        self.end()
        self._work.start(context, run)
        self._ending.clear()
        self.progress.value = 0.0
        if not self._shown_after:
            self._show(True)
        self._watcher = threading.Thread(target=self._watch, name=f"{self._name}-watch", daemon=True)
        self._watcher.start()

    def wait_if_code(self) -> None:
        """Waits for the result if a cell or a program calls; returns at once to a click on the page."""
        watcher = self._watcher
        if watcher is None or not kernel_cells().is_calling:
            return
        try:
            watcher.join()
        except KeyboardInterrupt:
            self.request_cancel()
            raise

    def request_cancel(self) -> None:
        """Cancels the task in progress; from any thread, without waiting."""
        self._work.cancel()

    def end(self) -> None:
        """Cancels the task and waits for the end of its watching thread."""
        self._ending.set()
        self._work.cancel()
        watcher, self._watcher = self._watcher, None
        if watcher is not None and watcher is not threading.current_thread():
            watcher.join()

    def _watch(self) -> None:
        """Shows the progress and delivers the result; runs in the watching thread."""
        try:
            self._work.wait(self._shown_after)
            while not self._ending.is_set():
                if self._work.is_done:
                    self._on_result(*self._work.pop_result())
                    return
                share = self._work.progress
                if share is None:  # Cancelled.
                    return
                self.progress.value = share
                self._show(True)
                self._work.wait(_POLL_INTERVAL)
        finally:
            self._show(False)
            if not self._ending.is_set():
                self._on_idle()

    def _show(self, is_shown: bool) -> None:
        display = None if is_shown else "none"
        self.progress.layout.display = self.cancel.layout.display = display
