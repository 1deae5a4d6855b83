"""Plan: from the arm's position to the goal, with speed and time law, and whether it may run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import ipywidgets

from rcilab.app.goal.goal_actions import SLOWEST, SetLaw, SetPathType, SetSpeed
from rcilab.app.planning import PathType, Plan, build_plan_view
from rcilab.conformance.time_scaling import SlowDown
from rcilab.core.background_job import ProgressCallback
from rcilab.core.errors import RcilabError
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import Message, message
from rcilab.motion.joint import JOINT_LAWS
from rcilab.notebook.long_task import LongTask
from rcilab.notebook.number_field import NumberField
from rcilab.notebook.part import Part
from rcilab.notebook.slider_echo import SliderEcho
from rcilab.notebook.style import block, problem, soft, verdict, write
from rcilab.notebook.widget_sharing import shared_style_widget

_PATH_TYPES: tuple[PathType, ...] = ("joint", "line")  # The notebook has no via point, and no cell.
_PROGRESS_DELAY = 0.3  # [s] Plans that take less, as most do, show no progress bar.


class PlanPanel(Part):
    """Path type, speed and time law; "Plan there" plans and checks. Nothing on it moves a robot.

    Args:
        subject: A model, a session, or another part of the same arm.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
    """

    def __init__(self, subject: object, *, language: str | None = None) -> None:
        super().__init__(subject, language)
        state, text = self.state, self.text
        wide = {"width": "24em"}
        self.path_type = shared_style_widget(
            ipywidgets.Dropdown, description=text("plan.way"),
            options=[(text(f"way.{path_type}"), path_type) for path_type in _PATH_TYPES],
            value=state.now.path_type,
            layout=wide,
        )  # fmt: skip
        self.law = shared_style_widget(
            ipywidgets.Dropdown, description=text("target.law"), value=state.now.law,
            options=[(text(f"law.{law}"), law) for law in JOINT_LAWS],
            tooltip=text("target.law_hint"), layout=wide,
        )  # fmt: skip
        self.speed = shared_style_widget(
            ipywidgets.FloatSlider, description=text("target.speed"), min=100.0 * SLOWEST, max=100.0, step=1.0,
            value=100.0 * state.now.speed,
            readout=False, tooltip=text("target.speed_hint"), layout={"width": "19em"},
        )  # fmt: skip
        self._speed_field = NumberField(text, "", "%", 100.0 * SLOWEST, 100.0, self._set_speed)
        self.plan = shared_style_widget(
            ipywidgets.Button,
            description=text("target.plan"),
            icon="check",
            button_style="primary",
            tooltip=text("target.plan_hint"),
        )
        self.slow_down = shared_style_widget(
            ipywidgets.Button, description=text("plan.slow_down"), tooltip=text("plan.slow_down_hint"),
            layout=ipywidgets.Layout(width="auto", display="none"),
        )  # fmt: skip
        self._sentence = block()
        self._work: LongTask[Plan | None, Plan | Message | SlowDown] = LongTask(
            text, "rcilab-plan", self._take, self._show, shown_after=_PROGRESS_DELAY
        )
        self.progress, self.cancel = self._work.progress, self._work.cancel
        self._slowed: tuple[Plan, SlowDown] | None = None  # Result of the last slow-down, with the plan it applies to.
        self.build([
            self.path_type,
            shared_style_widget(
                ipywidgets.HBox, [self.speed, *self._speed_field.cells], layout={"align_items": "center"}
            ),
            self._speed_field.message_box,
            self.law,
            block(soft(text("target.law_hint"))),
            shared_style_widget(
                ipywidgets.HBox,
                [self.plan, self.slow_down, self.progress, self.cancel],
                layout={"align_items": "center"},
            ),
            self._sentence,
        ], min_width="360px")  # fmt: skip
        self.path_type.observe(self._on_path_type, names="value")
        self.law.observe(self._on_law, names="value")
        self._echo = SliderEcho(self.speed)
        self.speed.observe(self._on_speed, names="value")
        self.plan.on_click(lambda _: self._make_plan())
        self.slow_down.on_click(lambda _: self._slow_down())
        self._speed_field.show(100.0 * state.now.speed)
        self._cleanups.append(state.subscribe("goal", self._show))
        self.subscribe("plan", self._show)

    def _set_speed(self, percent: float) -> None:
        self.state.ask(SetSpeed(speed=percent / 100.0))
        if self.speed.value != percent:
            self._echo.register(percent)
            self.speed.value = percent
        self._speed_field.show(percent)

    def _on_speed(self, change: Any) -> None:
        if self._echo.is_drag(change["new"]):
            self._set_speed(change["new"])

    def _on_path_type(self, change: Any) -> None:
        self.state.ask(SetPathType(kind=change["new"]))

    def _on_law(self, change: Any) -> None:
        self.state.ask(SetLaw(law=change["new"]))

    def halt(self) -> None:
        """Cancels the task in progress."""
        self._work.request_cancel()

    def end(self) -> None:
        """Ends the task in progress."""
        self._work.end()

    def _make_plan(self) -> None:
        self._begin(None, self.state.planning())

    def _slow_down(self) -> None:
        plan = self.state.now.plan
        if plan is not None:
            report = plan.report  # A plan that conforms is slowed down to meet the recommendations, as on the page.
            self._begin(plan, lambda progress: report.slow_down(recommended=report.ok, progress=progress))

    def _begin(self, about: Plan | None, run: Callable[[ProgressCallback], Plan | Message | SlowDown]) -> None:
        self.plan.disabled = self.slow_down.disabled = True
        self._work.start(about, run)
        self._work.wait_if_code()

    def _take(self, about: Plan | None, found: Plan | Message | SlowDown | RcilabError) -> None:
        if isinstance(found, RcilabError):
            self.state.show(message("plan.failed", error=describe_error(found)))
        elif not isinstance(found, SlowDown):
            self.state.show(found)
        elif about is not None and about is self.state.now.plan:  # Else there is a new plan.
            if found.motion is None or found.report is None:
                self._slowed = about, found
                return
            seen = build_plan_view(self.model, found.motion, found.report, about.box)
            slower = replace(seen, mode=about.mode, complete=True, missed_by=about.missed_by)
            self._slowed = slower, found
            self.state.show(slower)

    def _show(self) -> None:
        state, text = self.state, self.text
        plan = state.now.plan
        self.plan.disabled = self.slow_down.disabled = self._work.is_busy
        self.slow_down.layout.display = None if plan is not None and self._is_to_slow_down(plan) else "none"
        if plan is None:
            sentence = "" if state.now.no_plan is None else verdict("warn", "▲", text.render(state.now.no_plan))
            write(self._sentence, sentence or soft(text("plan.none", button=text("target.plan"))))
            return
        report = plan.report
        tone, word = ("good", "check.passed") if report.ok else ("bad", "check.failed")
        sentence = text("plan.ready", duration=f"{plan.motion.duration:.3f}")
        if not report.ok:
            sentence += " " + text(
                "check.failed_long", conditions=report.violated_conditions, count=len(report.violations)
            )
        elif plan.missed_by is not None:
            tone, word = "warn", "target.not_there"
            sentence += " " + text("target.leads_short", short=text.render(plan.missed_by))
        if not state.is_goal_of_plan and plan.missed_by is None:
            sentence += " " + text("plan.moved")
        write(self._sentence, verdict(tone, text(word), sentence) + self._describe_slowing(plan))

    def _is_to_slow_down(self, plan: Plan) -> bool:
        """Returns whether the plan violates a condition, or a recommendation and was not slowed down yet."""
        is_slowed = self._slowed is not None and self._slowed[0] is plan
        return not plan.report.ok or (bool(plan.report.warnings) and not is_slowed)

    def _describe_slowing(self, plan: Plan) -> str:
        if self._slowed is None or self._slowed[0] is not plan:
            return ""
        found = self._slowed[1]
        sentence = found.explain(self.text.language)
        return soft(sentence) if found.ok else problem(sentence)
