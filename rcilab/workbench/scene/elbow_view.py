"""The elbow circle in the scene, and the handle on it."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from rcilab.app.goal.elbow import Elbow
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.scene.scene_actions import DragElbow
from rcilab.app.text import Text
from rcilab.robots.mesh import revolve
from rcilab.views.elbow_view import OUTWARD, ElbowView
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.widgets import HAND_AWAY, Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_HANDLE = "/elbow/handle"
_RADIUS = 0.034  # [m]
_COLOR, _SNAPPED_COLOR = (18, 120, 108), (214, 48, 38)


class ElbowSceneView:
    """Owned by the stage, and created again with its arm.

    Args:
        server: The page.
        drawing: Drawing of the arm.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, drawing: ViserScene, ask: Ask) -> None:
        self._drawing, self._ask = drawing, ask
        self._view = ElbowView(drawing)
        self._drawn: Elbow | None = None
        self._is_red = False
        self._touched = float("-inf")
        steps = [math.pi * (step / 12.0 - 0.5) for step in range(13)]
        profile = [(max(_RADIUS * math.cos(a), 0.0), _RADIUS * math.sin(a)) for a in steps]
        ball = revolve(profile, segments=24)
        drawing.add_mesh(_HANDLE, ball.vertices, ball.faces, color=_COLOR)
        drawing.on_drag(_HANDLE, self._on_drag)
        self._label: Any = server.scene.add_label(
            "/elbow_label", "", anchor="bottom-center", depth_test=False, font_screen_scale=1.0, visible=False
        )

    @property
    def is_held(self) -> bool:
        """Whether the elbow is being dragged, or has just been."""
        return time.monotonic() - self._touched <= HAND_AWAY

    @property
    def handles(self) -> tuple[str, ...]:
        """The nodes that can be dragged now."""
        return (_HANDLE,) if self._drawn is not None else ()

    def show(self, state: UiState, status: SupervisorStatus, text: Text) -> None:
        """Draws the circle of the goal; not while the arm moves."""
        elbow = state.scene.elbow if "elbow" in state.scene.extras and not is_moving(status) else None
        if elbow is None:
            self._view.set_visible(False)
            self._drawn = None
        elif elbow is not self._drawn:
            self._drawn = elbow
            self._view.show(elbow.circle, elbow.psi, elbow.arcs, elbow.dexterity)
            place = elbow.circle.points(elbow.psi, OUTWARD)[0]
            self._drawing.set_transform(_HANDLE, position=place.tolist())
            self._label.position = (float(place[0]), float(place[1]), float(place[2]) + 1.6 * _RADIUS)
        snapped = state.goal.snapped
        if (snapped is not None) != self._is_red:
            self._is_red = snapped is not None
            self._drawing.set_style(_HANDLE, color=_SNAPPED_COLOR if self._is_red else _COLOR)
        if self._label.visible != (elbow is not None):
            self._label.visible = elbow is not None
        if elbow is not None:
            sentence = "ψ " + text.units.format_angle(elbow.psi, 0) if snapped is None else "▲ " + text.render(snapped)
            if sentence != self._label.text:
                self._label.text = sentence

    def remove(self) -> None:
        """Removes circle, handle and label."""
        self._view.remove()
        self._label.remove()

    async def _on_drag(self, event: Any) -> None:
        self._touched = time.monotonic()
        self._ask(
            DragElbow(
                page=event.client_id,
                eye=tuple(map(float, event.client.camera.position)),
                hand=tuple(map(float, event.end_position)),
                phase=event.phase,
            )
        )
