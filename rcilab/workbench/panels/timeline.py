"""Timeline and plots: the planned motion in time, against its limits and against what the arm really did."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.clock import CYCLE_TIME
from rcilab.views.plots import (
    QUANTITIES,
    Curves,
    Frame,
    Quantity,
    build_error_frame,
    build_frame,
    last_time,
    plan_curves,
    recorded_curves,
)
from rcilab.workbench import requests
from rcilab.workbench.program.draft import tell_place
from rcilab.workbench.text import Text
from rcilab.workbench.view_actions import RATES
from rcilab.workbench.widgets import Ask, Html, Linked, esc, on_press

if TYPE_CHECKING:
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState

COLORS = ("#0b6fc2", "#e07b00", "#1a9850", "#c2357a", "#7b52c7", "#8a6d3b", "#008b9a")
"""One colour a joint, told apart on white by people with common colour blindness; the number stands in the legend."""

_REDRAW_TIME = 0.25  # [s] A choice: plots are redrawn at most so often while something is dragged or moves.
_ERRORS = ("error", "tool")
"""Rows below the others, there once a motion has been executed."""
_UNITS = {"q": "°", "dq": "°/s", "ddq": "°/s²", "jerk": "°/s³"}
_OTHER_HEIGHT = 46 + 62 + 108 + 4 * 22 + 30  # [px] Bar, window head, strip, titles, legend.


class TimelinePanel:
    """Play, scrub, and four plots that share one time axis and one cursor."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._drawn: tuple[object, ...] = ()
        self._drawn_at = 0.0
        self._series: tuple[object, ...] = ()
        self.end = 1.0
        """Where the time axis ends, [s]."""

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls and empty plots."""
        text, ask = self._text, self._ask
        gui.add_html('<i class="rl-strip"></i>')
        self._play = gui.add_button(text("timeline.play"), icon="player-play", hint=text("timeline.play_hint"))
        on_press(self._play, ask, lambda page: requests.Play(page=page))
        scrub = gui.add_slider(text("timeline.time"), 0.0, 100.0, 0.1, 0.0, marks=(), hint=text("timeline.scrub_hint"))
        self._scrub = Linked(scrub, ask, lambda v, p: requests.Seek(page=p, place=v / 100.0))
        rates = {f"{rate:g}×": rate for rate in RATES}
        self._rates = {rate: label for label, rate in rates.items()}
        rate = gui.add_dropdown(text("timeline.rate"), tuple(rates), initial_value="1×")
        self._rate = Linked(rate, ask, lambda v, p: requests.SetView(page=p, name="rate", value=rates.get(v, 1.0)))
        joints = {text("timeline.all"): 0, **{f"J{j + 1}": j + 1 for j in range(state.model.n)}}
        self._joints = {joint: label for label, joint in joints.items()}
        choice = gui.add_dropdown(text("timeline.joint"), tuple(joints), hint=text("timeline.joint_hint"))
        self._joint = Linked(
            choice, ask, lambda v, p: requests.SetView(page=p, name="plot_joint", value=joints.get(v, 0))
        )
        self._readout = Html(gui)
        self._plots: dict[str, Any] = {}
        self._titles: dict[str, Html] = {}
        empty = build_frame(None, None, state.model.limits.joint, "q", 0)
        data, series, bands = plot_contents(empty, 0, state.model.n)
        for quantity in (*QUANTITIES, *_ERRORS):
            self._titles[quantity] = Html(gui)
            self._plots[quantity] = gui.add_uplot(
                data,
                series,
                bands=bands,
                height=_plot_height(state),
                legend={"show": False},
                scales={"x": {"time": False, "range": (0.0, 1.0)}, "y": {"range": (-112.0, 112.0)}},
                cursor={"drag": {"x": False, "y": False}, "sync": {"key": "rcilab"}},
                padding=(6, 12, 0, 0),
                axes=_axes(last=quantity in ("jerk", "tool"), space=16 if quantity in _ERRORS else 28),
                visible=quantity not in _ERRORS,
            )
        self._legend = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Moves the scrubber; redraws plots when plan, recording or choice have changed."""
        text = self._text
        self._play.label = text("timeline.hold" if state.playing else "timeline.play")
        self._play.disabled = state.plan is None
        self._scrub.show(round(100.0 * state.place, 1))
        self._scrub.handle.disabled = state.plan is None
        self._rate.show(self._rates[state.rate])
        self._joint.show(self._joints[state.plot_joint])
        if state.plan is None:
            self._readout.show(f'<p class="rl-note">{esc(text("timeline.nothing"))}</p>')
        else:
            duration = state.plan.motion.duration
            t, kinds = state.place * duration, text("timeline.plan_only")
            if state.recording is not None:
                kinds = text("timeline.kinds", delay=state.recording.delay)
                if status.q is None:
                    kinds = text("timeline.replayed")
            where = tell_place(state.plan, t)
            kinds = kinds if where is None else text.say(where)
            self._readout.show(f'<p class="rl-clock"><b>{t:.3f}</b> / {duration:.3f} s<span>{esc(kinds)}</span></p>')
        for plot in self._plots.values():
            plot.height = _plot_height(state)
        wanted = (state.plan, state.recording, state.plot_joint, state.model.name)
        now = time.monotonic()
        if wanted != self._drawn and now - self._drawn_at > _REDRAW_TIME:
            self._drawn, self._drawn_at = wanted, now
            for quantity in QUANTITIES:
                self._draw(state, quantity)
            self._draw_errors(state)

    def _draw(self, state: UiState, quantity: Quantity) -> None:
        plan = None if state.plan is None else plan_curves(state.plan.motion, quantity)
        recording, joint = state.recording, state.plot_joint
        actual = None
        if recording is not None:
            shown = recording.t - recording.delay * CYCLE_TIME  # So that plan and actual lie on each other.
            actual = recorded_curves(shown, recording.q, recording.q_c, recording.dq, quantity)
        frame = build_frame(plan, actual, state.model.limits.joint, quantity, joint)
        self.end = frame.end
        unit = _UNITS[quantity] if joint else self._text("plot.percent")
        title = self._text(f"plot.{quantity}") + (f" · J{joint}" if joint else "") + f" [{unit}]"
        self._titles[quantity].show(f'<div class="rl-plot-title">{esc(title)}</div>')
        self._fill(quantity, frame, state, (-frame.bound, frame.bound))
        if quantity == "jerk":
            self._legend.show(legend_html(frame, joint, state.model.n, self._text))

    def _draw_errors(self, state: UiState) -> None:
        """Draws measured against planned of a finished motion: joints, [deg], and the tool, [mm]."""
        recording, joint, text = state.recording, state.plot_joint, self._text
        tracking = None if recording is None else recording.tracking
        for name in _ERRORS:
            self._plots[name].visible = tracking is not None
        if recording is None or tracking is None:
            for name in _ERRORS:
                self._titles[name].show("")
            return
        t = recording.t - recording.delay * CYCLE_TIME
        last = last_time(*(plan_curves(p.motion, "q") for p in (state.plan,) if p is not None), Curves(t=t, values=t))
        errors = np.degrees(tracking.joint if not joint else tracking.joint[:, joint - 1 : joint])
        frame = build_error_frame(t, errors, last)
        self._fill("error", frame, state, (-frame.bound, frame.bound))
        title = text("plot.error") + (f" · J{joint}" if joint else "")
        self._titles["error"].show(f'<div class="rl-plot-title">{esc(title)} [°]</div>')
        frame = build_error_frame(t, 1000.0 * tracking.position[:, None], last)
        self._fill("tool", frame, state, (0.0, frame.bound))
        self._titles["tool"].show(f'<div class="rl-plot-title">{esc(text("plot.tool"))} [mm]</div>')

    def _fill(self, name: str, frame: Frame, state: UiState, reach: tuple[float, float]) -> None:
        plot = self._plots[name]
        data, series, _ = plot_contents(frame, 0 if name == "tool" else state.plot_joint, state.model.n)
        if name == "tool":  # It is no joint's.
            series = tuple({**look, "stroke": "#111827"} if "pxAlign" in look else look for look in series)
        if plot.series != series:
            plot.series = series
        plot.data = data
        scale = {"x": {"time": False, "range": (0.0, frame.end)}, "y": {"range": reach}}
        if plot.scales != scale:
            plot.scales = scale


