"""Exports of the last run: written in a separate thread, then sent to the page that asked."""

from __future__ import annotations

import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING, TypeAlias

from rcilab.app.learn.learn_state import displayed_state
from rcilab.app.request import Handlers, Request
from rcilab.app.status_text import explain_error
from rcilab.core.errors import RcilabError
from rcilab.core.optional_deps import MissingExtraError
from rcilab.i18n.translator import message
from rcilab.recording.export import write_export

if TYPE_CHECKING:
    from rcilab.app.store import Store
    from rcilab.recording.run import Run

ENDINGS = (".csv", ".parquet", ".mcap", ".html", ".rcirun")
"""The formats, in the order of the buttons."""

Deliver: TypeAlias = Callable[["int | None", str, "IO[bytes]", Callable[[], bool]], bool]
"""Sends a file to a page: client id or None, name, content, whether to cancel; returns whether all was sent."""

_STEP = 0.05  # Smallest change of the progress that is shown.


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportRun(Request):
    """Export the last run as a file, through the browser."""

    ending: str
    """.csv, .parquet, .mcap, .html or .rcirun."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CancelExport(Request):
    """Cancel the export in progress."""


class _CancelledError(Exception):
    """The export was cancelled."""


@dataclass(frozen=True, slots=True)
class Export:
    """An export in progress."""

    ending: str
    share: float
    """Progress, 0 to 1."""


class ExportActions:
    """Exports, one at a time; the dispatcher's thread starts them and never waits.

    Args:
        store: Has the run and the progress.
        deliver: Sends a file to a page.
    """

    def __init__(self, store: Store, deliver: Deliver) -> None:
        self._store, self._deliver = store, deliver
        self._worker: threading.Thread | None = None
        self._cancelled = threading.Event()

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            ExportRun: self.export,
            CancelExport: self.cancel,
        }

    def export(self, request: ExportRun) -> None:
        """Starts an export; refused while another one is in progress."""
        recording = displayed_state(self._store.state).last_run
        run = None if recording is None else recording.run
        if request.ending not in ENDINGS:
            return
        if run is None:
            self._store.notify("warn", message("export.nothing"))
        elif self._store.state.export is not None:  # What the page shows; the thread ends a moment later.
            self._store.notify("warn", message("export.busy"))
        else:
            self._cancelled.clear()
            self._store.update(export=Export(request.ending, 0.0))
            self._worker = threading.Thread(
                target=self._write, args=(run, request.ending, request.page), name="export", daemon=True
            )
            self._worker.start()

    def cancel(self, request: CancelExport) -> None:
        """Cancels the export in progress, at its next progress report."""
        self._cancelled.set()

    def close(self) -> None:
        """Cancels the export in progress."""
        self._cancelled.set()
        if self._worker is not None:
            self._worker.join(10.0)

    def _write(self, run: Run, ending: str, page: int | None) -> None:
        try:
            with TemporaryFile(prefix="rcilab-") as stream:  # As text, a long run does not fit into memory.
                state = self._store.state
                write_export(
                    run, ending, stream, progress=self._follow(ending), language=state.language, units=state.units
                )
                size = f"{max(stream.tell() / 1e6, 0.01):.2f}"
                is_sent = self._deliver(page, file_name(run, ending), stream, self._cancelled.is_set)
            if self._cancelled.is_set():
                raise _CancelledError
        except _CancelledError:
            self._store.notify("warn", message("export.cancelled"))
        except MissingExtraError as error:
            self._store.notify("bad", message("export.missing", library=error.library))
        except MemoryError:
            self._store.notify("bad", message("export.memory"))
        except RcilabError as error:
            self._store.notify("bad", explain_error(error))
        except Exception as error:  # After a bug of ours, no incomplete file must be sent.
            traceback.print_exc(file=sys.stderr)
            self._store.notify("bad", message("notice.bug", error=f"{type(error).__name__}: {error}"))
        else:
            sentence = message("export.done" if is_sent else "export.unsent", file=file_name(run, ending), size=size)
            self._store.notify("good" if is_sent else "warn", sentence)
        finally:
            self._store.update(export=None)

    def _follow(self, ending: str) -> Callable[[float], None]:
        shown = 0.0

        def follow(share: float) -> None:
            nonlocal shown
            if self._cancelled.is_set():
                raise _CancelledError
            if share - shown >= _STEP:
                shown = share
                self._store.update(export=Export(ending, share))

        return follow


def file_name(run: Run, ending: str) -> str:
    """Returns the file name for the browser."""
    stamp = (
        time.strftime("%Y%m%d-%H%M%S", time.localtime(run.setup.started_ns * 1e-9)) if run.setup.started_ns else "run"
    )
    arm = "arm" if run.model is None else run.model.name
    return f"{arm}-{stamp}{ending}"
