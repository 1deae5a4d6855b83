"""Settings: arm, language and units, look of the page, controls."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import TYPE_CHECKING, Any

from rcilab.app.control_lock_actions import TakeControls
from rcilab.app.run.run_actions import ChooseRobot
from rcilab.app.text import Text
from rcilab.app.view_actions import QUALITIES, THEMES, SetView
from rcilab.conformance.explain import explain_limit
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.units import ANGLES, LENGTHS
from rcilab.makers.maker import all_makers
from rcilab.views.viser_ext.message_guard import allow_spectators
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_CHOICES: tuple[tuple[Any, tuple[str, ...], str, Callable[[UiState], str]], ...] = (
    ("angle", ANGLES, "unit", lambda state: state.units.angle),
    ("length", LENGTHS, "unit", lambda state: state.units.length),
    ("theme", THEMES, "theme", lambda state: state.theme),
    ("quality", QUALITIES, "quality", lambda state: state.quality),
)
"""Name in `SetView`, the options, prefix of the text keys, the current value."""


class SettingsPanel:
    """Settings of the workbench; nothing is stored in display units."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        arms = {f"{maker.title} {name}": name for maker in all_makers() for name in maker.robots}
        self._arms = {name: label for label, name in arms.items()}
        model = gui.add_dropdown(
            text("settings.model"),
            tuple(arms),
            initial_value=self._arms[state.model.name],
            hint=text("settings.model_hint"),
        )
        self._model = BoundControl(model, ask, lambda v, p: ChooseRobot(page=p, model=arms.get(v)))
        codes = {label: code for code, label in LANGUAGES.items()}
        language = gui.add_dropdown(text("settings.language"), tuple(codes), initial_value=LANGUAGES[state.language])
        self._language = BoundControl(
            language, ask, lambda v, p: SetView(page=p, name="language", value=codes.get(v, ""))
        )
        self._choices: list[tuple[BoundControl, Callable[[UiState], str]]] = []
        for name, values, begins, chosen in _CHOICES:
            labels = {text(f"{begins}.{value}"): value for value in values}
            self._choices.append((self._choice(gui, name, labels), self._labelled(labels, chosen)))
        with gui.add_folder(text("settings.controls")):
            self._who = Html(gui)
            gui.add_html('<i class="rl-anyone"></i>')
            self._take = gui.add_button(
                text("control_lock.ask"), icon="hand-grab", color="gray", hint=text("settings.take_hint")
            )
            on_press(self._take, ask, lambda page: TakeControls(page=page))
            allow_spectators(self._take)
        limits = state.model.limits
        sources = dict.fromkeys(limits.source(f"joint.{name}") for name in ("velocity", "acceleration"))
        named = (explain_limit(source, text.language) for source in sources)
        source = reduce(lambda first, second: text("joined", first=first, second=second), named)
        gui.add_html(f'<p class="rl-note">{esc(text("settings.limits", source=source))}</p>')

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the state."""
        text, lock = self._text, state.control_lock
        self._model.show(self._arms[state.model.name])
        self._model.handle.disabled = bool(state.watched)
        self._language.show(LANGUAGES[state.language])
        for choice, chosen in self._choices:
            choice.show(chosen(state))
        self._take.label = text("control_lock.take" if lock.holder is None else "control_lock.ask")
        is_needless = lock.holder is not None or bool(state.watched)
        self._take.disabled = is_needless and len(lock.pages) < 2  # There is no other page to ask.
        who = text("settings.free" if lock.holder is None else "settings.alone")
        if lock.holder is not None and len(lock.pages) > 1:
            who = text("settings.who", holder=lock.number(lock.holder), pages=len(lock.pages))
        self._who.show(f'<p class="rl-note">{esc(who)}</p>')

    def _choice(self, gui: Any, name: Any, labels: dict[str, str]) -> BoundControl:
        hint = self._text(f"settings.{name}_hint")
        handle = gui.add_dropdown(self._text(f"settings.{name}"), tuple(labels), hint=hint)
        return BoundControl(handle, self._ask, lambda v, p: SetView(page=p, name=name, value=labels.get(v, "")))

    @staticmethod
    def _labelled(labels: dict[str, str], chosen: Callable[[UiState], str]) -> Callable[[UiState], str]:
        names = {value: label for label, value in labels.items()}
        return lambda state: names[chosen(state)]
