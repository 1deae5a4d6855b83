"""Pause, resume, and the speed override of motions, which can be changed during a motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import ipywidgets

from rcilab.app.run.mode_actions import ModeActions, SetDrive
from rcilab.app.run.requested_speed import is_running
from rcilab.control_process import SupervisorStatus
from rcilab.i18n.translator import Text
from rcilab.motion.speed_scaling import MIN_SPEED_OVERRIDE
from rcilab.notebook.number_field import NumberField
from rcilab.notebook.state import LabState
from rcilab.notebook.style import block, problem, soft, write
from rcilab.notebook.subshell_routing import handle_during_cells
from rcilab.notebook.widget_sharing import shared_style_widget

_STEP = 5.0  # [%]


class SpeedFields:
    """Part of `RunPanel`: `buttons` in the row of Execute, `fields` below it.

    Args:
        state: State of the lab.
        text: The catalogue.
        modes: Sends requests to the robot.
    """

    def __init__(self, state: LabState, text: Text, modes: ModeActions) -> None:
        self._state, self._text, self._modes = state, text, modes
        self._writing = False
        self.pause = self._button("run.pause", partial(self._ask, modes.pause), icon="pause", style="warning")
        self.resume = self._button("run.resume", partial(self._ask, modes.resume), icon="play", style="info")
        percent, slowest = 100.0 * state.now.drive.speed_override, 100.0 * MIN_SPEED_OVERRIDE
        name = text("run.speed_override")
        self.slider: Any = shared_style_widget(
            ipywidgets.FloatSlider, value=percent, description=name, min=slowest, max=100.0, step=_STEP, readout=False,
            continuous_update=False, tooltip=text("run.speed_override_hint"), layout={"width": "19em"},
        )  # fmt: skip
        self.field = NumberField(text, "", "%", slowest, 100.0, self._choose, of=name, value=percent)
        self._progress = block()
        self.buttons = [self.pause, self.resume]
        self.fields: list[Any] = [
            shared_style_widget(ipywidgets.HBox, [self.slider, *self.field.cells], layout={"align_items": "center"}),
            self.field.message_box,
            self._progress,
        ]
        handle_during_cells(*self.buttons, self.slider, self.field.box)
        self.slider.observe(self._on_slider, names="value")

    def show(self, status: SupervisorStatus | None) -> None:
        """Follows the motion."""
        running = is_running(status)
        is_held = running and status is not None and status.code == "moving.held"
        self.pause.layout.display = "none" if is_held else None
        self.pause.disabled = not running
        self.resume.layout.display = None if is_held else "none"
        percent = 100.0 * self._state.now.drive.speed_override
        if self.slider.value != percent:
            self._writing = True
            try:
                self.slider.value = percent
                self.field.show(percent)
            finally:
                self._writing = False
        refusal = self._state.now.drive.override_refusal
        sentence = "" if not running or status is None else soft(self._describe_progress(status, is_held))
        write(
            self._progress, sentence + ("" if refusal is None or not running else problem(self._text.render(refusal)))
        )

    def _describe_progress(self, status: SupervisorStatus, is_held: bool) -> str:
        speed_override = f"{100.0 * status.speed_override:.0f}"
        plan_time = f"{status.motion_plan_time or 0.0:.1f}"
        return (
            self._text("run.held", place=plan_time)
            if is_held
            else self._text("run.way", place=plan_time, speed_override=speed_override)
        )

    def _on_slider(self, change: Any) -> None:
        if not self._writing:
            self.field.show(change["new"])
            self._choose(change["new"])

    def _choose(self, percent: float) -> None:
        self._ask(partial(self._modes.set_drive, SetDrive(speed_override=percent / 100.0)))

    def _ask(self, act: Callable[[], None]) -> None:
        with self._state.lock:
            act()
            self._state.notify("robot")

    def _button(self, code: str, act: Any, *, icon: str, style: str) -> Any:
        button = shared_style_widget(
            ipywidgets.Button, description=self._text(code), tooltip=self._text(f"{code}_hint"), icon=icon,
            button_style=style, layout=ipywidgets.Layout(width="auto"),
        )  # fmt: skip
        button.on_click(lambda _: act())
        return button
