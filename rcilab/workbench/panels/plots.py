"""The plots of the timeline: the chosen ones, one below the other with a common time axis and cursor."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from rcilab.app.run.played_motion import played_path, streamed_rows
from rcilab.app.text import Text
from rcilab.app.view_actions import PLOTS, has_plot
from rcilab.core.clock import CYCLE_TIME
from rcilab.i18n.plot_scale import ERRORS, PlotScale, plot_scale
from rcilab.makers.maker import state_rounding_of
from rcilab.views.plot_ticks import axis_ticks
from rcilab.views.plots import (
    Curves,
    Frame,
    Quantity,
    build_error_frame,
    build_frame,
    build_tool_frame,
    last_time,
    mark_moment,
    peak_of,
    plan_curves,
    recorded_curves,
    streamed_curves,
)
from rcilab.views.tool_curves import TOOL_QUANTITIES, ToolQuantity, tool_curves, tool_limit
from rcilab.workbench.panels.plot_contents import legend_html, plot_axes, plot_contents
from rcilab.workbench.panels.plot_marks import plot_marks
from rcilab.workbench.widgets import Html, esc

if TYPE_CHECKING:
    from rcilab.app.run.recording import Recording
    from rcilab.app.store import UiState
    from rcilab.core.arrays import JointPath

_REDRAW_TIME = 0.25  # [s] Minimum time between two redraws during a drag or a motion.
_LEISURE = 8.0  # Redraws take at most an eighth of the time, for any length of the motion.
_OTHER_HEIGHT = 46 + 62 + 170 + 30  # [px] Bar, window head, strip and choices, legend.
_HINT = 44  # [px] By which the first hint is higher than the clock that replaces it.
_MARGIN = 6  # [px] Above and below: half of a label at the end of an axis.
_HALF_LABEL = 18  # [px] Of the time at the right end of the axis.
_TITLE, _TIMES = 20, 26  # [px] Height of a plot's title, and of the time labels below the last one.

_Reach: TypeAlias = tuple[float, float, tuple[float, ...]]
"""The ends of a plot's axis, lower and upper, and the limits in it."""


