"""The planned path in the scene, coloured by its utilisation of the limits, with a bead at each violation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.check.freshness import outdated
from rcilab.app.planning import PATH_POINTS
from rcilab.app.scene.path_strip import PathStrip, ViolationMarker
from rcilab.app.scene.scene_actions import ShowViolation
from rcilab.app.text import Text
from rcilab.views.usage_colors import usage_colors
from rcilab.views.viser_scene import ViserScene
from rcilab.workbench.widgets import Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState

_NAMED = 5
"""Number of markers with a label; the others show theirs after a click."""
_BEAD = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1.35), (0, 0, -1.35)]) * 0.024  # [m]
_BEAD_FACES = np.array(
    [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
)  # fmt: skip
_BEAD_COLOR = (200, 16, 24)
_THICK = 0.011  # [m]


class PathStripView:
    """Owned by the stage, and created again with its arm.

    Args:
        server: The page.
        drawing: Where to draw.
        ask: Takes requests.
    """

    def __init__(self, server: viser.ViserServer, drawing: ViserScene, ask: Ask) -> None:
        self._scene, self._drawing, self._ask = server.scene, drawing, ask
        self._drawn: tuple[PathStrip | None, str, bool] = (None, "", False)
        self._beads = 0
        self._labels: list[Any] = []
        # Created at the start: with software rendering, a page can take seconds to add a line later.
        drawing.add_segments("/path", np.zeros((PATH_POINTS - 1, 2, 3)), color=_BEAD_COLOR, thickness=_THICK)
        drawing.set_visible("/path", False)

    def show(self, state: UiState, text: Text) -> None:
        """Draws the path of the newest plan."""
        ribbon = state.scene.ribbon if state.plan is not None else None
        is_old = state.learn.show is None and outdated(state) is not None  # Its violations may no longer exist.
        wanted = (ribbon, text.language, is_old)
        if wanted[0] is self._drawn[0] and wanted[1:] == self._drawn[1:]:
            return
        self._drawn = wanted
        if ribbon is not None:
            colors = usage_colors(ribbon.usage)
            ends = np.stack([ribbon.path[:-1], ribbon.path[1:]], axis=1)
            shades = np.repeat(colors[:-1, None], 2, axis=1)
            self._drawing.add_segments("/path", ends, color=shades, thickness=_THICK)
        self._drawing.set_visible("/path", ribbon is not None)
        self._exchange_beads(() if ribbon is None or is_old else ribbon.markers, text)

    def remove(self) -> None:
        """Removes path and markers."""
        self._exchange_beads((), None)
        self._drawing.remove("/path")

    def _exchange_beads(self, markers: tuple[ViolationMarker, ...], text: Text | None) -> None:
        for number in range(self._beads):
            self._drawing.remove(f"/bead{number}")
        for label in self._labels:
            label.remove()
        self._labels, self._beads = [], len(markers)
        for number, bead in enumerate(markers):
            name = f"/bead{number}"
            self._drawing.add_mesh(name, _BEAD, _BEAD_FACES, color=_BEAD_COLOR)
            self._drawing.set_transform(name, position=bead.position.tolist())
            self._drawing.on_click(name, self._click_handler(number))
            if number < _NAMED and text is not None:
                x, y, z = (float(value) for value in bead.position)
                self._labels.append(
                    self._scene.add_label(
                        f"/bead_label{number}",
                        bead_words(bead, text),
                        position=(x, y, z + 0.045),
                        anchor="bottom-left",
                        depth_test=False,
                        font_screen_scale=0.85,
                    )
                )

    def _click_handler(self, number: int) -> Any:
        async def act(event: Any) -> None:
            self._ask(ShowViolation(page=event.client_id, number=number))

        return act


def bead_words(bead: ViolationMarker, text: Text) -> str:
    """Returns the violated condition, its joint and its time, as a short text."""
    worst = bead.violations[0]
    joint = f" J{worst.joint}" if worst.joint else ""
    more = f" +{len(bead.violations) - 1}" if len(bead.violations) > 1 else ""
    violated = text("scene.violated", condition=text("condition." + worst.condition.id))
    return f"◆ {violated}{joint} · {worst.worst_time:.2f} s{more}"