def plot_contents(frame: Frame, joint: int, n: int) -> tuple[tuple[np.ndarray, ...], tuple[Any, ...], tuple[Any, ...]]:
    """Returns data, series and bands of one plot: limits as tinted bands, violations as columns, then curves.

    The number of series never changes, whatever is shown: viser sends data and series one after the other, and uPlot
    fails when they do not fit each other in between. Unused curves hold NaN.
    """
    t, nothing = frame.t, np.full(len(frame.t), np.nan)

    def level(value: float) -> np.ndarray:
        return np.full(len(t), value)

    hidden: Any = {"width": 0, "points": {"show": False}}
    edge: Any = {"stroke": "#d1392b", "width": 1, "dash": (5, 4), "points": {"show": False}}
    data = [
        t,
        level(frame.bound),
        level(frame.upper),
        level(frame.lower),
        level(-frame.bound),
        np.where(frame.violated, frame.bound, -frame.bound),
    ]
    series: list[Any] = [{}, hidden, edge, edge, hidden, hidden]
    pale, strong = "rgba(209,57,43,0.08)", "rgba(209,57,43,0.38)"
    bands = tuple({"series": pair, "fill": fill} for pair, fill in (((1, 2), pale), ((3, 4), pale), ((5, 4), strong)))
    for curves, look in ((frame.plan, {"width": 1.5}), (frame.actual, {"width": 2, "dash": (2, 5)})):
        for index in range(n):
            color = COLORS[(joint - 1 if joint else index) % len(COLORS)]
            if joint and curves is frame.actual:
                color = "#111827"
            data.append(curves[index] if index < len(curves) else nothing)
            series.append({"stroke": color, "points": {"show": False}, "pxAlign": 0, **look})
    return tuple(data), tuple(series), bands


def legend_html(frame: Frame, joint: int, n: int, text: Text) -> str:
    """Returns which colour is which joint, and what dots, dashes and areas mean."""
    joints = [joint - 1] if joint else range(n)
    swatches = "".join(f'<span><i style="background:{COLORS[i % len(COLORS)]}"></i>J{i + 1}</span>' for i in joints)
    signs = ("actual", "limit", "violation") if frame.actual else ("limit", "violation")
    rest = "".join(f'<span class="rl-sign-{sign}">{esc(text("legend." + sign))}</span>' for sign in signs)
    return f'<div class="rl-legend">{swatches}{rest}</div>'


def _plot_height(state: UiState) -> int:
    finished = state.recording is not None and state.recording.tracking is not None
    rows = len(QUANTITIES) + len(_ERRORS) * finished
    spare = 80 * finished  # [px] Titles of the rows of errors, and their times.
    return max(72 if finished else 90, int((state.height - _OTHER_HEIGHT - spare) / rows) // 4 * 4)


def _axes(*, last: bool, space: int) -> tuple[Any, ...]:
    font = "11px system-ui, sans-serif"
    x: Any = {"font": font, "size": 22, "gap": 2, "ticks": {"size": 3}} if last else {"show": False}
    return x, {"font": font, "size": 46, "gap": 3, "space": space, "ticks": {"size": 3}}