class Plots:
    """Owned by the timeline panel."""

    def __init__(self, text: Text) -> None:
        self._text = text
        self._drawn: tuple[object, ...] = ()
        self._next = 0.0
        self._visible: tuple[str, ...] = ()
        self._planned: dict[str, Curves] = {}
        self._plan: object = None
        self._streamed: JointPath | None = None  # The plan as it was run at another speed override.
        self._above = 0
        self._last = 1.0  # [s] End of everything that is drawn.
        self.end = 1.0
        """End of the time axis, [s]."""
        self.marks: list[dict[str, Any]] = []
        """Waypoints and fault on the time axis, see `plot_marks`."""

    def build(self, gui: Any, state: UiState) -> None:
        """Adds a plot of every kind; those that are not chosen are hidden."""
        self._plots: dict[str, Any] = {}
        self._titles: dict[str, Html] = {}
        self._reaches: dict[str, _Reach] = dict.fromkeys(PLOTS, (-112.0, 112.0, (-100.0, 100.0)))
        empty = build_frame(None, None, state.model.limits.joint, "q", 0)
        data, series, bands = plot_contents(empty, 0, state.model.n, state.theme)
        self._visible = _wanted(state)
        for name in PLOTS:
            self._titles[name] = Html(gui)
            self._plots[name] = gui.add_uplot(
                data,
                series,
                bands=bands,
                height=self._height(state, len(self._visible)),
                legend={"show": False},
                scales={"x": {"time": False, "range": (0.0, 1.0)}, "y": {"range": self._reaches[name][:2]}},
                cursor={"drag": {"x": False, "y": False}, "sync": {"key": "rcilab"}},
                padding=(_MARGIN, _HALF_LABEL, _MARGIN, 0),
                axes=self._axes(name, state, self._visible),
                visible=name in self._visible,
            )
        self._legend = Html(gui)

    def show(self, state: UiState, above: int = 0) -> None:
        """Redraws the plots when plan, recording, choice or colours have changed.

        Args:
            state: State of the page.
            above: Height of what is above them, without the controls, [px].
        """
        self._above = above
        streamed = streamed_rows(state)
        if state.plan is not self._plan or streamed is not self._streamed:
            self._plan, self._streamed, self._planned = state.plan, streamed, {}
        visible = _wanted(state)
        is_rearranged = visible != self._visible
        if is_rearranged:
            self._arrange(visible)
        height = self._height(state, len(visible))
        for name in visible:
            wanted_height = height + (_TIMES if name == visible[-1] else 0)
            if self._plots[name].height != wanted_height:
                self._plots[name].height, is_rearranged = wanted_height, True
        if is_rearranged:
            self._fit(state, visible)
        wanted = (state.plan, state.recording, state.plot_joint, state.model, state.theme, visible)
        now = time.monotonic()
        if wanted != self._drawn and now >= self._next:
            began = time.thread_time()  # A busy machine draws slowly, not rarely.
            self._drawn, self._last = wanted, _last(state)
            for name in visible:
                self._draw(state, name)
            self.marks = plot_marks(state, self.end)
            has_actual = state.recording is not None
            self._legend.show(
                legend_html(
                    state.plot_joint,
                    state.model.n,
                    self._text,
                    state.theme,
                    has_actual=has_actual,
                    is_scaled=streamed is not None,
                )
            )
            self._fit(state, visible)
            self._next = now + max(_REDRAW_TIME, _LEISURE * (time.thread_time() - began))

    def _fit(self, state: UiState, visible: tuple[str, ...]) -> None:
        """Gives every plot as many labels as fit its height."""
        for name in visible:
            axes = self._axes(name, state, visible)
            if self._plots[name].axes != axes:
                self._plots[name].axes = axes

    def _axes(self, name: str, state: UiState, visible: tuple[str, ...]) -> tuple[Any, ...]:
        low, high, limits = self._reaches[name]
        ticks = axis_ticks(low, high, self._height(state, len(visible)) - 2 * _MARGIN, limits)
        return plot_axes(state.theme, last=name == (visible or PLOTS)[-1], ticks=ticks)

    def _arrange(self, visible: tuple[str, ...]) -> None:
        for name, plot in self._plots.items():
            if plot.visible != (name in visible):
                plot.visible = name in visible
            if name not in visible:
                self._titles[name].show("")
        self._visible, self._drawn = visible, ()  # A plot that is hidden and shown again before a redraw has no title.

    def _draw(self, state: UiState, name: str) -> None:
        scale = plot_scale(name, self._text.units)
        factor, unit = scale.factor, scale.unit
        joint = 0 if name in (*TOOL_QUANTITIES, "tool") else state.plot_joint
        if name in ERRORS:
            frame = self._error_frame(state, name, scale)
        elif name in TOOL_QUANTITIES:
            frame = self._tool_frame(state, cast("ToolQuantity", name), factor)
        else:
            frame = self._joint_frame(state, cast("Quantity", name), factor)
            unit = unit if joint else self._text("plot.percent")
        self.end = frame.end
        if state.recording is not None and state.recording.moment is not None:
            frame = mark_moment(frame, state.recording.moment - state.recording.delay * CYCLE_TIME)
        title = self._text(f"plot.{name}") + (f" · J{joint}" if joint else "") + f" [{unit}]"
        peak = self._peak_html(frame, name, joint, "%" if unit == self._text("plot.percent") else unit)
        self._titles[name].show(f'<div class="rl-plot-title">{esc(title)}{peak}</div>')
        low = 0.0 if name in ("speed", "acceleration", "tool") else -frame.bound
        ends = float(frame.lower.min()), float(frame.upper.max())
        self._reaches[name] = low, frame.bound, tuple(end for end in ends if math.isfinite(end))
        is_tool = name in (*TOOL_QUANTITIES, "tool")
        data, series, _ = plot_contents(frame, joint, state.model.n, state.theme, is_tool=is_tool)
        plot = self._plots[name]
        if plot.series != series:
            plot.series = series
        plot.data = data
        scales = {"x": {"time": False, "range": (0.0, frame.end)}, "y": {"range": (low, frame.bound)}}
        if plot.scales != scales:
            plot.scales = scales

    def _peak_html(self, frame: Frame, name: str, joint: int, unit: str) -> str:
        """Returns the largest value of a plot and its time, in words."""
        peak = peak_of(frame)
        if peak is None:
            return ""
        curve, value, moment = peak
        who = "" if joint or name in (*TOOL_QUANTITIES, "tool") else f"J{curve + 1} "
        words = self._text("plot.peak", who=who, value=f"{value:.3g}", unit=unit, time=f"{moment:.2f}")
        return f"<span>{esc(words)}</span>"

    def _joint_frame(self, state: UiState, name: Quantity, factor: float) -> Frame:
        plan, recording, actual = state.plan, state.recording, None
        if plan is not None and name not in self._planned:
            self._planned[name] = (
                plan_curves(plan.motion, name, state.model, start=plan.report.start, is_recorded=plan.is_recorded)
                if self._streamed is None
                else streamed_curves(self._streamed, name, state.model)
            )
        if recording is not None and name == "tau":
            actual = None if recording.tau is None else Curves(t=_times(recording), values=recording.tau)
        elif recording is not None:
            rounding = state_rounding_of(state.model)
            actual = recorded_curves(
                _times(recording), recording.q, recording.q_c, recording.dq, name, rounding=rounding
            )
            if name in ("ddq", "jerk"):
                actual = _commanded_part(actual, state)
        model = plan.model if plan is not None and plan.is_recorded else state.model  # With the limits of its time.
        mode = (recording.mode if recording is not None else "") or ("" if plan is None else plan.mode)
        limits = model.limits.joint.in_mode(mode)
        return build_frame(
            self._planned.get(name), actual, limits, name, state.plot_joint, factor=factor, last=self._last
        )

    def _tool_frame(self, state: UiState, name: ToolQuantity, factor: float) -> Frame:
        path, recording, actual = played_path(state), state.recording, None
        if path is not None and name not in self._planned:
            self._planned[name] = tool_curves(state.model, *path, name)
        if recording is not None:  # The second derivative of measured angles is noise: it is that of the commands.
            q = recording.q_c if name == "acceleration" else recording.q
            actual = tool_curves(state.model, _times(recording), q, name)
            if name == "acceleration":
                actual = _commanded_part(actual, state)
        limit = tool_limit(state.model.limits, name)
        return build_tool_frame(self._planned.get(name), actual, limit, factor, last=self._last)

    def _error_frame(self, state: UiState, name: str, scale: PlotScale) -> Frame:
        """Returns measured minus planned values of a finished motion: of the joints, or of the tool."""
        recording, joint = state.recording, state.plot_joint
        assert recording is not None
        assert recording.tracking is not None
        t, tracking = _times(recording), recording.tracking
        errors = tracking.joint if not joint else tracking.joint[:, joint - 1 : joint]
        errors = tracking.position[:, None] if name == "tool" else errors
        return build_error_frame(t, scale.factor * errors, self._last, scale.least)

    def _height(self, state: UiState, rows: int) -> int:
        """Returns the height of each plot, [px]."""
        hint = 0 if state.plan is not None else _HINT
        spare = state.height - _OTHER_HEIGHT - self._above - hint - _TIMES - _TITLE * rows
        return max(56, min(int(spare / max(rows, 1)), 260)) // 4 * 4


