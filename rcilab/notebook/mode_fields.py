"""The control mode, and the parameters that have an effect in it, each with its unit and range."""

from __future__ import annotations

from functools import partial
from typing import Any

import ipywidgets

from rcilab.app.arm_features import explain_missing_feature, is_only_planned
from rcilab.app.run.mode_actions import ModeActions, PressControl, SetControl
from rcilab.app.run.mode_parameters import (
    held_rows,
    is_control_pending,
    name_group,
    shown_numbers,
    typed_range,
    typed_scale,
    typed_value,
)
from rcilab.control_process import SupervisorStatus
from rcilab.core.state import MODES
from rcilab.i18n.translator import Text
from rcilab.makers.configuration import ControllerParameters
from rcilab.makers.maker import parameters_of
from rcilab.makers.parameters import ParameterGroup
from rcilab.notebook.number_field import NumberField
from rcilab.notebook.state import LabState
from rcilab.notebook.style import block, esc, head, problem, soft, table, verdict, why_html, write
from rcilab.notebook.widget_sharing import shared_style_widget

_WIDTHS = ("8em", "3.4em", "4.2em")  # With two fields in one row inside `Lab`.


class ModeFields:
    """Two groups of `RunPanel`: `choice` before Execute, `parameters` below it.

    Args:
        state: State of the lab.
        text: The catalogue.
        modes: Sends requests to the robot.
    """

    def __init__(self, state: LabState, text: Text, modes: ModeActions) -> None:
        self._state, self._text, self._modes = state, text, modes
        self._groups = parameters_of(state.model)
        self.mode: Any = shared_style_widget(
            ipywidgets.Dropdown, description=text("mode.choose"),
            options=[(text(f"mode.{mode}"), mode) for mode in MODES],
            value=state.now.drive.mode, tooltip=text("mode.hint"), layout={"width": "26em"},
            style={"description_width": "initial"},
        )  # fmt: skip
        self._note, self._missing, self._held, self._sentence = block(), block(), block(), block()
        self.fields: dict[str, list[NumberField]] = {}
        """Fields by group, of the groups that were opened."""
        self.folders: dict[str, Any] = {group.name: self._folder(group) for group in self._groups}
        self.send = self._button("control.send", self._on_send)
        self.reset = self._button("control.reset", partial(self._ask, PressControl(what="reset")))
        self._shown: ControllerParameters | None = None
        self.choice = shared_style_widget(ipywidgets.VBox, [self.mode, self._note])
        self.parameters = shared_style_widget(ipywidgets.VBox, [
            block(head(text("control.title"))),
            self._missing,
            *self.folders.values(),
            shared_style_widget(ipywidgets.HBox, [self.send, self.reset]),
            self._sentence,
            self._held,
        ])  # fmt: skip
        self.mode.observe(self._on_mode, names="value")

    def show(self, status: SupervisorStatus | None) -> None:
        """Follows mode, parameters and the controller's values of them."""
        state, text = self._state, self._text
        self.mode.value = state.now.drive.mode
        is_moving = status is not None and status.phase in ("moving", "stopping")
        self.mode.disabled = is_moving or is_only_planned(state.model)
        missing = explain_missing_feature(state.model, state.now.drive.mode)
        write(self._note, soft(text(f"mode.{state.now.drive.mode}_note") if missing is None else text.render(missing)))
        for group in self._groups:
            folder, shown = self.folders[group.name], None if state.now.drive.mode in group.modes else "none"
            if folder.layout.display != shown:
                folder.layout.display = shown
                folder.selected_index = 0 if shown is None and group.is_first else None
        if self._shown is not state.now.drive.control:
            self._shown = state.now.drive.control
            for group in self._groups:
                if group.name in self.fields:
                    self._fill(group)
        missing = explain_missing_feature(state.model, "control")
        write(self._missing, why_html(text, missing))
        self.reset.disabled = missing is not None
        pending = status is not None and is_control_pending(state.now.drive.control, status.setup.control)
        self.send.layout.display = "none" if state.robot is None or state.now.is_virtual else None
        self.send.disabled = not pending or status is None or status.phase != "idle"
        write(self._held, "" if status is None else self._describe_held(status, pending))

    def _describe_held(self, status: SupervisorStatus, pending: bool) -> str:
        state, text = self._state, self._text
        if state.now.drive.refusal is not None:
            return problem(text("ready.control_refused", error=text.render(state.now.drive.refusal)))
        known = state.session is None and state.robot is not None and state.now.is_virtual
        rows = held_rows(self._groups, state.now.drive.mode, status, text, is_known=known)
        held = soft(text("control.held")) + table([], [list(row) for row in rows])
        return held + (f'<p class="rl-soft"><b>{esc(text("control.pending"))}</b></p>' if pending else "")

    def _on_mode(self, change: Any) -> None:
        self._state.follow(change["new"])

    def _on_send(self) -> None:
        before = self._state.now.notice
        self._ask(PressControl(what="send"))
        notice = self._state.now.notice
        write(
            self._sentence,
            "" if notice is None or notice is before else verdict("warn", "▲", self._text.render(notice.text)),
        )

    def _ask(self, request: PressControl | SetControl) -> None:
        with self._state.lock:
            self._modes.handlers[type(request)](request)
            self._state.notify("robot")

    def _folder(self, group: ParameterGroup) -> Any:
        """Returns a group whose fields are created when it is opened: forty of them would delay the cell."""
        inside = shared_style_widget(ipywidgets.Box, layout={"flex_flow": "row wrap"})
        folder = shared_style_widget(
            ipywidgets.Accordion, children=[inside], titles=(name_group(self._text, group),),
            selected_index=None,
            layout=ipywidgets.Layout(display="none"),
        )  # fmt: skip

        def on_open(change: Any) -> None:
            if change["new"] == 0 and group.name not in self.fields:
                fields = self.fields[group.name] = [self._field(group, index) for index in range(len(group.parameters))]
                self._fill(group)
                inside.children = tuple(
                    shared_style_widget(
                        ipywidgets.VBox, [shared_style_widget(ipywidgets.HBox, field.cells), field.message_box]
                    )
                    for field in fields
                )

        folder.observe(on_open, names="selected_index")
        return folder

    def _field(self, group: ParameterGroup, index: int) -> NumberField:
        item = group.parameters[index]
        name, unit = self._text.render(item.label), typed_scale(item)[1]

        def take(number: float) -> None:
            self._ask(SetControl(group=group.name, index=index, value=typed_value(item, number)))

        return NumberField(self._text, name, unit, *typed_range(item), take, digits=None, widths=_WIDTHS)

    def _fill(self, group: ParameterGroup) -> None:
        numbers = shown_numbers(self._state.now.drive.control, group)
        for field, number, item in zip(self.fields[group.name], numbers, group.parameters, strict=True):
            field.show(typed_scale(item)[0] * number)

    def _button(self, code: str, act: Any) -> Any:
        button = shared_style_widget(
            ipywidgets.Button,
            description=self._text(code),
            tooltip=self._text(f"{code}_hint"),
            layout=ipywidgets.Layout(width="auto"),
        )
        button.on_click(lambda _: act())
        return button
