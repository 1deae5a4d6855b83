"""Dragging the arm with the mouse: a drag on a link applies a force there; an arrow shows the force on the arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.run.active_force import SPRING, TOOL, can_grab
from rcilab.app.run.push_actions import DragLink
from rcilab.app.text import Text
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.widgets import Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_COLOR = (214, 66, 160)  # Magenta: not the colour of a verdict, an axis or a plan.


class DragHandle:
    """Owned by the stage, and created again with its arm.

    Args:
        server: The page.
        drawing: Drawing of the arm.
        arm: The live arm.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, drawing: ViserScene, arm: ArmView, ask: Ask) -> None:
        self._drawing, self._arm, self._ask = drawing, arm, ask
        self._is_on = False
        self._sentence = ""
        nowhere = np.zeros((1, 2, 3), dtype=np.float32)
        self._arrow: Any = server.scene.add_arrows(
            "/push", nowhere, _COLOR, shaft_radius=0.008, head_radius=0.022, head_length=0.05, visible=False
        )
        self._label: Any = server.scene.add_label(
            "/push_label", "", anchor="bottom-left", depth_test=False, font_screen_scale=1.0, visible=False
        )

    def show(self, state: UiState, status: SupervisorStatus, text: Text) -> None:
        """Makes the arm's meshes draggable or leaves them to the camera, and draws the current push."""
        wanted = can_grab(state, status)
        if wanted != self._is_on:
            self._is_on = wanted
            for mesh, link in self._arm.link_meshes.items():
                if wanted:
                    self._drawing.on_drag(mesh, self._drag_handler(link))
                else:
                    self._drawing.ignore_drag(mesh)
        acting = state.push.acting
        if self._arrow.visible != (acting is not None):
            self._arrow.visible = self._label.visible = acting is not None
        if acting is None:
            return
        end = acting.start + acting.force / SPRING
        self._arrow.points = np.array([[acting.start, end]], dtype=np.float32)
        self._label.position = end
        where = text("push.tool") if acting.link == TOOL else text("push.link", number=acting.link)
        sentence = text("push.label", newtons=f"{float(np.linalg.norm(acting.force)):.0f}", where=where)
        if sentence != self._sentence:
            self._sentence = sentence
            self._label.text = sentence

    def remove(self) -> None:
        """Removes the arrow; the arm's meshes are removed with the arm."""
        self._arrow.remove()
        self._label.remove()

    def _drag_handler(self, link: int) -> Any:
        async def act(event: Any) -> None:
            self._ask(
                DragLink(
                    page=event.client_id,
                    link=link,
                    grabbed=tuple(map(float, event.start_position)),
                    hand=tuple(map(float, event.end_position)),
                    phase=event.phase,
                )
            )

        return act
