"""Files of the Program tab: JSON to and from the browser, and the program as Python."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import LoadProgram
from rcilab.app.program.program_draft import FILE_FIELD
from rcilab.app.text import Text
from rcilab.motion.program import Program
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.widgets import Ask, Html, NumberField, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.program.program_draft import Draft
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.core.safety_box import SafetyBox
    from rcilab.model.robot_model import RobotModel


class ProgramFilePanel:
    """Name, load, save, new, "show as Python"."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._made_of: tuple[Draft, RobotModel, SafetyBox | None] | None = None
        self._program: Program | None = None
        self._script_text = ""

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("program.file")):
            gui.add_html('<i class="rl-buttons"></i>')
            load = gui.add_upload_button(
                text("program.load"), icon="upload", color="gray", mime_type=".json,application/json",
                hint=text("program.load_hint"),
            )  # fmt: skip

            @load.on_upload
            async def _(event: Any) -> None:
                file = event.target.value
                ask(LoadProgram(page=event.client_id, name=file.name, content=file.content))

            self._save = gui.add_button(
                text("program.save"), icon="download", color="gray", hint=text("program.save_hint")
            )
            self._save.on_click(lambda event: self._send(event, "json"))
            self._clear = gui.add_button(
                text("program.clear"), icon="file-plus", color="gray", hint=text("program.clear_hint")
            )
            on_press(self._clear, ask, lambda page: EditProgram(page=page, what="clear"))
            self._python = gui.add_button(
                text("program.script"), icon="brand-python", color="gray", hint=text("program.script_hint")
            )
            on_press(self._python, ask, lambda page: EditProgram(page=page, what="script"))
            self._problems = Html(gui)  # Beside the button that was pressed.
            self._name = NumberField(
                gui.add_text(text("program.name"), "", hint=text("program.name_hint")), ask, "program.0.name"
            )
            self._tool = gui.add_button(
                text("program.take_tool"), icon="tool", color="gray", hint=text("program.take_tool_hint"), visible=False
            )
            on_press(self._tool, ask, lambda page: EditProgram(page=page, what="tool"))
            self._script = Html(gui)
            self._fetch = gui.add_button(text("program.script_save"), icon="download", color="gray", visible=False)
            self._fetch.on_click(lambda event: self._send(event, "py"))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the program."""
        text, draft = self._text, state.program.draft
        box = state.setup.wanted.box
        if self._made_of != (draft, state.model, box):
            self._made_of, self._program = (draft, state.model, box), draft.program(state.model, box=box)
            self._script_text = ""
        there = self._program is not None and draft.model == state.model.name
        self._save.disabled = self._clear.disabled = not there
        self._python.disabled = not there
        self._tool.visible = there and (not draft.is_for(state.model) or draft.has_other_box(box))
        self._name.show(draft.name, state.problems.get(self._name.field), state.entered)
        labels = [(FILE_FIELD, text("program.load")), ("program.0.name", text("program.name"))]
        sentence = problems_html(state, text, labels)
        if FILE_FIELD in state.problems:
            sentence += f'<p class="rl-note">{esc(text("program.stays"))}</p>'
        self._problems.show(sentence)
        is_shown = there and state.program.is_script_shown
        self._python.label = text("program.script_hide" if is_shown else "program.script")
        self._fetch.visible = is_shown
        if not is_shown or self._program is None:
            self._script.show("")
            return
        self._script_text = self._script_text or self._program.to_python()
        self._script.show(
            f'<div class="rl-code"><button type="button" data-rl-copy data-done="{esc(text("program.copied"))}">'
            f'{esc(text("program.copy"))}</button><pre tabindex="0" aria-label="{esc(text("program.script_name"))}">'
            f"{esc(self._script_text)}</pre></div>"
        )

    def _send(self, event: Any, kind: str) -> None:
        """Makes the browser of the page that asked save the program, or its script."""
        program = self._program
        if program is None or event.client is None:
            return
        content = program.to_json() if kind == "json" else program.to_python()
        name = re.sub(r"[^\w-]+", "_", program.name).strip("_") or "program"
        event.client.send_file_download(f"{name}.{kind}", content.encode(), save_immediately=True)
