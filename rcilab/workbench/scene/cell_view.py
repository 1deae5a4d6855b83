"""The cell in the scene of the page: its solids, the handles of the selected entry, and the names of frames."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.cell.cell_actions import MoveEntry, SelectEntry
from rcilab.app.cell.cell_edit import base_pose_of
from rcilab.app.cell.cell_state import Entry, entries_of, selected_entry
from rcilab.app.text import Text
from rcilab.views.cell_view import TOUCHED_COLOR, CellView
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.panels.cell import touched_obstacle
from rcilab.workbench.widgets import FAINT, HAND_AWAY, Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState
    from rcilab.cell.cell import Cell
    from rcilab.cell.cell_geometry import ClosestPoints

_LINE = "/cell_line"
_SCALE = 0.2  # [m] Of the handles.


class CellSceneView:
    """Owned by the stage, and created again with its arm.

    Args:
        server: The page.
        drawing: Where to draw.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, drawing: ViserScene, ask: Ask) -> None:
        self._server, self._drawing, self._ask = server, drawing, ask
        self._view = CellView(drawing)
        self._drawn: tuple[Cell | None, str] = (None, "")
        self._clickable: list[object] = []  # The shape of each obstacle whose mesh can be clicked.
        self._names: list[Any] = []
        self._closest: ClosestPoints | None = None
        self._distance: Any = None
        self._gizmo: Any = None
        self._name: Any = None  # Of what has handles.
        self._edited: Entry | None = None
        self._touched = float("-inf")

    @property
    def handles(self) -> tuple[str, ...]:
        """The nodes that can be dragged now."""
        return () if self._gizmo is None else (self._gizmo.name,)

    def show(self, state: UiState, text: Text) -> None:
        """Draws what has changed."""
        self._show_distance(state.scene.closest, text)
        cell = state.cell.cell
        drawn = (cell, touched_obstacle(state))
        if drawn[0] is not self._drawn[0] or drawn[1] != self._drawn[1]:
            self._drawn = drawn
            self._view.show(*drawn)
            self._make_clickable(cell)
            self._name_frames(cell)
        entry = selected_entry(state.cell)
        if entry != self._edited:
            self._exchange_handles(cell, entry)
        self._follow(cell, entry)
        if entry is not None:
            sentence = text("setup.handles", part=entry.name)
            if sentence != self._name.text:
                self._name.text = sentence

    def remove(self) -> None:
        """Removes everything."""
        self._exchange_handles(None, None)
        self._name_frames(None)
        self._show_distance(None, None)
        self._view.remove()

    def _show_distance(self, closest: ClosestPoints | None, text: Text | None) -> None:
        """Draws the shortest line between arm and obstacle, with its length."""
        if closest is self._closest:
            return
        if self._closest is not None:
            self._drawing.remove(_LINE)
            self._distance.remove()
        self._closest = closest
        if closest is None or text is None:
            return
        self._drawing.add_polyline(_LINE, closest.points, color=TOUCHED_COLOR, thickness=0.012)
        length = text.units.format(max(closest.distance, 0.0), "m.0f")
        self._distance = self._server.scene.add_label(
            "/cell_distance", length, position=closest.points.mean(axis=0), anchor="bottom-left",
            depth_test=False, font_screen_scale=0.9,
        )  # fmt: skip

    def _make_clickable(self, cell: Cell | None) -> None:
        shapes = [] if cell is None else [obstacle.shape for obstacle in cell.obstacles]
        for index, shape in enumerate(shapes):
            if index >= len(self._clickable) or self._clickable[index] != shape:
                self._drawing.on_click(self._view.obstacle_node(index), self._click_handler(index))
        self._clickable = list(shapes)

    def _click_handler(self, index: int) -> Any:
        async def act(event: Any) -> None:
            self._ask(SelectEntry(page=event.client_id, index=index))

        return act

    def _name_frames(self, cell: Cell | None) -> None:
        frames = () if cell is None else cell.frames
        for label in self._names[len(frames) :]:
            label.remove()
        del self._names[len(frames) :]
        for index, frame in enumerate(frames):
            assert cell is not None
            position = cell.T_base(frame.name).position
            if index >= len(self._names):
                self._names.append(
                    self._server.scene.add_label(
                        f"/cell_name{index}", frame.name, position=position, anchor="top-left",
                        depth_test=False, font_screen_scale=0.85,
                    )
                )  # fmt: skip
                continue
            label = self._names[index]
            if label.text != frame.name:
                label.text = frame.name
            if np.abs(np.asarray(label.position) - position).max() > 1e-6:
                label.position = position

    def _exchange_handles(self, cell: Cell | None, entry: Entry | None) -> None:
        if self._gizmo is not None:
            self._gizmo.remove()  # With its name.
            self._gizmo = self._name = None
        self._edited = entry
        if cell is None or entry is None:
            return
        pose, index = base_pose_of(cell, entry), entries_of(cell).index(entry)
        self._gizmo = self._server.scene.add_transform_controls(
            "/cell_handles", scale=_SCALE, line_width=3.0, depth_test=False, opacity=FAINT, wxyz=pose.wxyz,
            position=pose.position,
        )  # fmt: skip
        self._name = self._server.scene.add_label(
            "/cell_handles/name", "", position=(0.0, 0.0, 1.15 * _SCALE), anchor="bottom-center", depth_test=False,
            font_screen_scale=1.0,
        )  # fmt: skip

        @self._gizmo.on_update
        async def _(event: Any) -> None:
            self._touched = time.monotonic()
            self._ask(
                MoveEntry(
                    page=event.client_id,
                    index=index,
                    position=tuple(map(float, event.target.position)),
                    wxyz=tuple(map(float, event.target.wxyz)),
                    ended=event.phase == "end",
                )
            )

    def _follow(self, cell: Cell | None, entry: Entry | None) -> None:
        """Moves the handles to the entry, unless they are being dragged."""
        if self._gizmo is None or cell is None or entry is None or time.monotonic() - self._touched < HAND_AWAY:
            return
        pose = base_pose_of(cell, entry)
        if np.abs(np.asarray(self._gizmo.position) - pose.position).max() > 1e-7:
            self._gizmo.position = pose.position
        if 1.0 - abs(float(np.asarray(self._gizmo.wxyz) @ pose.wxyz)) > 1e-12:
            self._gizmo.wxyz = pose.wxyz
