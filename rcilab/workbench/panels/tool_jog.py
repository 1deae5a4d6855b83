"""Jog the tool: along and about the axes of the base or of the tool."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.jog.jog_actions import SetJog
from rcilab.app.jog.jog_state import AXES, FRAMES
from rcilab.app.text import Text
from rcilab.workbench.panels.jog import add_jog_button
from rcilab.workbench.widgets import Ask, BoundControl

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class ToolJogPanel:
    """A group of the Jog tab."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text = self._text
        with gui.add_folder(text("jog.tool")):
            gui.add_html('<i class="rl-axes rl-held"></i>')
            frames = {text(f"jog.frame.{frame}"): frame for frame in FRAMES}
            self._frames = {frame: label for label, frame in frames.items()}
            chosen = self._frames[state.jog.frame]
            frame = gui.add_dropdown(
                text("jog.frame"), tuple(frames), initial_value=chosen, hint=text("jog.frame_hint")
            )
            self._frame = BoundControl(frame, self._ask, lambda v, p: SetJog(page=p, frame=frames.get(v)))
            for place in range(3):
                for axis in (AXES[place], AXES[place + 3]):
                    add_jog_button(gui, self._ask, text(f"target.{axis}"), axis, -1)
                    add_jog_button(gui, self._ask, text(f"target.{axis}"), axis, 1)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the settings."""
        self._frame.show(self._frames[state.jog.frame])
