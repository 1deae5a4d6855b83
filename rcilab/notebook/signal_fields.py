"""Digital outputs and inputs, and the restart of the controller."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import ipywidgets

from rcilab.app.connection import Robot
from rcilab.app.run.signal_actions import signal_rows
from rcilab.control_process import PendingRequest, SupervisorStatus
from rcilab.i18n.translator import Text
from rcilab.makers.maker import capabilities_of
from rcilab.model.robot_model import RobotModel
from rcilab.notebook.style import block, esc, head, soft, verdict, write
from rcilab.notebook.widget_sharing import shared_style_widget

SendRequest = Callable[[str, Callable[[Robot], PendingRequest]], None]
"""Sends a request to the robot; the end of the request is reported by this name."""


class SignalFields:
    """A folded group of `RunPanel`.

    Args:
        model: The arm.
        text: The catalogue.
        send: Sends a request to the connected robot, by its name.
        button: Creates a button of the panel.
    """

    def __init__(self, model: RobotModel, text: Text, send: SendRequest, button: Callable[..., Any]) -> None:
        self._model, self._text, self._send = model, text, send
        self.output: Any = shared_style_widget(
            ipywidgets.Dropdown, description=text("signals.output"),
            options=[(name, signal) for signal, name in enumerate(capabilities_of(model).outputs)],
            tooltip=text("signals.output_hint"), layout={"width": "14em"},
        )  # fmt: skip
        self.on = button("signals.on", partial(self._set_output, True))
        self.off = button("signals.off", partial(self._set_output, False))
        self.read = button("signals.read", lambda: send("inputs", lambda robot: robot.read_inputs()))
        self.reboot = button("reboot.press", lambda: self._ask(True))
        self.yes = button("reboot.confirm", self._restart, style="danger")
        self.no = button("run.cancel", lambda: self._ask(False))
        self._levels, self._question = block(), block()
        self._address = ""
        self._answers = shared_style_widget(
            ipywidgets.HBox, [self.yes, self.no], layout=ipywidgets.Layout(display="none")
        )
        capabilities = capabilities_of(model)
        has_signals = bool(capabilities.outputs or capabilities.inputs)
        switches = shared_style_widget(ipywidgets.HBox, [self.output, self.on, self.off, self.read])
        signals = [switches, self._levels, block(soft(text("signals.note")))]
        restart = [block(head(text("reboot.title"))), self.reboot, self._question, self._answers]
        rows = [*(signals if has_signals else ()), *(restart if capabilities.reboots else ())]
        self.folder: Any = shared_style_widget(
            ipywidgets.Accordion,
            [shared_style_widget(ipywidgets.VBox, rows)],
            titles=(text("signals.title"),),
            selected_index=None,
            layout=ipywidgets.Layout(display=None if rows else "none"),
        )

    def show(self, status: SupervisorStatus | None) -> None:
        """Follows the controller."""
        is_ready = status is not None and status.phase in ("idle", "fault")
        for button in (self.on, self.off, self.read, self.reboot):
            button.disabled = not is_ready
        if not is_ready:
            self._ask(False)
        self._address = "" if status is None else status.address or status.target
        write(self._levels, "" if status is None else self._describe_levels(status))

    def _set_output(self, level: bool) -> None:
        signal = int(self.output.value)
        self._send("output", lambda robot: robot.set_output(signal, level))

    def _restart(self) -> None:
        self._ask(False)
        self._send("reboot", lambda robot: robot.reboot())

    def _describe_levels(self, status: SupervisorStatus) -> str:
        rows = "".join(
            f"<tr><th>{esc(output)}</th><td>{esc(self._level(is_set))}</td>"
            f"<th>{esc(name)}</th><td>{esc(self._level(is_high))}</td></tr>"
            for output, is_set, name, is_high in signal_rows(self._model, status)
        )
        return f'<table class="rl-table">{rows}</table>'

    def _level(self, level: bool | None) -> str:
        return "—" if level is None else self._text("signals.on" if level else "signals.off")

    def _ask(self, is_asked: bool) -> None:
        sentence = verdict("warn", "▲", self._text("reboot.ask", address=self._address)) if is_asked else ""
        write(self._question, sentence)
        self._answers.layout.display = None if is_asked else "none"
