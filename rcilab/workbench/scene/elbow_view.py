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
from rcilab.workbench.scene.configuration_view import hides_target
from rcilab.workbench.widgets import HAND_AWAY, Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_HANDLE = "/elbow_handle"
_RADIUS = 0.034  # [m]
_FAINT = 0.55  # Opacity unless pointed at.
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
        self._drawn: Elbow | None = None  # Whose circle is shown.
        self._placed: Elbow | None = None  # Whose handle is shown.
        self._is_red = False
        self._has_handle = True
        self._touched = float("-inf")
        steps = [math.pi * (step / 12.0 - 0.5) for step in range(13)]
        profile = [(max(_RADIUS * math.cos(a), 0.0), _RADIUS * math.sin(a)) for a in steps]
        ball = revolve(profile, segments=24)
        drawing.add_mesh(_HANDLE, ball.vertices, ball.faces, color=_COLOR, opacity=_FAINT)
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
        return (_HANDLE,) if self._has_handle else ()

    def show(self, state: UiState, status: SupervisorStatus, text: Text) -> None:
        """Draws the handle of the goal's elbow, and its circle while it is edited; neither while the arm moves."""
        scene = state.scene
        is_wanted = "elbow" in scene.extras
        elbow = None if is_moving(status) or hides_target(state) else scene.elbow
        if state.watched and not is_wanted:
            elbow = None
        if elbow is not None and elbow is not self._placed:
            place = elbow.circle.points(elbow.psi, OUTWARD)[0]
            self._drawing.set_transform(_HANDLE, position=place.tolist())
            self._label.position = (float(place[0]), float(place[1]), float(place[2]) + 1.6 * _RADIUS)
        self._placed = elbow
        if self._has_handle != (elbow is not None):
            self._has_handle = elbow is not None
            self._drawing.set_visible(_HANDLE, self._has_handle)
        is_edited = scene.is_elbow_edited or self.is_held
        circle = elbow if is_wanted or is_edited else None
        if circle is None:
            self._view.set_visible(False)
        elif circle is not self._drawn:
            self._view.show(circle.circle, circle.psi, circle.arcs, circle.dexterity)
        self._drawn = circle
        snapped = state.goal.snapped
        if (snapped is not None) != self._is_red:
            self._is_red = snapped is not None
            self._drawing.set_style(_HANDLE, color=_SNAPPED_COLOR if self._is_red else _COLOR)
        is_named = elbow is not None and (circle is not None or snapped is not None)
        if self._label.visible != is_named:
            self._label.visible = is_named
        if elbow is not None:
            angle = text.units.format_angle(elbow.psi, 0)
            sentence = text("elbow.handle", angle=angle) if snapped is None else "▲ " + text.render(snapped)
            if sentence != self._label.text:
                self._label.text = sentence

    def remove(self) -> None:
        """Removes circle, handle and label."""
        self._view.remove()
        self._drawing.remove(_HANDLE)
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
