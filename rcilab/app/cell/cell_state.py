"""The cell on the page: what is edited, and the cell that plans are checked in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

from rcilab.cell.cell import Cell
from rcilab.cell.tool import Tool
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import NO_LOAD
from rcilab.model.robot_model import RobotModel

if TYPE_CHECKING:
    from rcilab.app.store import UiState

EntryKind = Literal["obstacle", "frame"]


@dataclass(frozen=True, slots=True)
class Entry:
    """An obstacle or a frame of the cell."""

    kind: EntryKind
    name: str


@dataclass(frozen=True, eq=False, kw_only=True)
class CellState:
    """The state of the Cell tab."""

    cell: Cell | None = None
    """None before anything was placed or loaded."""
    selected: Entry | None = None
    """The entry with handles in the scene."""
    can_undo: bool = False
    can_redo: bool = False


def entries_of(cell: Cell | None) -> tuple[Entry, ...]:
    """Returns the entries in the order of the list: obstacles, then frames."""
    if cell is None:
        return ()
    obstacles = tuple(Entry("obstacle", obstacle.name) for obstacle in cell.obstacles)
    return (*obstacles, *(Entry("frame", frame.name) for frame in cell.frames))


def selected_entry(state: CellState) -> Entry | None:
    """Returns the selected entry, if the cell still has it."""
    return state.selected if state.selected in entries_of(state.cell) else None


@lru_cache(maxsize=8)
def checked_cell(cell: Cell, model: RobotModel) -> Cell:
    """Returns the cell with the tool frame and the load of a model; the same one for the same arguments.

    On the page, Setup has tool frame and load, and they include those of the held part.
    """
    if cell.tool is None and cell.part is None:
        return cell
    tool = replace(cell.tool or Tool(), T_flange_tool=model.T_flange_tool, payload=model.load)
    return replace(cell, tool=tool, parts=tuple(replace(part, payload=NO_LOAD) for part in cell.parts))


def solid_cell(state: UiState) -> Cell | None:
    """Returns the cell that a virtual controller starts with: that of the MuJoCo plant, which has contacts."""
    return state.cell_for(state.model) if state.target == "virtual" and state.plant == "mujoco" else None


def is_cell_pending(state: UiState) -> bool:
    """Returns whether the virtual controller was started with another cell."""
    return not state.watched and solid_cell(state) is not state.solid


def saved_cell(cell: Cell, model: RobotModel) -> Cell:
    """Returns the cell as it is saved: with the tool frame of a model, and its load if the tool holds nothing."""
    if cell.tool is None and model.T_flange_tool.is_close(Pose(), 0.0) and not model.load.mass:
        return cell
    tool = cell.tool or Tool()
    load = model.load if cell.part is None else tool.payload
    return replace(cell, tool=replace(tool, T_flange_tool=model.T_flange_tool, payload=load))
