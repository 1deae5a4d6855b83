"""Paths that become waypoints: how they are imported, and the one that is drawn in the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rcilab.cell.ray_cast import SurfacePoint
from rcilab.i18n.translator import Remark

if TYPE_CHECKING:
    from rcilab.app.store import UiState

PATH_FIELD = "path.file"
"""Name of a problem of a file in `UiState.problems`."""
BLEND_FIELD = "path.blend"
"""Name of the field of the blend radius in `TypeField`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PathState:
    """The state of the folder for paths in the Program tab."""

    appends: bool = False
    """Whether an imported path is added after the selected waypoint; else it replaces the program."""
    blend: float = 0.002
    """Radius of the corners of a new path, [m]."""
    notes: tuple[Remark, ...] = ()
    """What was ignored or changed in the last import."""
    drawing: tuple[SurfacePoint, ...] | None = None
    """The points that were clicked; None while nothing is drawn."""


def frame_of_paths(state: UiState) -> str | None:
    """Returns the frame for new waypoints of a path; None is base.

    That of the selected waypoint, else that of the cell's workpiece.
    """
    cell = state.cell.cell
    frames = () if cell is None else tuple(frame.name for frame in cell.frames)
    chosen = state.program.draft.waypoint(state.program.selected)
    if chosen is not None and chosen.frame in frames:
        return chosen.frame
    workpiece = None if cell is None else next((o for o in cell.obstacles if o.name == cell.workpiece), None)
    return workpiece.frame if workpiece is not None and workpiece.frame in frames else None
