"""Settings: which arm, which language, how much the graphics may cost, who holds the controls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.robots import RCI_ROBOT_NAMES
from rcilab.workbench import requests
from rcilab.workbench.text import LANGUAGES, Text
from rcilab.workbench.view_actions import QUALITIES
from rcilab.workbench.widgets import Ask, Html, Linked, esc, on_press

if TYPE_CHECKING:
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState


class SettingsPanel:
    """A thin one."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        model = gui.add_dropdown(
            text("settings.model"), RCI_ROBOT_NAMES, initial_value=state.model.name, hint=text("settings.model_hint")
        )
        self._model = Linked(model, ask, lambda v, p: requests.ChooseRobot(page=p, model=v))
        codes = {label: code for code, label in LANGUAGES.items()}
        language = gui.add_dropdown(text("settings.language"), tuple(codes), initial_value=LANGUAGES[state.language])
        self._language = Linked(
            language, ask, lambda v, p: requests.SetView(page=p, name="language", value=codes.get(v, ""))
        )
        labels = {text(f"quality.{quality}"): quality for quality in QUALITIES}
        self._qualities = {quality: label for label, quality in labels.items()}
        quality = gui.add_dropdown(
            text("settings.quality"),
            tuple(labels),
            initial_value=self._qualities[state.quality],
            hint=text("settings.quality_hint"),
        )
        self._quality = Linked(
            quality, ask, lambda v, p: requests.SetView(page=p, name="quality", value=labels.get(v, ""))
        )
        with gui.add_folder(text("settings.controls")):
            self._who = Html(gui)
            take = gui.add_button(
                text("settings.take"), icon="hand-grab", color="gray", hint=text("settings.take_hint")
            )
            on_press(take, ask, lambda page: requests.TakeControls(page=page))
        gui.add_html(
            f'<p class="rl-note">{esc(text("settings.limits", source=state.model.limits.source("joint.velocity")))}</p>'
        )

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the state."""
        self._model.show(state.model.name)
        self._language.show(LANGUAGES[state.language])
        self._quality.show(self._qualities[state.quality])
        lease = state.lease
        who = self._text("settings.who", holder=lease.number(lease.holder), pages=len(lease.pages))
        self._who.show(f'<p class="rl-note">{esc(who)}</p>')
