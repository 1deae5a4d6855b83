"""The whole lab in one cell: scene, timeline, plots, and a tab for each task."""

from __future__ import annotations

from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import ipywidgets

from rcilab.core.errors import UsageError
from rcilab.notebook.jog_panel import JogPanel
from rcilab.notebook.kernel_reachability import KernelReachability
from rcilab.notebook.motion_plot import MotionPlot
from rcilab.notebook.part import Part
from rcilab.notebook.scene import Scene, View
from rcilab.notebook.status_texts import name_phase
from rcilab.notebook.style import PHASE_TONES, Tone, block, esc, write
from rcilab.notebook.subshell_routing import handle_during_cells
from rcilab.notebook.timeline import Timeline
from rcilab.notebook.widget_sharing import shared_style_widget

if TYPE_CHECKING:
    from rcilab.notebook.fault_panel import FaultPanel
    from rcilab.notebook.plan_panel import PlanPanel
    from rcilab.notebook.report_view import ReportView
    from rcilab.notebook.run_panel import RunPanel
    from rcilab.notebook.target_panel import TargetPanel

_FRAME = 20  # [px] By which a tab's frame is higher than the timeline below the scene.
_MIN_TAB_HEIGHT = 420  # [px] Minimum height of the tabs next to a small scene.
_TABS = {"jog": "jog", "target": "target", "plan": "plan", "check": "report", "run": "run", "faults": "faults"}
"""Text key of each tab, and the attribute with its part."""


class Lab(Part):
    """All parts in one cell; Stop is always visible.

    The parts are attributes (`lab.jog`, `lab.plan`, `lab.run`, ...), so that a cell can set what a click can. The part
    of a tab is created when the tab is opened, or the attribute is read: the cell does not wait for hidden tabs.

    Args:
        subject: A model, a session, or another part of the same arm.
        view: View of the scene, see `Scene`.
        height: Height of the scene, [px].
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
        reachability: How the browser reaches the kernel; detected by default.

    Raises:
        InvalidValueError: The subject, the view or the language is unknown.
        UsageError: meshcat is not installed.
    """

    def __init__(
        self,
        subject: object,
        *,
        view: View = "auto",
        height: int = 440,
        language: str | None = None,
        reachability: KernelReachability | None = None,
    ) -> None:
        super().__init__(subject, language)
        text = self.text
        self.scene = Scene(self, view=view, height=height, reachability=reachability)
        self.timeline = Timeline(self)
        self.plot = MotionPlot(self)
        self.jog = JogPanel(self)
        self._parts: list[Part] = [self.scene, self.timeline, self.plot, self.jog]
        # Not higher than the scene with its timeline: what is below stays in place from tab to tab.
        tab = {"max_height": f"{max(height - _FRAME, _MIN_TAB_HEIGHT)}px", "overflow": "hidden auto"}
        self._tab_boxes: dict[str, Any] = {
            name: shared_style_widget(ipywidgets.VBox, layout=tab, classes=("rl-tab",)) for name in _TABS.values()
        }
        self._tab_boxes["jog"].children = (self.jog.widget,)
        self.tabs: Any = shared_style_widget(
            ipywidgets.Tab,
            children=list(self._tab_boxes.values()),
            titles=[text(f"tab.{name}") for name in _TABS],
            selected_index=0,
            layout={"flex": "1 1 410px", "min_width": "400px"},
        )
        self.tabs.observe(self._on_tab, names="selected_index")
        self.stop = shared_style_widget(
            ipywidgets.Button, description=text("run.stop"), tooltip=text("run.stop_hint"), button_style="danger",
            icon="stop", classes=("rl-stop",), layout={"width": "8em", "flex": "0 0 auto"},
        )  # fmt: skip
        handle_during_cells(self.stop)
        self.stop.on_click(lambda _: self.halt())
        self._title = block(flex="1 1 auto")
        bar = shared_style_widget(ipywidgets.HBox, [self._title, self.stop], layout={"align_items": "center"})
        left = shared_style_widget(
            ipywidgets.VBox,
            [self.scene.widget, self.timeline.widget],
            layout={"flex": "1.4 1 360px", "min_width": "350px"},
        )
        body = shared_style_widget(
            ipywidgets.HBox, [left, self.tabs], layout={"flex_flow": "row wrap", "grid_gap": "10px"}
        )
        self.build([bar, body, self.plot.widget], width="100%")
        self._cleanups.append(self.state.subscribe("plan", self._show))
        self.subscribe("robot", self._show)
        if self.state.session is not None:
            self._open("run")  # It connects to the robot of a session.

    @cached_property
    def target(self) -> TargetPanel:
        """Pose of the tool, branches, arm angle."""
        return self._make("target", "TargetPanel")

    @cached_property
    def plan(self) -> PlanPanel:
        """Path type, speed, time law."""
        return self._make("plan", "PlanPanel")

    @cached_property
    def report(self) -> ReportView:
        """The report of the plan."""
        return self._make("report", "ReportView")

    @cached_property
    def run(self) -> RunPanel:
        """Robot, power, mode, Execute."""
        return self._make("run", "RunPanel")

    @cached_property
    def faults(self) -> FaultPanel:
        """Fault lab and flight recorder."""
        return self._make("faults", "FaultPanel")

    def halt(self) -> None:
        """Stops the robot; from any thread, without waiting."""
        self.state.halt()

    def end(self) -> None:
        """Ends all parts with what they started."""
        for part in reversed(self._parts):
            part.close()

    def _make(self, name: str, kind: str) -> Any:
        if self._closed:
            raise UsageError(f"this lab was closed, and {name} with it: run its cell again")
        part = getattr(import_module("rcilab.notebook"), kind)(self)
        self._parts.append(part)
        self._tab_boxes[name].children = (part.widget,)
        return part

    def _on_tab(self, change: Any) -> None:
        if change["new"] is not None:
            self._open(list(_TABS.values())[change["new"]])

    def _open(self, name: str) -> None:
        getattr(self, name)

    def _show(self) -> None:
        state, text = self.state, self.text
        status = state.status
        phase = "closed" if status is None else status.phase
        unpowered = status is not None and phase == "idle" and status.powered is False
        tone: Tone = "none" if status is None else "warn" if unpowered else PHASE_TONES.get(phase, "bad")
        chips = _chip(tone, name_phase(status, text))
        if state.now.plan is not None:
            ok = state.now.plan.report.ok
            duration = f"{state.now.plan.motion.duration:.2f} s"
            chips += _chip("good" if ok else "bad", f"{text('check.passed' if ok else 'check.failed')} {duration}")
        write(self._title, f'<span class="rl-title">rcilab · {esc(self.model.name)}</span>{chips}')


def _chip(tone: Tone, sentence: str) -> str:
    return f'<span class="rl-chip rl-{tone}">{esc(sentence)}</span>'
