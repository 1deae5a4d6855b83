"""Digital outputs and inputs, and the restart of the controller."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.run.drive_state import is_ours
from rcilab.app.run.signal_actions import PressSignals, SetOutput, signal_rows
from rcilab.app.run.world_actions import SetVirtualInput, SetWiring
from rcilab.app.text import Text
from rcilab.makers.maker import capabilities_of
from rcilab.workbench.widgets import Ask, BoundControl, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel


class SignalsPanel:
    """Two groups of the Run tab, of an arm that has signals and of one that can be restarted."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        capabilities = capabilities_of(state.model)
        self._has_signals = bool(capabilities.outputs or capabilities.inputs)
        self._reboots = capabilities.reboots
        if self._has_signals:
            self._build_signals(gui, capabilities.outputs, capabilities.inputs)
        if self._reboots:
            self._build_reboot(gui)

    def _build_signals(self, gui: Any, names: tuple[str, ...], inputs: tuple[str, ...]) -> None:
        text, ask = self._text, self._ask
        with gui.add_folder(text("signals.title"), expand_by_default=False):
            output = gui.add_dropdown(text("signals.output"), names or ("—",), hint=text("signals.output_hint"))
            gui.add_html('<i class="rl-buttons rl-signals"></i>')
            self._buttons: list[Any] = []
            self._inputs: list[Any] = []
            for word, icon, level in (("on", "toggle-right", True), ("off", "toggle-left", False)):
                button = gui.add_button(text(f"signals.{word}"), icon=icon, color="blue" if level else "gray")
                on_press(
                    button,
                    ask,
                    lambda page, level=level: SetOutput(page=page, signal=names.index(output.value), level=level),
                )
                self._buttons.append(button)
            read = gui.add_button(text("signals.read"), icon="refresh", color="gray", hint=text("signals.read_hint"))
            on_press(read, ask, lambda page: PressSignals(page=page, what="read"))
            self._buttons.append(read)
            if inputs:
                chosen = gui.add_dropdown(text("signals.input"), inputs, hint=text("signals.input_hint"))
                gui.add_html('<i class="rl-buttons rl-signals"></i>')
                for word, icon, level in (("on", "toggle-right", True), ("off", "toggle-left", False)):
                    button = gui.add_button(text(f"signals.{word}"), icon=icon, color="teal" if level else "gray")
                    on_press(
                        button,
                        ask,
                        lambda page, level=level: SetVirtualInput(
                            page=page, signal=inputs.index(chosen.value), level=level
                        ),
                    )
                    self._inputs.append(button)
            self._levels = Html(gui)
            gui.add_html(f'<p class="rl-note">{esc(text("signals.note"))}</p>')
            wired = gui.add_checkbox(text("signals.loop_back"), False, hint=text("signals.loop_back_hint"))
            self._wired = BoundControl(wired, ask, lambda v, p: SetWiring(page=p, name="loop_back", on=bool(v)))

    def _build_reboot(self, gui: Any) -> None:
        text, ask = self._text, self._ask
        with gui.add_folder(text("reboot.title"), expand_by_default=False):
            gui.add_html('<i class="rl-buttons"></i>')
            self._reboot = gui.add_button(
                text("reboot.press"), icon="rotate-clockwise", color="orange", hint=text("reboot.hint")
            )
            on_press(self._reboot, ask, _press("reboot"))
            self._question = Html(gui)
            self._agree = gui.add_button(text("reboot.confirm"), icon="rotate-clockwise", color="red", visible=False)
            on_press(self._agree, ask, _press("confirm"))
            self._cancel = gui.add_button(text("run.cancel"), color="gray", visible=False)
            on_press(self._cancel, ask, _press("cancel"))

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the controller."""
        text, is_ready = self._text, status.phase in ("idle", "fault")
        if self._has_signals:
            for button in self._buttons:
                button.disabled = not is_ready
            self._levels.show(levels_html(state.model, status, text))
            self._wired.show(state.world.loop_back)
            self._wired.handle.disabled = not is_ours(status)
            for button in self._inputs:  # Also during a motion, which may wait for one.
                button.disabled = not is_ours(status)
        if self._reboots:
            self._show_reboot(state, status, is_ready=is_ready)

    def _show_reboot(self, state: UiState, status: SupervisorStatus, *, is_ready: bool) -> None:
        self._reboot.disabled = not is_ready
        self._reboot.visible = not state.reboot_asked
        self._agree.visible = self._cancel.visible = state.reboot_asked
        sentence = esc(self._text("reboot.ask", address=status.address or status.target)) if state.reboot_asked else ""
        self._question.show(sentence and f'<p class="rl-verdict rl-warn" role="alert">{sentence}</p>')


def levels_html(model: RobotModel, status: SupervisorStatus, text: Text) -> str:
    """Returns the outputs as set and the inputs as last read."""
    rows = "".join(
        f"<tr><th>{esc(output)}</th><td>{esc(_level(is_set, text))}</td>"
        f"<th>{esc(name)}</th><td>{esc(_level(is_high, text))}</td></tr>"
        for output, is_set, name, is_high in signal_rows(model, status)
    )
    return f'<table class="rl-table rl-facts-table">{rows}</table>'


def _level(level: bool | None, text: Text) -> str:
    return "—" if level is None else text("signals.on" if level else "signals.off")


def _press(what: Any):  # type: ignore[no-untyped-def]
    return lambda page: PressSignals(page=page, what=what)
