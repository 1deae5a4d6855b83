"""The selected obstacle or frame of the cell: its numbers and choices; and what the tool holds, and the floor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.cell.cell_actions import FLOOR_FIELD, SetCell
from rcilab.app.cell.cell_edit import SIZE_FIELDS, obstacle_of, parent_of, read_field
from rcilab.app.cell.cell_state import Entry, entries_of, is_cell_pending, selected_entry
from rcilab.app.goal.goal import POSE_FIELDS
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.app.text import Text
from rcilab.cell.entries import WORLD
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, shown

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.cell.cell import Cell
    from rcilab.control_process import SupervisorStatus

_SIZES = tuple(dict.fromkeys(name for names in SIZE_FIELDS.values() for name in names))


class CellEntryPanel:
    """A group of the Cell tab, visible while an entry is selected."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._fields: dict[str, NumberField] = {}
        self._boxes: dict[str, Any] = {}
        self._head = gui.add_folder(text("cell.selected"), visible=False)
        with self._head:
            gui.add_html('<i class="rl-worded"></i>')
            self._field(gui, "name", None)
            frame = gui.add_dropdown(text("cell.frame"), (self._world(),), hint=text("cell.frame_hint"))
            self._frame = BoundControl(frame, ask, lambda v, p: SetCell(page=p, name="frame", value=self._frame_of(v)))
        self._pose = gui.add_folder(text("cell.pose"), visible=False)
        with self._pose:
            gui.add_html('<i class="rl-trios"></i>')
            for index, name in enumerate(POSE_FIELDS):
                self._field(gui, name, "mm" if index < 3 else "deg")
        self._size = gui.add_folder(text("cell.size"), visible=False)
        with self._size:
            gui.add_html('<i class="rl-trios"></i>')
            for name in _SIZES:
                self._field(gui, name, "mm")
        self._touch = gui.add_folder(text("cell.role"), visible=False)
        with self._touch:
            self._ticks = {
                name: BoundControl(
                    gui.add_checkbox(text(f"cell.tick.{name}"), False, hint=text(f"cell.tick_hint.{name}")),
                    ask,
                    _tick(name),
                )
                for name in ("tool", "part", "workpiece")
            }
        self._problems = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the selected entry."""
        cell, entry = state.cell.cell, selected_entry(state.cell)
        is_shown = cell is not None and entry is not None
        obstacle = None
        if cell is not None and entry is not None and entry.kind == "obstacle":
            obstacle = obstacle_of(cell, entry)
        sizes = () if obstacle is None else SIZE_FIELDS[type(obstacle.shape)]
        folders = (self._head, self._pose, self._size, self._touch)
        for folder, visible in zip(folders, (is_shown, is_shown, bool(sizes), bool(obstacle)), strict=True):
            if folder.visible != visible:
                folder.visible = visible
        if cell is None or entry is None:
            self._problems.show("")
            return
        index, labels = entries_of(cell).index(entry), []
        for name, field in self._fields.items():
            field.field = f"cell.{index}.{name}"
            value = entry.name if name == "name" else _number(cell, entry, name)
            self._boxes[name].visible = value is not None
            field.show(value or "", state.problems.get(field.field), state.entered)
            labels.append((field.field, self._label(name)))
        self._show_frame(cell, entry)
        if obstacle is not None:
            for name in ("tool", "part"):
                self._ticks[name].show(name in obstacle.may_touch)
            self._ticks["workpiece"].show(cell.workpiece == entry.name)
        self._problems.show(problems_html(state, self._text, labels))

    def _show_frame(self, cell: Cell, entry: Entry) -> None:
        others = tuple(frame.name for frame in cell.frames if frame.name != entry.name or entry.kind == "obstacle")
        options, parent = (self._world(), *others), parent_of(cell, entry)
        label = self._world() if parent == WORLD else parent
        if self._frame.handle.options != options:
            self._frame.exchange(options, label)
        self._frame.show(label)

    def _field(self, gui: Any, name: str, unit: str | None) -> None:
        box = gui.add_text(self._label(name), "", hint=self._text("target.type_hint" if unit else "cell.name_hint"))
        self._boxes[name] = box
        self._fields[name] = NumberField(box, self._ask, f"cell.0.{name}", self._text.unit(unit) if unit else None)

    def _label(self, name: str) -> str:
        return self._text(f"target.{name}" if name in POSE_FIELDS else f"cell.field.{name}")

    def _world(self) -> str:
        return self._text("cell.world")

    def _frame_of(self, label: str) -> str:
        return WORLD if label == self._world() else label


class CellRestPanel:
    """What the tool holds, and the floor."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        self._nothing = text("cell.nothing")
        with gui.add_folder(text("cell.rest")):
            held = gui.add_dropdown(text("cell.held"), (self._nothing,), hint=text("cell.held_hint"))
            self._held = BoundControl(held, ask, lambda v, p: SetCell(page=p, name="held", value=self._part_of(v)))
            has_floor = gui.add_checkbox(text("cell.has_floor"), True, hint=text("cell.floor_hint"))
            self._has_floor = BoundControl(has_floor, ask, _tick("floor"))
            self._box = gui.add_text(text("cell.floor"), "", hint=text("cell.floor_hint"))
            self._floor = NumberField(self._box, ask, FLOOR_FIELD, text.unit("mm"))
            self._problems = Html(gui)
            self._note = Html(gui)
            self._start = gui.add_button(
                text("cell.start"), icon="refresh", hint=text("cell.start_hint"), visible=False
            )
            on_press(self._start, ask, lambda page: ChooseRobot(page=page, plant="mujoco"))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the cell."""
        text, cell = self._text, state.cell.cell
        for control in (self._held.handle, self._has_floor.handle, self._box):
            control.disabled = cell is None
        options = (self._nothing, *(() if cell is None else (part.name for part in cell.parts)))
        label = self._nothing if cell is None or not cell.held else cell.held
        if self._held.handle.options != options:
            self._held.exchange(options, label)
        self._held.show(label)
        height = None if cell is None else cell.floor_height
        self._has_floor.show(cell is None or height is not None)
        self._box.visible = cell is not None and height is not None
        problem = state.problems.get(FLOOR_FIELD)
        self._floor.show(shown(1000.0 * (height or 0.0)), problem, state.entered)
        self._problems.show(problems_html(state, text, [(FLOOR_FIELD, text("cell.floor"))]))
        tool = None if cell is None else cell.tool
        sentence = text("cell.no_tool") if tool is None else text("cell.tool_is", name=tool.name)
        is_pending = is_cell_pending(state)
        if self._start.visible != is_pending:
            self._start.visible = is_pending
        self._start.disabled = is_moving(status)
        is_ideal = cell is not None and state.is_virtual and state.plant == "ideal"
        words = (sentence, text("cell.pending") if is_pending else text("cell.ideal") if is_ideal else "")
        self._note.show("".join(f'<p class="rl-note">{esc(one)}</p>' for one in words if one))

    def _part_of(self, label: str) -> str:
        return "" if label == self._nothing else label


def _number(cell: Cell, entry: Entry, name: str) -> str | None:
    number = read_field(cell, entry, name)
    return None if number is None else shown(number)


def _tick(name: Any):  # type: ignore[no-untyped-def]
    return lambda value, page: SetCell(page=page, name=name, value=bool(value))
