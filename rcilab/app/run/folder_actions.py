"""Deletes recorded runs, after a confirmation. Owned by the dispatcher's thread."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from rcilab.app.request import Handlers, Request
from rcilab.app.store import Store
from rcilab.i18n.translator import message
from rcilab.recording.folder import keep_newest, newest_runs, stored_runs
from rcilab.recording.run_summary import RunSummary, summarize_run

KEEPS = (100, 20, 5, 0)
"""Choices for the number of runs to keep."""

_LOOK = 2.0  # [s] Between two reads of the folder.
_LISTED = 100  # Of the newest runs. Tuning value.
_AT_ONCE = 4  # New files that one tick reads: each takes some milliseconds.
_GROWING = 4_000_000_000  # [ns] A file without its end that has just changed is still being written.


@dataclass(frozen=True, slots=True, kw_only=True)
class ClearRuns(Request):
    """Delete recorded runs except for the newest ones."""

    what: Literal["choose", "ask", "confirm", "cancel"]
    keep: int
    """Number of runs to keep."""


class FolderActions:
    """Measures the folder, and deletes old runs.

    Args:
        store: Has the folder's path and size.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._next = float("-inf")
        self._read: dict[tuple[Path, int, int], RunSummary | None] = {}  # Of unchanged files; None of no runs.

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            ClearRuns: self.clear,
        }

    def clear(self, request: ClearRuns) -> None:
        """Asks first, then deletes all runs except for the newest ones; a run in progress is kept."""
        folder, state = self._store.state.folder, self._store.state
        if request.keep not in KEEPS or state.runs is None:
            return
        if request.what == "choose":
            self._show(keep=request.keep, asked=False)
        elif request.what == "cancel":
            self._show(asked=False)
        elif request.what == "ask":
            self._show(asked=True)
        elif folder.asked and request.keep == folder.keep:
            is_recording = state.recording is not None and state.recording.run is None
            gone = keep_newest(state.runs, request.keep + is_recording)
            self._show(asked=False)
            self._next = float("-inf")
            self._store.notify("good", message("runs.cleared", count=gone.count, size=megabytes(gone.size)))

    def tick(self) -> None:
        """Reads the folder from time to time."""
        runs, now = self._store.state.runs, time.monotonic()
        if runs is None or now < self._next:
            return
        self._next = now + _LOOK
        found = stored_runs(runs)
        self._show(count=found.count, size=found.size, runs=self._list(runs))

    def _list(self, folder: Path) -> tuple[RunSummary, ...]:
        """Returns the newest runs, newest first; of many new files, the rest is read at the next ticks."""
        known, self._read = self._read, {}
        unread = 0
        for key in newest_runs(folder, _LISTED):
            path, changed, _ = key
            if key in known:
                self._read[key] = known[key]
            elif unread < _AT_ONCE:
                summary = summarize_run(path)
                is_growing = summary is not None and summary.ended == "cut" and time.time_ns() - changed < _GROWING
                if not is_growing:
                    self._read[key] = summary
                unread += not is_growing
            else:
                self._next = float("-inf")
        return tuple(summary for summary in self._read.values() if summary is not None)

    def _show(self, **changes: Any) -> None:
        before = self._store.state.folder
        after = replace(before, **changes)
        if after != before:
            self._store.update(folder=after)


def megabytes(size: int) -> str:
    """Returns a size, [bytes], as text."""
    return f"{size / 1e9:.2f} GB" if size >= 1e9 else f"{size / 1e6:.1f} MB"
