"""Switches of the scene: what it shows in addition to arm, target and path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.request import Request
from rcilab.app.scene.scene_actions import ShowExtra
from rcilab.app.scene.scene_extras import Extra, extras_of
from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, BoundControl

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class ExtrasPanel:
    """One switch each; all pages show the same scene."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the switches."""
        self._switches: dict[Extra, BoundControl] = {}
        with gui.add_folder(self._text("extra.title")):
            for extra in extras_of(state.model):
                box = gui.add_checkbox(
                    self._text(f"extra.{extra}"), extra in state.scene.extras, hint=self._text(f"extra.{extra}_hint")
                )
                self._switches[extra] = BoundControl(box, self._ask, _request(extra))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the switches of the state."""
        for extra, switch in self._switches.items():
            switch.show(extra in state.scene.extras)


def _request(extra: Extra):  # type: ignore[no-untyped-def]
    def make(on: bool, page: int | None) -> Request:
        return ShowExtra(page=page, name=extra, on=bool(on))

    return make
