"""Learn: twenty buttons, one a fault of the manual; each provokes its fault on a private virtual controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.fault_lab import FAULTS, GROUPS
from rcilab.app.learn.learn_actions import PressLearn
from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.makers.rokae.faults import Fault


class LearnPanel:
    """The wall of the gallery, with progress and cancel; gives way to the fault that is on show."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the buttons."""
        text, ask = self._text, self._ask
        self._head = Html(gui)
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._cancel = gui.add_button(text("learn.cancel"), icon="x", color="gray", visible=False)
        on_press(self._cancel, ask, lambda page: PressLearn(page=page, what="cancel"))
        self._folders: list[Any] = []
        self._buttons: dict[Fault, Any] = {}
        for group in GROUPS:
            folder = gui.add_folder(text(f"learn.group.{group}"))
            self._folders.append(folder)
            with folder:
                gui.add_html('<i class="rl-buttons rl-wall"></i>')
                for recipe in sorted(FAULTS.group(group), key=lambda recipe: recipe.place):
                    button = gui.add_button(
                        text(f"learn.fault.{recipe.fault.name}"), color="gray", hint=recipe.fault.manual_name
                    )
                    on_press(button, ask, _provoke(recipe.fault))
                    self._buttons[recipe.fault] = button

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows what is being provoked."""
        text, learn = self._text, state.learn
        away, busy = learn.show is not None and learn.provoking is None, learn.provoking is not None
        note = f'<p class="rl-note">{esc(text("learn.note"))}</p>'
        if learn.provoking is not None:
            said = text("learn.provoking", fault=learn.provoking.manual_name)
            note = f'<p class="rl-verdict rl-warn" role="status">{esc(said)}</p>'
        if learn.problem is not None:
            note += f'<p class="rl-problem" role="alert">{esc(text.say(learn.problem))}</p>'
        self._head.show("" if away else note)
        for folder in self._folders:
            if folder.visible == away:
                folder.visible = not away
        self._bar.visible = self._cancel.visible = busy
        if busy:
            self._bar.value = round(100.0 * learn.progress, 1)
        for fault, button in self._buttons.items():
            button.disabled = busy or (FAULTS[fault].needs_elbow and not state.model.redundancy)


def _provoke(fault: Fault):  # type: ignore[no-untyped-def]
    return lambda page: PressLearn(page=page, what="provoke", fault=int(fault))
