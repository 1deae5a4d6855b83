"""The arm's position: measured joint angles and the tool, next to the goal of the sliders."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, Html, esc, shown_pose

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel

_PERIOD = 0.2  # [s] Numbers that change faster are not readable.


class ArmStatePanel:
    """A group of the Jog tab and of the Run tab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text = text
        self._shown = float("-inf")

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the numbers."""
        with gui.add_folder(self._text("arm.now")):
            self._numbers = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the arm."""
        if time.monotonic() - self._shown >= _PERIOD:
            self._shown = time.monotonic()
            self._numbers.show(arm_html(state.model, status.q, self._text))


def arm_html(model: RobotModel, q: np.ndarray | None, text: Text) -> str:
    """Returns joint angles and tool pose in the units of the page.

    Args:
        model: The arm.
        q: Measured, [rad], shape (n,); None, or of another arm, while no states arrive.
        text: The catalogue, with its units.
    """
    if q is None or len(q) != model.n:
        return f'<p class="rl-note">{esc(text("arm.unknown"))}</p>'
    heads = "".join(f"<th>J{joint + 1}</th>" for joint in range(model.n))
    cells = "".join(f"<td>{text.units.format(angle, 'rad.1f#')}</td>" for angle in q)
    place, turns = np.split(np.array(shown_pose(model.forward(q)), float), 2)
    tool = text(
        "arm.tool",
        **dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), (*1e-3 * place, *np.radians(turns)), strict=True)),
    )
    return f'<table class="rl-table rl-even"><tr>{heads}</tr><tr>{cells}</tr></table><p class="rl-note">{esc(tool)}</p>'
