"""Requests that edit, load and show the cell. Owned by the dispatcher's thread."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from rcilab.app.cell.cell_edit import (
    FARTHEST,
    NewKind,
    added,
    attached,
    copied,
    moved_in_base,
    obstacle_of,
    read_field,
    removed,
    renamed,
    with_field,
    with_shape,
)
from rcilab.app.cell.cell_state import CellState, Entry, entries_of, selected_entry
from rcilab.app.goal.goal import POSE_FIELDS
from rcilab.app.request import Handlers, Request, TypeField
from rcilab.app.setup.setup_actions import SetupActions
from rcilab.app.state_store import UNDO_DEPTH
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.app.text import Text
from rcilab.cell.cell import Cell
from rcilab.cell.cell_storage import read_uploaded
from rcilab.cell.convex_parts import has_meshes, prepare_meshes
from rcilab.cell.entries import WORLD, Obstacle
from rcilab.cell.mesh_file import read_mesh
from rcilab.cell.shapes import MeshShape
from rcilab.core.background_job import BackgroundJob
from rcilab.core.errors import RcilabError
from rcilab.core.spatial import Pose
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.number_parsing import parse_number
from rcilab.i18n.translator import Message, message
from rcilab.model.robot_model import RobotModel

FILE_FIELD = "cell.file"
"""Field of the problem of a file that was not loaded."""
FLOOR_FIELD = "cell.floor"
_TOO_FAR = 10.0  # [m] A mesh that reaches farther is in millimetres.
_THOUSANDTH = 1e-3
_LONGEST_NAME = 60  # [characters]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadCell(Request):
    """A file with a cell was chosen in the browser."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class AddMesh(Request):
    """A file with a mesh was chosen in the browser: it becomes an obstacle."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class EditCell(Request):
    """A button of the Cell tab."""

    what: Literal["add", "example", "duplicate", "delete", "undo", "redo", "clear"]
    name: str = ""
    """What is added, see `NewKind`; the name of an example."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectEntry(Request):
    """An entry of the list, or an obstacle in the scene, was clicked."""

    index: int | None
    """In the order of `entries_of`; None: no entry."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveEntry(Request):
    """The handle of an entry was moved."""

    index: int
    position: tuple[float, ...]
    """In base, [m]."""
    wxyz: tuple[float, ...]
    ended: bool = False
    """Whether the mouse was released."""

    @property
    def replaces(self) -> str | None:  # noqa: D102
        return None if self.ended else f"MoveEntry.{self.page}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SetCell(Request):
    """A choice of the Cell tab: frame of the selected entry, what may touch it, workpiece, held part, floor."""

    name: Literal["frame", "tool", "part", "workpiece", "held", "floor"]
    value: str | bool


@dataclass
class _History:
    """The cell of one arm, with its undo history."""

    cell: Cell | None = None
    past: list[Cell | None] = field(default_factory=list)
    future: list[Cell | None] = field(default_factory=list)


class CellActions:
    """Edits of the cell, one for each arm.

    Args:
        store: The state.
        setup: Gets tool and load of a cell that is loaded.
    """

    def __init__(self, store: Store, setup: SetupActions) -> None:
        self._store, self._setup = store, setup
        self._arm = store.state.model.name
        self._histories: dict[str, _History] = {self._arm: _History()}
        self._preparation: BackgroundJob[Callable[[], None], None] = BackgroundJob("cell")
        self._drag: tuple[object, ...] | None = None

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            LoadCell: self.load,
            AddMesh: self.add_mesh,
            EditCell: self.edit,
            SelectEntry: self.select,
            MoveEntry: self.move,
            SetCell: self.set_cell,
        }

    def load(self, request: LoadCell) -> None:
        """Loads a cell from a file; undo restores the previous one."""
        name = request.name[-_LONGEST_NAME:] or "cell"
        try:
            cell = read_uploaded(request.content, name, Cell)
        except RcilabError as error:
            self._store.set_problem(FILE_FIELD, message("cell.file_bad", error=describe_error(error)))
            return
        model = self._store.state.model.name
        if cell.model != model:
            other = message("cell.file_other", file=name, theirs=cell.model, ours=model)
            self._store.set_problem(FILE_FIELD, other)
            return
        sentence = message("cell.loaded", name=name, count=len(cell.obstacles))
        self._when_prepared(cell, lambda: self.take(cell, sentence))

    def add_mesh(self, request: AddMesh) -> None:
        """Adds an obstacle from a file with a mesh."""
        name = request.name[-_LONGEST_NAME:]
        try:
            shape = _read_mesh(request.content, name)
        except RcilabError as error:
            self._store.set_problem(FILE_FIELD, message("cell.file_bad", error=describe_error(error)))
            return
        if shape.scale != 1.0:
            self._store.notify("good", message("cell.scaled", name=name))
        self._store.clear_problems(FILE_FIELD)
        stem = Path(name).stem or name
        alone = Cell(model=self._arm, obstacles=(Obstacle(name=stem, shape=shape),))
        self._when_prepared(alone, lambda: self._place(lambda cell: with_shape(cell, stem, shape)))

    def edit(self, request: EditCell) -> None:
        """Handles a button."""
        state = self._store.state
        entry = selected_entry(state.cell)
        self._store.clear_problems(FILE_FIELD)
        if request.what == "add" and request.name in get_args(NewKind):
            name = Text(state.language)(f"cell.kind.{request.name}")
            self._place(lambda cell: added(cell, request.name, name))  # type: ignore[arg-type]  # As just checked.
        elif request.what == "example":
            self._example(request.name)
        elif request.what == "duplicate" and entry is not None:
            self._place(lambda cell: copied(cell, entry))
        elif request.what == "delete" and entry is not None and state.cell.cell is not None:
            self._apply(removed(state.cell.cell, entry))
        elif request.what == "clear" and state.cell.cell is not None:
            self._change(None)
        elif request.what in ("undo", "redo"):
            self._turn_back(request.what)

    def select(self, request: SelectEntry) -> None:
        """Selects an entry, whose handles the scene then shows; not while clicks draw a path."""
        if self._store.state.paths.drawing is not None:
            return
        entries = entries_of(self._store.state.cell.cell)
        known = request.index is not None and 0 <= request.index < len(entries)
        self._set(selected=entries[request.index] if known and request.index is not None else None)

    def deselect(self) -> None:
        """Hides the handles: another tab is open."""
        if self._store.state.cell.selected is not None:
            self._set(selected=None)

    def move(self, request: MoveEntry) -> None:
        """Moves an entry with its handle; a drag is one step for undo."""
        cell, entry = self._store.state.cell.cell, self._entry(request.index)
        numbers = (*request.position, *request.wxyz)
        if cell is None or entry is None or len(numbers) != 7 or not all(map(math.isfinite, numbers)):
            return
        if math.hypot(*request.wxyz) < 1e-6:
            return
        position = [min(max(number, -FARTHEST), FARTHEST) for number in request.position]
        self._store.clear_problems(f"cell.{request.index}.")
        self._change(moved_in_base(cell, entry, Pose(position, request.wxyz)), (request.page, entry), request.ended)

    def set_cell(self, request: SetCell) -> None:
        """Takes a choice; invalid ones are ignored."""
        state, value = self._store.state, request.value
        cell, entry = state.cell.cell, selected_entry(state.cell)
        if cell is None:
            return
        if request.name == "held" and value in ("", *(part.name for part in cell.parts)):
            self._hold(cell, str(value))
        elif request.name == "floor" and isinstance(value, bool):
            self._change(replace(cell, floor=float(cell.T_world_base.position[2]) if value else None))
        elif entry is None:
            return
        elif request.name == "frame" and value in (WORLD, *(frame.name for frame in cell.frames)):
            self._apply(attached(cell, entry, str(value)))
        elif entry.kind == "obstacle" and isinstance(value, bool):
            obstacle = obstacle_of(cell, entry)
            if request.name == "workpiece":
                self._change(replace(cell, workpiece=entry.name if value else ""))
            elif request.name in ("tool", "part"):
                others = tuple(one for one in obstacle.may_touch if one != request.name)
                may_touch = (*others, request.name) if value else others
                self._change(cell.placed(replace(obstacle, may_touch=may_touch)))

    def type_field(self, request: TypeField) -> None:
        """Takes a typed number or name, cell.INDEX.NAME or cell.floor, or shows the problem next to its field."""
        cell = self._store.state.cell.cell
        _, index, name = (*request.field.split("."), "", "")[:3]
        if cell is None:
            return
        if request.field == FLOOR_FIELD:
            self._type_number(request, -1000.0 * FARTHEST, 1000.0 * FARTHEST, "mm", lambda z: _with_floor(cell, z))
            return
        entry = self._entry(int(index)) if index.isdecimal() else None
        if entry is None:
            return
        if name == "name":
            self._type_name(cell, entry, request)
        elif read_field(cell, entry, name) is not None:
            is_angle, is_place = name in POSE_FIELDS[3:], name in POSE_FIELDS[:3]
            high = 360.0 if is_angle else 1000.0 * FARTHEST
            low = -high if is_angle or is_place else 1.0
            change = partial(with_field, cell, entry, name)
            self._type_number(request, low, high, "deg" if is_angle else "mm", change)

    def take(self, cell: Cell, sentence: Message) -> None:
        """Takes a loaded cell, and its tool and load for the arm; undo restores the previous one."""
        model = self._store.state.model
        if not self._mount(cell, model):
            return
        self._store.clear_problems("cell.")
        self._change(cell)
        self._set(selected=None)
        self._store.notify("good", sentence)

    def restore(self, cell: Cell) -> None:
        """Restores a cell of the previous workbench, of any arm."""
        self._histories[cell.model] = _History(cell)
        if cell.model == self._arm:
            self._set(cell=cell)

    def close(self) -> None:
        """Drops what is being prepared."""
        self._preparation.cancel()

    def tick(self) -> None:
        """Follows the choice of another arm, and the preparation of meshes."""
        if self._preparation.is_done:
            self._store.update(busy=None)
            act, result = self._preparation.pop_result()
            if isinstance(result, RcilabError):
                self._store.notify("bad", explain_error(result))
            else:
                act()
        name = self._store.state.model.name
        if name == self._arm:
            return
        if self._preparation.progress is not None:
            self._preparation.cancel()
            self._store.update(busy=None)
        self._arm, self._drag = name, None
        history = self._histories.setdefault(name, _History())
        self._store.update(cell=CellState(cell=history.cell))
        self._set_history(history)

    @property
    def _history(self) -> _History:
        return self._histories[self._arm]

    def _entry(self, index: int) -> Entry | None:
        entries = entries_of(self._store.state.cell.cell)
        return entries[index] if 0 <= index < len(entries) else None

    def _set(self, **changes: object) -> None:
        self._store.update(cell=replace(self._store.state.cell, **changes))  # type: ignore[arg-type]  # By their names.

    def _set_history(self, history: _History) -> None:
        self._set(can_undo=bool(history.past), can_redo=bool(history.future))

    def _type_name(self, cell: Cell, entry: Entry, request: TypeField) -> None:
        name = request.text.strip()
        if not name or not name.isprintable() or len(name) > _LONGEST_NAME:
            self._store.set_problem(request.field, message("cell.no_name", longest=_LONGEST_NAME))
            return
        changed = renamed(cell, entry, name)
        if isinstance(changed, Message):
            self._store.set_problem(request.field, changed)
            return
        self._store.clear_problems(request.field)
        self._change(changed)
        self._set(selected=Entry(entry.kind, name))

    def _type_number(
        self, request: TypeField, low: float, high: float, unit: str, change: Callable[[float], Cell]
    ) -> None:
        parsed = parse_number(request.text, low, high, unit)
        if parsed.value is None:
            assert parsed.problem is not None
            self._store.set_problem(request.field, parsed.problem)
            return
        self._store.clear_problems(request.field)
        self._change(change(parsed.value))

    def _when_prepared(self, cell: Cell, act: Callable[[], None]) -> None:
        """Acts once the meshes of a cell can be checked: the convex parts of a new one take seconds."""
        if not has_meshes(cell):
            act()
            return
        self._preparation.start(act, lambda progress: prepare_meshes(cell))
        self._store.update(busy=message("cell.preparing"))

    def _example(self, name: str) -> None:
        """Loads a cell that comes with rcilab, for the chosen arm."""
        model = self._store.state.model
        try:
            cell = replace(Cell.example(name), model=model.name)
        except RcilabError as error:
            self._store.notify("warn", explain_error(error))
            return
        self.take(cell, message("cell.loaded", name=cell.name, count=len(cell.obstacles)))

    def _hold(self, cell: Cell, part: str) -> None:
        holding = cell.holding(part)
        if self._mount(holding, self._store.state.model):
            self._change(holding)

    def _mount(self, cell: Cell, model: RobotModel) -> bool:
        """Gives the arm tool and load of a cell, with the part that it holds; returns whether it can carry them."""
        try:
            loaded = cell.applied_to(model)
        except RcilabError as error:
            self._store.notify("bad", explain_error(error))
            return False
        self._setup.mount(loaded.T_flange_tool, loaded.load)
        return True

    def _place(self, add: Callable[[Cell], tuple[Cell, Entry]]) -> None:
        """Adds an entry, and selects it."""
        state = self._store.state
        try:
            cell, entry = add(state.cell.cell or Cell(model=state.model.name))
        except RcilabError as error:
            self._store.notify("warn", explain_error(error))
            return
        self._change(cell)
        self._set(selected=entry)

    def _apply(self, changed: Cell | Message) -> None:
        if isinstance(changed, Message):
            self._store.notify("warn", changed)
        else:
            self._change(changed)

    def _change(self, cell: Cell | None, drag: tuple[object, ...] | None = None, has_ended: bool = False) -> None:
        """Replaces the cell; the steps of one drag are one step for undo."""
        history = self._history
        if drag is None or drag != self._drag:
            history.past = [*history.past[-UNDO_DEPTH:], history.cell]
            self._store.order.add("cell", self._store.state.model.name)
        self._drag = None if has_ended else drag
        history.cell, history.future = cell, []
        self._set(cell=cell)
        self._set_history(history)

    def _turn_back(self, what: Literal["undo", "redo"]) -> None:
        history = self._history
        here, there = (history.past, history.future) if what == "undo" else (history.future, history.past)
        if not here:
            return
        there.append(history.cell)
        order, name = self._store.order, self._store.state.model.name
        order.undone("cell", name) if what == "undo" else order.repeated("cell", name)
        before, history.cell = history.cell, here.pop()
        self._drag = None
        self._store.clear_problems("cell.")
        self._set(cell=history.cell)
        self._set_history(history)
        cell = history.cell
        if cell is not None and (before is None or (cell.held, cell.tool) != (before.held, before.tool)):
            self._mount(cell, self._store.state.model)


def _read_mesh(content: bytes, name: str) -> MeshShape:
    """Returns a mesh in metres: one that would be too large is in millimetres."""
    shape = read_mesh(content, name, scale=_THOUSANDTH)
    is_small = float(np.abs(shape.vertices).max()) <= _THOUSANDTH * _TOO_FAR
    return read_mesh(content, name) if is_small else shape


def _with_floor(cell: Cell, height: float) -> Cell:
    """Returns the cell with its floor at a height in the base frame, [mm]."""
    return replace(cell, floor=float(cell.T_world_base.position[2]) + height / 1000.0)
