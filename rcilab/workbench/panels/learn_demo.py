"""Learn: one provoked fault: the curve that violated its bound, cause, remedy, recovery, script."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.fault_lab.demo_view import AFTER_FAULT, MARGIN, body_html, head_html, seen_lower
from rcilab.app.learn.learn_actions import PressLearn
from rcilab.app.text import Text
from rcilab.core.arrays import Array
from rcilab.workbench.panels.plot_contents import joint_color, plot_axes
from rcilab.workbench.widgets import Ask, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.fault_lab.signals import FaultSignal
    from rcilab.app.store import Theme, UiState
    from rcilab.control_process import SupervisorStatus

_HEIGHT = 150  # [px]


class LearnDemoPanel:
    """The displayed fault; hidden without one."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._drawn: tuple[object, ...] = ()

    def build(self, gui: Any, state: UiState) -> None:
        """Adds controls and an empty plot."""
        text, ask = self._text, self._ask
        self._back = gui.add_button(text("learn.close"), icon="arrow-left", color="gray", visible=False)
        on_press(self._back, ask, lambda page: PressLearn(page=page, what="close"))
        self._head = Html(gui)
        data, series, bands = _contents(np.array([0.0, 1.0]), np.zeros(2), np.full(2, -1.0), np.ones(2), state.theme)
        self._plot = gui.add_uplot(
            data, series, bands=bands, height=_HEIGHT, legend={"show": False}, visible=False,
            scales={"x": {"time": False, "range": (0.0, 1.0)}, "y": {"range": (-1.2, 1.2)}},
            cursor={"drag": {"x": False, "y": False}}, padding=(6, 12, 0, 0),
            axes=plot_axes(state.theme, last=True),
        )  # fmt: skip
        self._body = Html(gui)
        self._moment = gui.add_button(
            text("learn.moment"),
            icon="player-skip-forward",
            color="gray",
            hint=text("learn.moment_hint"),
            visible=False,
        )
        on_press(self._moment, ask, lambda page: PressLearn(page=page, what="moment"))
        self._python = gui.add_button(text("learn.script"), icon="brand-python", color="gray", visible=False)
        on_press(self._python, ask, lambda page: PressLearn(page=page, what="script"))
        self._script = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Draws the displayed fault."""
        learn, text = state.learn, self._text
        demo = None if learn.show is None or learn.provoking is not None else learn.show.demo
        wanted = (demo, learn.is_script_shown, state.theme)
        if wanted == self._drawn:
            return
        self._drawn = wanted
        signal = None if demo is None or demo.signal is None or not demo.signal.has_curve else demo.signal
        for part in (self._back, self._moment, self._python):
            part.visible = demo is not None
        self._plot.visible = signal is not None
        if demo is None:
            for part in (self._head, self._body, self._script):
                part.show("")
            return
        self._head.show(head_html(demo, text))
        if signal is not None:
            self._draw(signal, np.array(demo.cycles["t"]), state.theme)
        self._body.show(body_html(demo, text))
        code = f"<pre>{esc(demo.script)}</pre>"
        copy = f'<button type="button" data-rl-copy data-done="{esc(text("program.copied"))}">'
        copy += f"{esc(text('program.copy'))}</button>"
        self._script.show(f'<div class="rl-code">{copy}{code}</div>' if learn.is_script_shown else "")

    def _draw(self, signal: FaultSignal, t: Array, theme: Theme) -> None:
        factor = self._text.units.from_si(signal.condition.unit)[0]
        data, series, _ = _contents(t, factor * signal.values, factor * signal.lower, factor * signal.upper, theme)
        low, high = float(np.nanmin(data[1:])), float(np.nanmax(data[1:]))
        margin = MARGIN * (high - low or 1.0)
        self._plot.data = data
        self._plot.series = series
        self._plot.axes = plot_axes(theme, last=True)
        self._plot.scales = {
            "x": {"time": False, "range": (0.0, float(t[-1]) * (1.0 + AFTER_FAULT))},
            "y": {"range": (low - margin, high + margin)},
        }


_RED = {"light": "#d1392b", "dark": "#ff7b70"}


def _contents(t: Array, values: Array, lower: Array, upper: Array, theme: Theme) -> tuple[Any, Any, Any]:
    """Returns data, series and bands: bounds, the area beyond them, the curve, the sample with the fault."""
    red = _RED[theme]
    seen = np.where(np.isfinite(values), values, np.nan)
    floor = seen_lower(values, lower)
    known = np.concatenate((upper[np.isfinite(upper)], seen, [1e-9]))
    top = 1.25 * float(np.nanmax(np.abs(known)))

    def level(value: float) -> Any:
        return np.full(len(t), value)

    mark = np.full(len(t), np.nan)
    mark[-1] = seen[-1]
    hidden: Any = {"width": 0, "points": {"show": False}}
    edge: Any = {"stroke": red, "width": 1.2, "dash": (5, 4), "points": {"show": False}}
    curve: Any = {"stroke": joint_color(0, theme), "width": 2, "points": {"show": False}}
    fault: Any = {"stroke": red, "width": 0, "points": {"show": True, "size": 11, "fill": red}}
    data = (
        t,
        level(top if upper[-1] >= 0.0 else 0.0),
        np.where(np.isfinite(upper), upper, math.nan),
        floor,
        level(-top if floor[-1] < 0 else math.nan),
        seen,
        mark,
    )
    series = ({}, hidden, edge, edge, hidden, curve, fault)
    tint = "rgba(209,57,43,0.10)"
    return data, series, ({"series": (1, 2), "fill": tint}, {"series": (3, 4), "fill": tint})
