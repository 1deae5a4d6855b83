"""The displayed time of the plan, shared by scene and plots. No robot moves."""

from __future__ import annotations

from typing import Any

import ipywidgets

from rcilab.notebook.part import Part
from rcilab.notebook.style import block, write
from rcilab.notebook.widget_sharing import shared_style_widget

_INTERVAL = 50  # [ms] Between two pictures; faster than a software-rendered scene.
_RATES = (1.0, 0.5, 0.25, 0.1)


class Timeline(Part):
    """Play, pause and a slider over the milliseconds of the plan.

    Args:
        subject: A model, a session, or another part of the same arm.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
    """

    def __init__(self, subject: object, *, language: str | None = None) -> None:
        super().__init__(subject, language)
        self.play = shared_style_widget(
            ipywidgets.Play,
            min=0,
            max=1,
            interval=_INTERVAL,
            step=_INTERVAL,
            show_repeat=False,
            tooltip=self.text("timeline.play_hint"),
            layout={"flex": "0 0 auto", "width": "6em"},
        )
        self.slider = shared_style_widget(
            ipywidgets.IntSlider,
            min=0,
            max=1,
            readout=False,
            tooltip=self.text("timeline.scrub_hint"),
            layout={"flex": "1 1 64px", "width": "auto", "min_width": "64px"},
        )
        self.rate = shared_style_widget(
            ipywidgets.Dropdown,
            tooltip=self.text("timeline.rate"),
            options=[(f"{rate:g} ×", rate) for rate in _RATES],
            value=1.0,
            layout={"width": "4.4em", "flex": "0 0 auto"},
        )
        self.live = shared_style_widget(
            ipywidgets.Button,
            description=self.text("timeline.live"),
            tooltip=self.text("timeline.live_hint"),
            layout={"width": "auto"},
        )
        self._clock = block(flex="0 0 auto", min_width="7em")
        self._link = ipywidgets.jslink((self.play, "value"), (self.slider, "value"))
        row = shared_style_widget(
            ipywidgets.HBox,
            [self.play, self.slider, self._clock, self.rate, self.live],
            layout={"align_items": "center", "flex_flow": "row wrap"},
        )
        self.build([row], width="100%")
        self._writing = False
        self.slider.observe(self._on_slider, names="value")
        self.rate.observe(self._on_rate, names="value")
        self.live.on_click(lambda _: self._show_now())
        self.subscribe("plan", self._on_plan)
        self.subscribe("moment", self._show)

    @property
    def moment(self) -> float | None:
        """The displayed time of the plan, [s]; None shows the arm's position. Can be set."""
        return self.state.moment

    @moment.setter
    def moment(self, moment: float | None) -> None:
        self.state.look_at(moment)

    def end(self) -> None:
        """Unties play button and slider."""
        self._link.close()

    def _on_plan(self) -> None:
        plan = self.state.shown_plan
        last = 1 if plan is None else max(round(1000.0 * plan.motion.duration), 1)
        self._writing = True
        try:
            for control in (self.play, self.slider):
                control.disabled = plan is None
                control.value = 0
                control.max = last
        finally:
            self._writing = False
        self._show()

    def _on_rate(self, change: Any) -> None:
        self.play.step = max(round(_INTERVAL * change["new"]), 1)

    def _on_slider(self, change: Any) -> None:
        if not self._writing:
            self.state.look_at(change["new"] / 1000.0)

    def _show_now(self) -> None:
        self.play.playing = False
        self.state.display(None)
        self.state.look_at(None)

    def _show(self) -> None:
        plan, moment = self.state.shown_plan, self.state.moment
        self.live.disabled = moment is None
        if plan is None:
            write(self._clock, "")
            return
        if moment is not None and self.slider.value != round(1000.0 * moment):
            self._writing = True
            try:
                self.slider.value = round(1000.0 * moment)
            finally:
                self._writing = False
        shown = f"{moment or 0.0:.3f} / {plan.motion.duration:.3f} s"
        write(self._clock, f'<span class="rl-num rl-soft">{shown}</span>')
