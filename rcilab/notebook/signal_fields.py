"""Digital outputs and inputs, and the restart of the controller."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import ipywidgets

from rcilab.app.connection import Robot
from rcilab.control_process import PendingRequest, SupervisorStatus
from rcilab.i18n.translator import Text
from rcilab.makers.driver import SIGNALS
from rcilab.notebook.style import block, esc, head, soft, verdict, write
from rcilab.notebook.widget_sharing import lean

_NAMES = ("0_0", "0_1", "0_2", "0_3", "1_0", "1_1")  # Of the manual, 3.1.13 and 3.1.14, after DO or DI.

SendRequest = Callable[[str, Callable[[Robot], PendingRequest]], None]
"""Sends a request to the robot, and reports how it ended by the name that is given."""


class SignalFields:
    """A folded group of `RunPanel`.

    Args:
        text: Words.
        send: Sends a request to the robot that is connected, by its name.
        button: Makes a button of the panel.
    """

    def __init__(self, text: Text, send: SendRequest, button: Callable[..., Any]) -> None:
        self._text, self._send = text, send
        self.output: Any = lean(
            ipywidgets.Dropdown, description=text("signals.output"),
            options=[(f"DO{name}", signal) for signal, name in zip(SIGNALS, _NAMES, strict=True)],
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
        self._answers = lean(ipywidgets.HBox, [self.yes, self.no], layout=ipywidgets.Layout(display="none"))
        rows = [
            lean(ipywidgets.HBox, [self.output, self.on, self.off, self.read]),
            self._levels,
            block(soft(text("signals.note"))),
            block(head(text("reboot.title"))),
            self.reboot,
            self._question,
            self._answers,
        ]
        self.folder: Any = lean(
            ipywidgets.Accordion, [lean(ipywidgets.VBox, rows)], titles=(text("signals.title"),), selected_index=None
        )

    def show(self, status: SupervisorStatus | None) -> None:
        """Follows the controller."""
        is_ready = status is not None and status.phase in ("idle", "fault")
        for button in (self.on, self.off, self.read, self.reboot):
            button.disabled = not is_ready
        if not is_ready:
            self._ask(False)
        self._address = "" if status is None else status.address or status.target
        write(self._levels, "" if status is None else self._tell_levels(status))

    def _set_output(self, level: bool) -> None:
        signal = int(self.output.value)
        self._send("output", lambda robot: robot.set_output(signal, level))

    def _restart(self) -> None:
        self._ask(False)
        self._send("reboot", lambda robot: robot.reboot())

    def _tell_levels(self, status: SupervisorStatus) -> str:
        inputs = status.inputs or (None,) * len(SIGNALS)
        rows = "".join(
            f"<tr><th>DO{name}</th><td>{esc(self._level(out))}</td>"
            f"<th>DI{name}</th><td>{esc(self._level(level))}</td></tr>"
            for name, out, level in zip(_NAMES, status.outputs, inputs, strict=True)
        )
        return f'<table class="rl-table">{rows}</table>'

    def _level(self, level: bool | None) -> str:
        return "—" if level is None else self._text("signals.on" if level else "signals.off")

    def _ask(self, is_asked: bool) -> None:
        said = verdict("warn", "▲", self._text("reboot.ask", address=self._address)) if is_asked else ""
        write(self._question, said)
        self._answers.layout.display = None if is_asked else "none"
