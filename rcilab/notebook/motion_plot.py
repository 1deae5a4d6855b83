"""The plan as curves against the limits, violations shaded, the run next to it, and a cursor."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import ipywidgets
import numpy as np

from rcilab.core.clock import CYCLE_TIME
from rcilab.i18n.plot_scale import plot_scale
from rcilab.makers.maker import state_rounding_of
from rcilab.notebook.part import Part
from rcilab.notebook.style import block, soft, write
from rcilab.notebook.svg_plot import Panel, draw, share_of
from rcilab.notebook.widget_sharing import shared_style_widget
from rcilab.recording.run import Run
from rcilab.views.plots import (
    QUANTITIES,
    Curves,
    Quantity,
    build_error_frame,
    build_frame,
    last_time,
    plan_curves,
    recorded_curves,
    streamed_curves,
)

_BUCKETS = 200  # Intervals of time; each shows its smallest and largest value, so no spike is lost.
_UNITS: dict[Quantity, str] = {"q": "deg", "dq": "deg/s", "ddq": "deg/s²", "jerk": "deg/s³"}


class MotionPlot(Part):
    """Position, velocity, acceleration and jerk of the plan; every interval shows its smallest and largest value.

    The area beyond a limit is grey; a violation of the plan is shaded red. After an execution the plan is dashed over
    the run, with the difference below. The cursor is at the time of `Timeline`.

    Args:
        subject: A model, a session, or another part of the same arm.
        joint: The joint to show in its own unit, from 1; 0 shows all of them in percent of their limits.
        quantities: The rows.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
    """

    def __init__(
        self,
        subject: object,
        *,
        joint: int = 0,
        quantities: tuple[Quantity, ...] = QUANTITIES,
        language: str | None = None,
    ) -> None:
        super().__init__(subject, language)
        self._quantities = quantities
        names = [self.text("timeline.all"), *(self.text("jog.joint", joint=j + 1) for j in range(self.model.n))]
        self.joint: Any = shared_style_widget(
            ipywidgets.Dropdown,
            description=self.text("timeline.joint"),
            options=[(name, number) for number, name in enumerate(names)],
            value=joint,
            layout={"width": "22em"},
        )
        self._kinds = block()
        self._curves, self._cursor = block(), block()
        self._end = 1.0
        self._name = f"rl-plot-{id(self)}"
        bar = shared_style_widget(ipywidgets.HBox, [self.joint, self._kinds], layout={"align_items": "center"})
        self.build([bar, self._curves, self._cursor], self._name, width="100%")
        self.joint.observe(lambda _: self._draw(), names="value")
        self._cleanups.append(self.state.subscribe("run", self._draw))
        self.subscribe("plan", self._draw)
        self.subscribe("moment", self._move_cursor)

    @property
    def html(self) -> str:
        """The displayed pictures, SVG with a legend; a sentence while there is nothing to show."""
        return str(self._curves.value)

    def _draw(self) -> None:
        state = self.state
        shown = state.shown_plan
        if shown is None:
            write(self._curves, soft(self.text("timeline.nothing")))
            write(self._kinds, "")
            self._move_cursor()
            return
        joint, plan, run = int(self.joint.value), shown.motion, state.shown_run
        limits = self.model.limits.joint.in_mode(shown.mode if run is None else run.setup.mode)
        is_scaled = run is not None and run.has_speed_override
        times = None if run is None else run.t - run.delay * CYCLE_TIME
        panels: list[Panel] = []
        for quantity in self._quantities:
            planned = streamed_curves(plan.q, quantity) if is_scaled else plan_curves(plan, quantity)
            actual = None
            if run is not None and times is not None and len(times):
                rounding = state_rounding_of(self.model)
                recorded = recorded_curves(run.t, run.q, run.q_c, run.dq, quantity, rounding=rounding)
                actual = replace(recorded, t=times)
            frame = build_frame(planned, actual, limits, quantity, joint, _BUCKETS)
            unit = _UNITS[quantity] if joint else self.text("plot.percent")
            panels.append(Panel(title=self.text(f"plot.{quantity}"), unit=unit, frame=frame))
        if run is not None and times is not None and len(times):
            panels.append(self._error(run, times, last_time(plan_curves(plan, "q"), Curves(t=times, values=run.q))))
        joints = [joint - 1] if joint else list(range(self.model.n))
        self._end = panels[0].frame.end
        write(self._curves, draw(panels, joints, self.text("plot.time"), self.text("legend.limit")))
        delay = 0 if run is None else run.delay
        kinds = "plot.kinds" if run is None or not run.has_speed_override else "plot.kinds_speed_override"
        write(self._kinds, "" if run is None else soft(self.text(kinds, delay=delay)))
        self._move_cursor()

    def _error(self, run: Run, times: Any, last: float) -> Panel:
        joint = int(self.joint.value)
        errors = np.degrees(run.error)
        chosen = errors[:, joint - 1 : joint] if joint else errors
        frame = build_error_frame(times, chosen, last, plot_scale("error").least, _BUCKETS)
        return Panel(title=self.text("plot.error"), unit="deg", frame=frame)

    def _move_cursor(self) -> None:
        moment = self.state.moment
        if moment is None or self.state.shown_plan is None:
            write(self._cursor, "")
            return
        place = f"display:block;left:{100.0 * share_of(moment, self._end):.2f}%"
        write(self._cursor, f"<style>.{self._name} .rl-cursor{{{place}}}</style>")
