"""The waypoints of the program in the scene: a numbered point each. Owned by the presenter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.errors import RcilabError
from rcilab.workbench.program.draft import target_of

if TYPE_CHECKING:
    import viser

    from rcilab.workbench.store import UiState

_MOST = 60  # A choice: more numbers than that hide the arm, and cost the browser more than it has.
_PLAIN, _CHOSEN, _FAILED = (70, 110, 160), (11, 111, 194), (209, 57, 43)
_SIZE = 0.016  # [m]
_ABOVE = 0.022  # [m]


class ProgramMarks:
    """Draws the program of the state; the selected waypoint and the one that failed stand out by colour and by sign.

    Args:
        server: The page.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = server.scene
        self._drawn: tuple[object, ...] = ()
        self._handles: list[Any] = []

    def show(self, state: UiState) -> None:
        """Draws what has changed."""
        program = state.program
        drawn = (program.draft, program.selected, program.failed, state.model)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        for handle in self._handles:
            handle.remove()
        self._handles = []
        if program.draft.model != state.model.name:
            return
        points, colors = [], []
        arm = program.draft.arm(state.model)
        for number, step in enumerate(program.draft.steps[:_MOST], start=1):
            try:
                target = target_of(step.waypoint, arm)
            except RcilabError:
                continue
            if target is None:
                continue
            failed, chosen = step.key == program.failed, step.key == program.selected
            points.append(target.position)
            colors.append(_FAILED if failed else _CHOSEN if chosen else _PLAIN)
            said = f"{number} !" if failed else f"[{number}]" if chosen else f"{number}"
            self._handles.append(self._label(number, said, target.position))
        if points:
            self._handles.append(
                self._scene.add_point_cloud(
                    "/program/points",
                    np.array(points, dtype=np.float32),
                    np.array(colors, dtype=np.uint8),
                    point_size=_SIZE,
                    point_shape="circle",
                    precision="float32",
                )
            )

    def _label(self, number: int, said: str, position: np.ndarray) -> Any:
        x, y, z = (float(value) for value in position)
        return self._scene.add_label(
            f"/program/{number}", said, position=(x, y, z + _ABOVE), anchor="bottom-center", depth_test=False,
            font_screen_scale=0.8,
        )  # fmt: skip
