"""Cell: the list of obstacles and frames, what adds and removes them, and the files."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, get_args

from rcilab.app.cell.cell_actions import FILE_FIELD, AddMesh, EditCell, LoadCell
from rcilab.app.cell.cell_edit import NewKind, obstacle_of
from rcilab.app.cell.cell_state import entries_of, saved_cell, selected_entry
from rcilab.app.text import Text
from rcilab.cell.cell_storage import pack_cell
from rcilab.cell.entries import WORLD
from rcilab.cell.shapes import shape_name
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.panels.target import planned_html
from rcilab.workbench.widgets import Ask, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.cell.cell_state import Entry
    from rcilab.app.store import UiState
    from rcilab.cell.cell import Cell
    from rcilab.control_process import SupervisorStatus

_ICONS = {"box": "box", "cylinder": "cylinder", "sphere": "circle", "plane": "wall", "frame": "axis-x"}
_TOOLS = (("duplicate", "copy"), ("delete", "trash"), ("undo", "arrow-back-up"), ("redo", "arrow-forward-up"))
_EXAMPLES = ("pick_place", "machine_tending", "polishing")


class CellPanel:
    """The list with its buttons, and the verdict on the plan in this cell."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._drawn: tuple[object, ...] = ()

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("cell.add")):
            gui.add_html('<i class="rl-trios rl-bare"></i>')
            for kind in get_args(NewKind):
                button = gui.add_button(
                    text(f"cell.kind.{kind}"), icon=_ICONS[kind], color="gray", hint=text(f"cell.add_hint.{kind}")
                )
                on_press(button, ask, _edit("add", kind))
            mesh = gui.add_upload_button(
                text("cell.kind.mesh"), icon="upload", color="gray", hint=text("cell.add_hint.mesh"),
                mime_type=".stl,.obj,.glb,.gltf,.ply",
            )  # fmt: skip

            @mesh.on_upload
            async def _(event: Any) -> None:
                file = event.target.value
                ask(AddMesh(page=event.client_id, name=file.name, content=file.content))

        self._list = Html(gui)
        with gui.add_folder(text("cell.tools")):
            gui.add_html('<i class="rl-tools rl-bare"></i>')
            self._tools: dict[str, Any] = {}
            for what, icon in _TOOLS:
                button = gui.add_button(text(f"program.{what}"), icon=icon, color="gray", hint=text(f"program.{what}"))
                on_press(button, ask, _edit(what))
                self._tools[what] = button
        self._verdict = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the cell."""
        shown = state.cell
        entry = selected_entry(shown)
        touched = touched_obstacle(state)
        drawn = (shown.cell, entry, touched)
        if drawn != self._drawn:
            self._drawn = drawn
            self._list.show(self._list_html(shown.cell, entry, touched))
        self._tools["duplicate"].disabled = self._tools["delete"].disabled = entry is None
        self._tools["undo"].disabled, self._tools["redo"].disabled = not shown.can_undo, not shown.can_redo
        problems = problems_html(state, self._text, [(FILE_FIELD, self._text("cell.file"))])
        self._verdict.show(problems + (planned_html(state, status, self._text) if state.plan is not None else ""))

    def _list_html(self, cell: Cell | None, selected: Entry | None, touched: str) -> str:
        text = self._text
        if cell is None or not entries_of(cell):
            return f'<div class="rl-steps-none"><b>{esc(text("cell.none"))}</b>{esc(text("cell.none_long"))}</div>'
        rows: list[str] = []
        for index, entry in enumerate(entries_of(cell)):
            if entry.kind == "frame":
                kind, frame = "frame", next(f.parent for f in cell.frames if f.name == entry.name)
            else:
                obstacle = obstacle_of(cell, entry)
                kind, frame = shape_name(obstacle.shape), obstacle.frame
            is_touched = entry.kind == "obstacle" and entry.name == touched
            sign = f'<em title="{esc(text("cell.touched"))}">!</em>' if is_touched else ""
            where = "" if frame == WORLD else text("cell.in_frame", frame=frame)
            is_first = entry == selected or (selected is None and index == 0)
            rows.append(
                f'<div class="rl-entry" role="option" tabindex="{0 if is_first else -1}" '
                f'data-entry="{index}" aria-selected="{str(entry == selected).lower()}">'
                f"<span>{esc(text(f'cell.kind.{kind}'))}</span><span>{esc(entry.name)}{sign}</span>"
                f"<span>{esc(where)}</span></div>"
            )
        label = esc(text("cell.list"))
        return f'<div class="rl-branches rl-entries rl-pick" role="listbox" aria-label="{label}">{"".join(rows)}</div>'


class CellFilePanel:
    """Files of cells, and the cells that come with rcilab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("cell.file")):
            gui.add_html('<i class="rl-buttons"></i>')
            load = gui.add_upload_button(
                text("program.load"), icon="upload", color="gray", mime_type=".json,.zip", hint=text("cell.load_hint")
            )

            @load.on_upload
            async def _(event: Any) -> None:
                file = event.target.value
                ask(LoadCell(page=event.client_id, name=file.name, content=file.content))

            self._save = gui.add_button(
                text("program.save"), icon="download", color="gray", hint=text("cell.save_hint")
            )
            self._save.on_click(self._send)
            self._clear = gui.add_button(
                text("program.clear"), icon="file-plus", color="gray", hint=text("cell.clear_hint")
            )
            on_press(self._clear, ask, _edit("clear"))
        with gui.add_folder(text("cell.examples")):
            gui.add_html('<i class="rl-buttons"></i>')
            for name in _EXAMPLES:
                button = gui.add_button(text(f"cell.example.{name}"), color="gray", hint=text("cell.example_hint"))
                on_press(button, ask, _edit("example", name))
        self._shown = state

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the cell."""
        self._shown = state
        self._save.disabled = self._clear.disabled = state.cell.cell is None

    def _send(self, event: Any) -> None:
        """Makes the browser of the page that asked save the cell."""
        cell = self._shown.cell.cell
        if cell is None or event.client is None:
            return
        name = re.sub(r"[^\w-]+", "_", cell.name).strip("_") or "cell"
        content = pack_cell(saved_cell(cell, self._shown.model))
        event.client.send_file_download(f"{name}.zip", content, save_immediately=True)


def touched_obstacle(state: UiState) -> str:
    """Returns the name of the obstacle that the plan touches or comes too near to; "" for none."""
    if state.plan is None:
        return ""
    found = (v.links for v in state.plan.report.violations if v.condition.id == "clearance.cell")
    return next((links.obstacle for links in found if links is not None), "")


def _edit(what: Any, name: str = ""):  # type: ignore[no-untyped-def]
    return lambda page: EditCell(page=page, what=what, name=name)
