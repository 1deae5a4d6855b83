"""Link: copies an address that opens arm, cell and program of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.cell.cell_state import saved_cell
from rcilab.app.link.page_link import LONGEST_LINK, PageLink, encode_link
from rcilab.app.text import Text
from rcilab.cell.cell_storage import pack_cell
from rcilab.core.errors import InvalidValueError
from rcilab.views.viser_ext.message_guard import allow_spectators
from rcilab.workbench.page import send_link
from rcilab.workbench.widgets import Ask

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class LinkPanel:
    """A button; every page may use it."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text = text

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the button."""
        self._state = state
        with gui.add_folder(self._text("link.title")):
            gui.add_html('<i class="rl-buttons"></i>')
            button = gui.add_button(
                self._text("link.copy"), icon="link", color="gray", hint=self._text("link.copy_hint")
            )
            allow_spectators(button)
            button.on_click(self._copy)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the state."""
        self._state = state

    def _copy(self, event: Any) -> None:
        """Copies the link in the browser of the page that asked; offers the files if it would be too long."""
        if event.client is None:
            return
        link, text = _link_of(self._state), self._text
        try:
            fragment = encode_link(link)
        except InvalidValueError:
            fragment, sentence = "", text("link.mesh")
        else:
            sentence = text("link.copied")
            if len(fragment) > LONGEST_LINK:
                sentence = text("link.long", count=len(fragment), most=LONGEST_LINK)
                fragment = ""
        send_link(event.client, fragment, sentence, "good" if fragment else "warn")
        if fragment:
            return
        if link.program is not None:
            event.client.send_file_download("program.json", link.program.to_json().encode())
        if link.cell is not None:
            event.client.send_file_download("cell.zip", pack_cell(link.cell))


def _link_of(state: UiState) -> PageLink:
    """Returns what the page shows: arm, program and cell."""
    draft, cell = state.program.draft, state.cell.cell
    program = draft.program(state.model, box=state.setup.wanted.box) if draft.model == state.model.name else None
    return PageLink(
        model=state.model.name, program=program, cell=None if cell is None else saved_cell(cell, state.model)
    )  # fmt: skip
