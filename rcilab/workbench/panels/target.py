"""Target: the tool pose as numbers, and its status."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rcilab.app.check.freshness import beside_program, outdated
from rcilab.app.check.report_rows import count_unheeded
from rcilab.app.goal.goal import POSE_FIELDS
from rcilab.app.goal.goal_actions import QUATERNION
from rcilab.app.run.readiness import is_plan_current
from rcilab.app.text import Text
from rcilab.conformance.explain import explain_place
from rcilab.i18n.rounding import format_fixed
from rcilab.workbench.panels.jog import problems_html, reach_html
from rcilab.workbench.widgets import Ask, Html, NumberField, esc, shown_pose

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus


class TargetPanel:
    """Position in mm; orientation in degrees of roll, pitch, yaw, and as a quaternion."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls."""
        text, ask = self._text, self._ask
        gui.add_html(f'<p class="rl-note">{esc(text("target.note_watched" if state.watched else "target.note"))}</p>')
        self._fields: list[NumberField] = []
        with gui.add_folder(text("target.pose")):
            gui.add_html('<i class="rl-trios"></i>')
            for index, name in enumerate(POSE_FIELDS):
                box = gui.add_text(text(f"target.{name}"), "", hint=text("target.type_hint"))
                self._fields.append(NumberField(box, ask, f"pose.{name}", text.unit("mm" if index < 3 else "deg")))
            box = gui.add_text(text("target.wxyz"), "", hint=text("target.wxyz_hint"))
            self._wxyz = NumberField(box, ask, f"pose.{QUATERNION}")
        self._reach = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Follows the goal."""
        target = state.goal.target
        numbers: dict[str, str] = dict(zip(POSE_FIELDS, shown_pose(target), strict=True))
        labels: list[tuple[str, str]] = []
        for field in self._fields:
            name = field.field.partition(".")[2]
            field.show(numbers[name], state.problems.get(field.field), state.entered)
            labels.append((field.field, self._text(f"target.{name}")))
        wxyz = self._wxyz
        wxyz.show(quaternion_text(target.wxyz), state.problems.get(wxyz.field), state.entered)
        labels.append((wxyz.field, self._text("target.wxyz")))
        problems = problems_html(state, self._text, labels)
        is_violated = state.plan is not None and not state.plan.report.ok  # Shown here, too: the rest is further down.
        sentence = reach_html(state, self._text) + (planned_html(state, status, self._text) if is_violated else "")
        self._reach.show(f'<div class="rl-slot">{problems or sentence}</div>')  # A fixed height: nothing below moves.


def quaternion_text(wxyz: np.ndarray) -> str:
    """Returns the four numbers of an orientation for a field, with w not below 0."""
    sign = -1.0 if wxyz[0] < 0.0 else 1.0
    return " ".join(format_fixed(sign * float(number), 4) for number in wxyz)


def planned_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns one line about the plan: its duration and verdict, or why planning failed.

    Without a connection a plan gets no verdict: the next arm may be at another position.
    """
    if state.plan is None:
        return f'<p class="rl-note">{esc(text.render(state.no_plan)) if state.no_plan else ""}</p>'
    if not is_plan_current(state, status):
        return ""
    changed = outdated(state)
    if changed is not None:
        return f'<p class="rl-verdict rl-warn"><b>▲ {esc(text("check.outdated"))}</b> {esc(text.render(changed))}</p>'
    plan, report = state.plan, state.plan.report
    failed = "check.recorded" if plan.is_recorded else "check.failed"
    tone, word = ("good", "check.passed") if report.ok else ("bad", failed)
    code = "target.planned" if plan.kind == "joint" else f"target.planned.{plan.kind}"
    code = "target.recorded" if plan.is_recorded else code if plan.program is None else "program.planned"
    sentence = text(code, duration=f"{plan.motion.duration:.3f}")
    if plan.missed_by is not None:
        sentence = _with_sentence(sentence, text("target.leads_short", short=text.render(plan.missed_by)), text)
        tone, word = (tone, word) if not report.ok else ("warn", "target.not_there")
    if not report.ok:
        worst, more = report.violations[0], report.violated_conditions - 1
        sentence += " · " + text("scene.violated", condition=text(f"condition.{worst.condition.id}"))
        if worst.links is not None:
            place = explain_place(worst, text.language)
            sentence = text("target.where", violation=sentence, place=place, time=f"{worst.worst_time:.3f}")
        sentence += f" +{more}" if more else ""
    unheeded = count_unheeded(report) if report.ok else 0
    if unheeded:
        sentence += " · " + text("target.unheeded", count=unheeded)
    if plan.away:
        sentence = _with_sentence(sentence, text("target.elbow", away=plan.away), text)
    aside = beside_program(state)
    if aside is not None:
        tone, sentence = "warn" if report.ok else tone, _with_sentence(sentence, text.render(aside), text)
    if plan.note is not None:
        sentence = _with_sentence(sentence, text.render(plan.note), text)
    return f'<p class="rl-verdict rl-{tone}"><b>{esc(text(word))}</b> {esc(sentence)}</p>'


def _with_sentence(sentence: str, following: str, text: Text) -> str:
    """Returns a sentence, with or without its full stop, and the following one."""
    return sentence.rstrip(".。") + ("。" if text.language == "zh" else ". ") + following
