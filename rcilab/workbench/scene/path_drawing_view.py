"""A path that is drawn in the scene: clicks add points, which a line joins. Owned by the stage."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.program.path_actions import DrawPath
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.widgets import Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState
    from rcilab.cell.ray_cast import SurfacePoint

_NODE = "/drawn_path"
_COLOR = (11, 111, 194)
_THICK = 0.006  # [m]
_TICK = 0.04  # [m] Length of the line along the normal at each point.


class PathDrawingView:
    """Takes clicks while a path is drawn, and shows its points.

    Args:
        server: The page.
        drawing: Where to draw.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, drawing: ViserScene, ask: Ask) -> None:
        self._scene, self._drawing, self._ask = server.scene, drawing, ask
        self._points: tuple[SurfacePoint, ...] | None = None

    def show(self, state: UiState) -> None:
        """Follows the drawing."""
        points = state.paths.drawing
        if points is self._points:
            return
        if self._points is None:
            register: Any = self._scene.on_click()  # viser's types know no callbacks on its event loop.
            register(self._click)
        if self._points:
            self._drawing.remove(_NODE)
        self._points = points
        if points is None:
            self._scene.remove_click_callback(self._click)
        elif points:
            places = np.array([point.position for point in points])
            ticks = places + _TICK * np.array([point.normal for point in points])
            lines = [np.stack((places, ticks), axis=1), np.stack((places[:-1], places[1:]), axis=1)]
            self._drawing.add_segments(_NODE, np.concatenate(lines), color=_COLOR, thickness=_THICK)

    def remove(self) -> None:
        """Removes everything."""
        if self._points is not None:
            self._scene.remove_click_callback(self._click)
        if self._points:
            self._drawing.remove(_NODE)
        self._points = None

    async def _click(self, event: Any) -> None:
        eye, ray = (tuple(map(float, vector)) for vector in (event.ray_origin, event.ray_direction))
        self._ask(DrawPath(page=event.client_id, what="point", eye=eye, ray=ray))
