"""The whole lab in one cell: scene, timeline, plots, and a tab for each thing a person does."""

from __future__ import annotations

import ipywidgets

from rcilab.notebook.fault_panel import FaultPanel
from rcilab.notebook.jog_panel import JogPanel
from rcilab.notebook.look import PHASE_TONES, Tone, block, esc, write
from rcilab.notebook.motion_plot import MotionPlot
from rcilab.notebook.part import Part
from rcilab.notebook.place import Place
from rcilab.notebook.plan_panel import PlanPanel
from rcilab.notebook.report_view import ReportView
from rcilab.notebook.run_panel import RunPanel
from rcilab.notebook.scene import Scene, View
from rcilab.notebook.target_panel import TargetPanel
from rcilab.notebook.timeline import Timeline


class Lab(Part):
    """Everything in one cell; Stop is always in sight.

    The parts are attributes (`lab.jog`, `lab.plan`, `lab.run`, ...), so that a cell can set what a hand can.

    Args:
        subject: A model, a session, or another part to look at the same arm as.
        view: Of the scene, see `Scene`.
        height: Of the scene, [px].
        language: "en" or "zh".
        place: Where the browser is; found out when absent.

    Raises:
        InvalidValueError: The subject, the view or the language is none.
        UsageError: meshcat is not installed.
    """

    def __init__(
        self,
        subject: object,
        *,
        view: View = "auto",
        height: int = 440,
        language: str = "en",
        place: Place | None = None,
    ) -> None:
        super().__init__(subject, language)
        text = self.text
        self.scene = Scene(self, view=view, height=height, language=language, place=place)
        self.timeline = Timeline(self, language=language)
        self.plot = MotionPlot(self, language=language)
        self.jog = JogPanel(self, language=language)
        self.target = TargetPanel(self, language=language)
        self.plan = PlanPanel(self, language=language)
        self.report = ReportView(self, language=language)
        self.run = RunPanel(self, language=language)
        self.faults = FaultPanel(self, language=language)
        self._parts: tuple[Part, ...] = (
            self.scene, self.timeline, self.plot, self.jog, self.target, self.plan, self.report, self.run, self.faults
        )  # fmt: skip
        panels = {
            "jog": self.jog, "target": self.target, "plan": self.plan, "check": self.report, "run": self.run,
            "faults": self.faults,
        }  # fmt: skip
        self.tabs = ipywidgets.Tab(
            children=[part.widget for part in panels.values()],
            titles=[text(f"tab.{name}") for name in panels],
            layout=ipywidgets.Layout(flex="1 1 410px", min_width="400px"),
        )
        self.stop = ipywidgets.Button(
            description=text("run.stop"), tooltip=text("run.stop_hint"), button_style="danger", icon="stop",
            layout=ipywidgets.Layout(width="8em", flex="0 0 auto"),
        )  # fmt: skip
        self.stop.add_class("rl-stop")
        self.stop.on_click(lambda _: self.halt())
        self._title = block(flex="1 1 auto")
        bar = ipywidgets.HBox([self._title, self.stop], layout=ipywidgets.Layout(align_items="center"))
        left = ipywidgets.VBox(
            [self.scene.widget, self.timeline.widget], layout=ipywidgets.Layout(flex="1.4 1 360px", min_width="350px")
        )
        body = ipywidgets.HBox([left, self.tabs], layout=ipywidgets.Layout(flex_flow="row wrap", grid_gap="10px"))
        self.build([bar, body, self.plot.widget], width="100%")
        self._ends.append(self.state.hear("plan", self._show))
        self.hear("robot", self._show)

    def halt(self) -> None:
        """Brings the robot to rest; from any thread, without waiting."""
        self.run.halt()

    def end(self) -> None:
        """Ends every part with what it started."""
        for part in reversed(self._parts):
            part.close()

    def _show(self) -> None:
        state, text = self.state, self.text
        status = state.status
        phase = "closed" if status is None else status.phase
        unpowered = status is not None and phase == "idle" and status.powered is False
        tone: Tone = "none" if status is None else "warn" if unpowered else PHASE_TONES.get(phase, "bad")
        chips = _chip(tone, text("phase.unpowered" if unpowered else f"phase.{phase}"))
        if state.plan is not None:
            ok = state.plan.report.ok
            duration = f"{state.plan.motion.duration:.2f} s"
            chips += _chip("good" if ok else "bad", f"{text('check.passed' if ok else 'check.failed')} {duration}")
        write(self._title, f'<span class="rl-title">rcilab · {esc(self.model.name)}</span>{chips}')


def _chip(tone: Tone, said: str) -> str:
    return f'<span class="rl-chip rl-{tone}">{esc(said)}</span>'