def _wanted(state: UiState) -> tuple[str, ...]:
    finished = state.recording is not None and state.recording.tracking is not None
    return tuple(
        name
        for name in PLOTS
        if name in state.plots and has_plot(state.model, name) and (finished or name not in ERRORS)
    )


def _commanded_part(actual: Curves, state: UiState) -> Curves:
    """Returns derivatives of recorded commands up to the client's last one, from which the controller stops the arm.

    Those of a motion with a fault are returned as they are: its stop is to be seen.
    """
    plan, recording = state.plan, state.recording
    if plan is None or not plan.is_recorded or (recording is not None and recording.moment is not None):
        return actual
    count = int(np.searchsorted(actual.t, plan.motion.duration + CYCLE_TIME / 2.0))
    return replace(actual, t=actual.t[:count], values=actual.values[:count])


def _last(state: UiState) -> float:
    """Returns the end of plan and recording, [s]: one time axis for all plots, whatever each of them shows."""
    path, recording = played_path(state), state.recording
    times = [] if path is None else [path[0]]
    if recording is not None:
        times.append(_times(recording))
    return last_time(*(Curves(t=t, values=t) for t in times))


def _times(recording: Recording) -> Any:
    return recording.t - recording.delay * CYCLE_TIME  # So that plan and measurement coincide.
