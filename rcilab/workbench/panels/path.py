"""Paths as waypoints, in the Program tab: import of a file, and drawing by clicks in the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.program.path_actions import DrawPath, ImportPath, SetPath
from rcilab.app.program.path_state import BLEND_FIELD, PATH_FIELD, frame_of_paths
from rcilab.app.text import Text
from rcilab.i18n.error_messages import describe_note
from rcilab.motion.path_import import PATH_SUFFIXES
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, shown

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class PathPanel:
    """Import of a path, drawing of a path, and the blend radius of both."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("path.title")):
            gui.add_html('<i class="rl-buttons"></i>')
            load = gui.add_upload_button(
                text("path.import"), icon="upload", color="gray", mime_type=",".join(PATH_SUFFIXES),
                hint=text("path.import_hint"),
            )  # fmt: skip

            @load.on_upload
            async def _(event: Any) -> None:
                file = event.target.value
                ask(ImportPath(page=event.client_id, name=file.name, content=file.content))

            self._draw = gui.add_button(text("path.draw"), icon="pencil", color="gray", hint=text("path.draw_hint"))
            on_press(self._draw, ask, lambda page: DrawPath(page=page, what="toggle"))
            box = gui.add_checkbox(text("path.appends"), state.paths.appends, hint=text("path.appends_hint"))
            self._appends = BoundControl(box, ask, lambda value, page: SetPath(page=page, appends=bool(value)))
            field = gui.add_text(text("program.field.blend"), "", hint=text("path.blend_hint"))
            self._blend = NumberField(field, ask, BLEND_FIELD, text.unit("mm"))
            self._note = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the drawing, and the last import."""
        text, paths = self._text, state.paths
        is_drawing = paths.drawing is not None
        label = text("path.end" if is_drawing else "path.draw")
        if self._draw.label != label:
            self._draw.label = label
        self._appends.show(paths.appends)
        self._blend.show(shown(1000.0 * paths.blend), state.problems.get(BLEND_FIELD), state.entered)
        labels = [(PATH_FIELD, text("path.import")), (BLEND_FIELD, text("program.field.blend"))]
        sentence = problems_html(state, text, labels)
        if PATH_FIELD in state.problems:
            sentence += f'<p class="rl-note">{esc(text("program.stays"))}</p>'
        frame = frame_of_paths(state)
        where = text("path.base") if frame is None else text("path.frame", frame=frame)
        if paths.drawing is not None:
            sentence += f'<p class="rl-note">{esc(text("path.drawing", count=len(paths.drawing), frame=where))}</p>'
        notes = "".join(f"<li>{esc(text.render(describe_note(note)))}</li>" for note in paths.notes)
        if notes:
            sentence += f'<details class="rl-noted"><summary>{esc(text("path.noted", count=len(paths.notes)))}'
            sentence += f"</summary><ul>{notes}</ul></details>"
        self._note.show(sentence)
