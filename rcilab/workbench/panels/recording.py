"""Recording: the tracking error of the last run, and its exports."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcilab.app.learn.learn_state import displayed_state
from rcilab.app.run.export_actions import ENDINGS, CancelExport, ExportRun
from rcilab.app.run.replay_actions import CloseRun
from rcilab.app.text import Text
from rcilab.app.view_actions import SetRecording
from rcilab.core.fault import name_faults
from rcilab.recording.tracking_text import error_rows, tracking_notes
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, esc_names, on_press

if TYPE_CHECKING:
    from rcilab.app.run.recording import Recording
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_ICONS: dict[str, Any] = {
    ".csv": "file-spreadsheet",
    ".parquet": "table",
    ".mcap": "chart-line",
    ".html": "world",
    ".rcirun": "device-floppy",
}


class RecordingPanel:
    """The last run in numbers, and its exports."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._drawn: Recording | None = None

    def build(self, gui: Any, state: UiState) -> None:
        """Adds table, buttons and the check box."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("record.title"), expand_by_default=False):
            gui.add_html('<i class="rl-exports"></i>')
            self._summary = Html(gui)
            self._buttons: dict[str, Any] = {}
            for ending in ENDINGS:
                kind = ending[1:]
                button = gui.add_button(
                    text(f"export.{kind}"), icon=_ICONS[ending], color="gray", hint=text(f"export.{kind}_hint")
                )
                on_press(button, ask, _export(ending))
                self._buttons[ending] = button
            self._progress = Html(gui)
            self._cancel = gui.add_button(text("export.cancel"), icon="x", color="gray", visible=False)
            on_press(self._cancel, ask, lambda page: CancelExport(page=page))
            box = gui.add_checkbox(text("record.every"), state.record, hint=text("record.every_hint"))
            self._record = BoundControl(box, ask, lambda v, p: SetRecording(page=p, on=bool(v)))
            self._where = Html(gui)
            self._runs = Html(gui)
            self._back = gui.add_button(text("replay.back"), icon="arrow-back-up", visible=False)
            on_press(self._back, ask, lambda page: CloseRun(page=page))
        self._drawn = None
        self._summary.show(f'<p class="rl-note">{esc(text("record.nothing"))}</p>')

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the recording and the export in progress."""
        self._runs.show(runs_html(state, self._text))
        self._back.visible = state.replay is not None
        state = displayed_state(state)
        text, export = self._text, state.export
        recording = state.recording if state.recording is not None else state.last_run
        if recording is not self._drawn:
            self._drawn = recording
            self._summary.show(summary_html(recording, text))
        for button in self._buttons.values():
            button.disabled = state.last_run is None or export is not None
        self._progress.show("" if export is None else progress_html(export.ending, export.share, text))
        self._cancel.visible = export is not None
        self._record.handle.disabled = state.runs is None
        self._record.show(state.record and state.runs is not None)
        is_written = state.runs is not None and state.record
        where = text("record.folder", folder=state.runs) if is_written else text("record.memory")
        if recording is not None and recording.file:
            where = text("record.file", file=recording.file)
        self._where.show(f'<p class="rl-note rl-path">{esc(where)}</p>')


def summary_html(recording: Recording | None, text: Text) -> str:
    """Returns the tracking errors of joints and tool: RMS and largest, as a table, and what they compare."""
    if recording is None:
        return f'<p class="rl-note">{esc(text("record.nothing"))}</p>'
    run, tracking = recording.run, recording.tracking
    if run is None or tracking is None:
        return f'<p class="rl-note">{esc(text("record.running", cycles=len(recording.t)))}</p>'
    head = (text("record.error"), text("tracking.rms"), text("tracking.max"))
    rows = "".join(
        f"<tr><td>{esc(name)}</td><td>{a}</td><td>{b}</td></tr>" for name, a, b in error_rows(run, tracking, text)
    )
    table = f'<table class="rl-table"><tr>{"".join(f"<th>{esc(title)}</th>" for title in head)}</tr>{rows}</table>'
    return table + "".join(f'<p class="rl-note">{esc(note)}</p>' for note in tracking_notes(run, tracking, text))


def runs_html(state: UiState, text: Text) -> str:
    """Returns the list of the newest recorded runs, newest first: arm, start, end and duration; "" without one."""
    runs = state.folder.runs
    if not runs:
        return ""
    opened = None if state.replay is None else Path(state.replay.recording.file).name
    chosen = next((index for index, run in enumerate(runs) if run.name == opened), None)
    rows: list[str] = []
    for index, run in enumerate(runs):
        start = time.localtime(run.started_ns * 1e-9)
        when = time.strftime("%m-%d %H:%M:%S", start) if run.started_ns else "—"
        ended = name_faults(run.faults) or text(f"replay.{run.ended}")
        tone = ' class="rl-fails"' if run.ended == "fault" else ""
        rows.append(
            f'<div class="rl-entry rl-run" role="option" tabindex="{0 if index == (chosen or 0) else -1}" '
            f'data-run="{esc(run.name)}" aria-selected="{str(index == chosen).lower()}" title="{esc(run.name)}">'
            f"<span>{esc(when)}</span><span>{esc(run.model)} · <i{tone}>{esc_names(ended)}</i></span>"
            f"<span>{run.duration:.1f} s</span></div>"
        )
    label = esc(text("replay.list"))
    return (
        f'<p class="rl-rowname">{label}</p><div class="rl-branches rl-entries rl-pick" role="listbox" '
        f'aria-label="{label}">{"".join(rows)}</div>'
    )


def progress_html(ending: str, share: float, text: Text) -> str:
    """Returns a progress bar, with the progress as text."""
    percent = f"{100.0 * share:.0f}"
    sentence = esc(text("export.progress", kind=text(f"export.{ending[1:]}"), percent=percent))
    return (
        f'<p class="rl-note" role="status">{sentence}</p><div class="rl-meter"><i style="width:{percent}%"></i></div>'
    )


def _export(ending: str):  # type: ignore[no-untyped-def]
    return lambda page: ExportRun(page=page, ending=ending)
