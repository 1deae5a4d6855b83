"""Recorded runs: their size on disk, and how to delete old ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.run.folder_actions import KEEPS, ClearRuns, megabytes
from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class RunsFolderPanel:
    """Size of the folder, "keep the newest N", and a question before anything is deleted."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._keep = KEEPS[0]

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("runs.title")):
            self._size = Html(gui)
            labels = {text("runs.keep_of", count=count) if count else text("runs.keep_none"): count for count in KEEPS}
            self._labels = {count: label for label, count in labels.items()}
            keep = gui.add_dropdown(text("runs.keep"), tuple(labels), initial_value=self._labels[state.folder.keep])
            self._choice = BoundControl(
                keep, ask, lambda v, p: ClearRuns(page=p, what="choose", keep=labels.get(v, -1))
            )
            self._clear = gui.add_button(text("runs.clear"), icon="trash", color="gray", hint=text("runs.clear_hint"))
            on_press(self._clear, ask, lambda page: ClearRuns(page=page, what="ask", keep=self._keep))
            self._question = Html(gui)
            self._yes = gui.add_button(text("runs.yes"), icon="trash", color="red", visible=False)
            on_press(self._yes, ask, lambda page: ClearRuns(page=page, what="confirm", keep=self._keep))
            self._no = gui.add_button(text("run.cancel"), color="gray", visible=False)
            on_press(self._no, ask, lambda page: ClearRuns(page=page, what="cancel", keep=self._keep))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the folder."""
        text, folder = self._text, state.folder
        self._keep = folder.keep
        sentence = text("runs.none")
        if state.runs is not None:
            sentence = text("runs.size", count=folder.count, size=megabytes(folder.size), folder=state.runs)
        self._size.show(f'<p class="rl-note rl-path">{esc(sentence)}</p>')
        self._choice.show(self._labels[folder.keep])
        self._clear.disabled = state.runs is None or folder.count <= folder.keep
        self._yes.visible = self._no.visible = folder.asked
        gone = max(folder.count - folder.keep, 0)
        asked = f'<p class="rl-verdict rl-warn" role="alert">{esc(text("runs.ask", count=gone))}</p>'
        self._question.show(asked if folder.asked else "")
