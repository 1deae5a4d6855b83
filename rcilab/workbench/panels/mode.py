"""Mode: the choice of the mode, and the parameters that have an effect in it, each with its unit and range."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.app.arm_features import explain_missing_feature, explain_missing_part, is_only_planned
from rcilab.app.run.drive_state import is_pending
from rcilab.app.run.mode_actions import PressControl, SetDrive
from rcilab.app.run.mode_parameters import held_rows, is_mixed, name_group, name_parameter, shown_numbers, typed_scale
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.text import Text
from rcilab.core.state import MODES, Mode
from rcilab.i18n.translator import message
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import ParameterGroup
from rcilab.workbench.panels.jog import problems_html
from rcilab.workbench.widgets import Ask, BoundControl, Html, NumberField, esc, on_press, why_html

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class ModePanel:
    """A group of the Run tab; our own controller gets typed values at once, a foreign one when they are sent."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        with gui.add_folder(text("mode.title"), expand_by_default=False):
            names: dict[str, Mode] = {text(f"mode.{mode}"): mode for mode in MODES}
            self._names = {mode: label for label, mode in names.items()}
            mode = gui.add_dropdown(
                text("mode.choose"), tuple(names), initial_value=self._names[state.drive.mode], hint=text("mode.hint")
            )
            self._mode = BoundControl(mode, ask, lambda v, p: SetDrive(page=p, mode=names.get(v)))
            self._note = Html(gui)
            self._build_parts(gui, state)
            with gui.add_folder(text("control.title"), expand_by_default=False):
                self._missing, self._held = Html(gui), Html(gui)
                send = gui.add_button(text("control.send"), icon="send", color="blue", hint=text("control.send_hint"))
                on_press(send, ask, lambda page: PressControl(page=page, what="send"))
                self._send = send
                reset = gui.add_button(
                    text("control.reset"), icon="restore", color="gray", hint=text("control.reset_hint")
                )
                on_press(reset, ask, lambda page: PressControl(page=page, what="reset"))
                self._reset = reset

    def _build_parts(self, gui: Any, state: UiState) -> None:
        text = self._text
        self._groups = parameters_of(state.model)
        self._folders: dict[str, Any] = {}
        self._fields: dict[str, list[NumberField]] = {}
        self._labels: dict[str, list[tuple[str, str]]] = {}
        self._problems: dict[str, Html] = {}
        for group in self._groups:
            visible = state.drive.mode in group.modes
            folder = gui.add_folder(name_group(text, group), visible=visible, expand_by_default=group.is_first)
            with folder:
                wide = " rl-wide" if is_mixed(group) else ""  # Names with ranges and units need a whole row.
                gui.add_html(f'<i class="rl-pairs{wide}"></i>')
                names = [text.render(parameter.label) for parameter in group.parameters]
                shown = [name_parameter(text, group, index) for index in range(len(names))]
                fields = [self._build_field(gui, group, index, label) for index, label in enumerate(shown)]
                self._labels[group.name] = [(field.field, name) for field, name in zip(fields, names, strict=True)]
                self._fields[group.name], self._problems[group.name] = fields, Html(gui)
            self._folders[group.name] = folder

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows mode and parameters."""
        text, drive = self._text, state.drive
        self._mode.show(self._names[drive.mode])
        self._mode.handle.disabled = is_moving(status) or is_only_planned(state.model)
        missing = explain_missing_feature(state.model, drive.mode)
        sentence = text(f"mode.{drive.mode}_note") if missing is None else text.render(missing)
        self._note.show(f'<p class="rl-note">{esc(sentence)}</p>')
        for group in self._groups:
            folder, visible = self._folders[group.name], drive.mode in group.modes
            if folder.visible != visible:
                folder.visible = visible
            numbers = shown_numbers(drive.control, group)
            for field, number, item in zip(self._fields[group.name], numbers, group.parameters, strict=True):
                factor, _ = typed_scale(item)
                field.show(f"{factor * number:g}", state.problems.get(field.field), state.entered)
            self._problems[group.name].show(problems_html(state, text, self._labels[group.name]))
        self._send.visible = state.target != "virtual"
        self._send.disabled = not is_pending(state, status) or status.phase != "idle"
        missing = explain_missing_part(state.model, "control")
        self._reset.disabled = missing is not None
        self._missing.show(why_html(text, missing))
        self._held.show(held_html(state, status, text))

    def _build_field(self, gui: Any, group: ParameterGroup, index: int, label: str) -> NumberField:
        handle = gui.add_text(label, "", hint=self._text("target.type_hint"))
        unit = self._text.unit(typed_scale(group.parameters[index])[1])
        return NumberField(handle, self._ask, f"control.{group.name}.{index}", unit)


def held_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns the controller's parameters of this mode, as it has acknowledged or reported them."""
    if state.drive.refusal is not None:
        why = text.render(message("ready.control_refused", error=state.drive.refusal))
        return f'<p class="rl-problem" role="alert">{esc(why)}</p>'
    groups, is_known = parameters_of(state.model), state.target == "virtual"
    rows = "".join(
        f"<tr><th>{esc(name)}</th><td>{esc(shown)}</td></tr>"
        for name, shown in held_rows(groups, state.drive.mode, status, text, is_known=is_known)
    )
    pending = f'<p class="rl-note rl-why">{esc(text("control.pending"))}</p>' if is_pending(state, status) else ""
    title = f'<p class="rl-note">{esc(text("control.held"))}</p>'
    return f'{title}<table class="rl-table rl-facts-table">{rows}</table>{pending}'
