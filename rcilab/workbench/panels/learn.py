"""Learn: a button for each fault of the maker's manual; it provokes the fault on a private virtual controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.fault_lab import FaultTable
from rcilab.app.learn.learn_actions import PressLearn
from rcilab.app.text import Text
from rcilab.workbench.widgets import Ask, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.core.fault import FaultCode


class LearnPanel:
    """The buttons of the fault lab, with progress and cancel; hidden while a fault is shown."""

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
        self._faults = FaultTable(state.model)
        self._buttons: dict[FaultCode, Any] = {}
        for group in self._faults.groups:
            folder = gui.add_folder(text(f"learn.group.{group}"))
            self._folders.append(folder)
            with folder:
                gui.add_html('<i class="rl-buttons rl-wall"></i>')
                for scenario in self._faults.group(group):
                    button = gui.add_button(
                        text(f"label.{scenario.fault.key}"), color="gray", hint=scenario.fault.manual_name
                    )
                    on_press(button, ask, _provoke(scenario.fault))
                    self._buttons[scenario.fault] = button

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the provocation in progress."""
        text, learn = self._text, state.learn
        away, busy = learn.show is not None and learn.provoking is None, learn.provoking is not None
        note = text("learn.note") if self._faults else text("learn.no_scenarios", model=state.model.name)
        note = f'<p class="rl-note">{esc(note)}</p>'
        if learn.provoking is not None:
            sentence = text("learn.provoking", fault=learn.provoking.manual_name)
            note = f'<p class="rl-verdict rl-warn" role="status">{esc(sentence)}</p>'
        if learn.problem is not None:
            note += f'<p class="rl-problem" role="alert">{esc(text.render(learn.problem))}</p>'
        self._head.show("" if away else note)
        for folder in self._folders:
            if folder.visible == away:
                folder.visible = not away
        self._bar.visible = self._cancel.visible = busy
        if busy:
            self._bar.value = round(100.0 * learn.progress, 1)
        for fault, button in self._buttons.items():
            button.disabled = busy or self._faults.obstacle(fault) is not None


def _provoke(fault: FaultCode):  # type: ignore[no-untyped-def]
    return lambda page: PressLearn(page=page, what="provoke", fault=int(fault))
