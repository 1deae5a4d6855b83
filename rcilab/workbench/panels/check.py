"""Check: the report on every condition, before anything moves."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from rcilab.app.check.check_actions import PressCheck
from rcilab.app.check.freshness import beside_program, outdated
from rcilab.app.check.report_rows import passed_sentence
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.readiness import is_plan_current
from rcilab.app.text import Text
from rcilab.conformance.free_elbow import leaves_elbow_free
from rcilab.conformance.time_scaling import can_slow_down_help
from rcilab.i18n.translator import Message, with_space
from rcilab.workbench.panels.check_rows import rows_html
from rcilab.workbench.widgets import Ask, Html, esc, on_press

if TYPE_CHECKING:
    from rcilab.app.planning import Plan
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus

_MOMENT = 0.5  # [s] Longer jobs show a progress bar and Cancel.


class CheckPanel:
    """Verdict, slow-down, explanation; every condition with its worst value, bound, joint, time and source."""

    def __init__(self, text: Text, ask: Ask) -> None:
        self._text, self._ask = text, ask
        self._drawn: tuple[object, ...] = ()
        self._began = 0.0

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the controls and the report."""
        text, ask = self._text, self._ask
        self._verdict = Html(gui)
        self._again = gui.add_button(text("check.again"), icon="refresh", visible=False, hint=text("setup.check_hint"))
        on_press(self._again, ask, lambda page: PressCheck(page=page, what="again"))
        self._tools = gui.add_folder(text("check.tools"))
        with self._tools:
            gui.add_html('<i class="rl-buttons rl-bare"></i>')
            self._slow = gui.add_button(text("check.slow"), icon="gauge", hint=text("check.slow_hint"))
            on_press(self._slow, ask, lambda page: PressCheck(page=page, what="slow"))
            self._undo = gui.add_button(
                text("check.undo"), icon="arrow-back-up", color="gray", hint=text("check.undo_hint"), disabled=True
            )
            on_press(self._undo, ask, lambda page: PressCheck(page=page, what="undo"))
            self._explain = gui.add_button(
                text("check.explain"), icon="message-2", color="gray", hint=text("check.explain_hint")
            )
            on_press(self._explain, ask, lambda page: PressCheck(page=page, what="explain"))
            self._cancel = gui.add_button(text("check.cancel"), icon="x", color="gray", visible=False)
            on_press(self._cancel, ask, lambda page: PressCheck(page=page, what="cancel"))
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._answer = Html(gui)
        self._table = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Draws the report of the current plan."""
        plan, check, now = state.plan, state.check, time.monotonic()
        planning = state.program.progress  # A program is checked during its planning, which takes longest.
        busy = check.doing is not None or planning is not None
        self._began = self._began if busy else now
        self._bar.visible = busy and now - self._began > _MOMENT
        self._bar.value = round(100.0 * (check.progress if planning is None else planning), 1)
        self._cancel.visible = busy
        self._undo.disabled = check.slowed is None or busy
        changed = outdated(state)
        self._again.visible = changed is not None and not busy
        # What a client commanded is not changed here.
        is_fixed = plan is None or plan.is_recorded or not can_slow_down_help(plan.report)
        self._slow.disabled = is_fixed or busy or changed is not None or is_moving(status)
        self._explain.disabled = plan is None or busy
        if self._tools.visible is (plan is None):
            self._tools.visible = plan is not None
        aside = beside_program(state)
        is_current = is_plan_current(state, status)
        wanted = (plan, changed, aside, is_current, check.answer, check.explained, check.row, state.no_plan)
        if wanted == self._drawn:
            return
        self._drawn = wanted
        if plan is None:
            reason = self._text.render(state.no_plan) if state.no_plan else self._text("check.nothing")
            self._verdict.show(f'<p class="rl-note">{esc(reason)}</p>')
            self._answer.show("")
            self._table.show("")
            return
        self._verdict.show(self._headline(plan, changed, aside, is_current=is_current))
        self._answer.show(self._answers(state, plan))
        self._table.show(rows_html(plan.report, plan.model, check.row, self._text))

    def _headline(self, plan: Plan, changed: Message | None, aside: Message | None, *, is_current: bool) -> str:
        text, report = self._text, plan.report
        if changed is not None:
            headline = ("warn", "▲ ", "check.outdated", text.render(changed))
        elif report.ok and not is_current:
            headline = ("warn", "▲ ", "check.unconnected", text("check.unconnected_long"))
        elif report.ok:
            headline = ("good", "", "check.passed", passed_sentence(report, text))
        else:
            made = "check.recorded" if plan.is_recorded else "check.failed"
            sentence = text(f"{made}_long", conditions=report.violated_conditions, count=len(report.violations))
            headline = ("bad", "", made, sentence)
        tone, sign, word, rest = headline
        note = text("check.note") if plan.complete else text("check.incomplete")
        if leaves_elbow_free(plan.model, plan.mode) and not plan.is_recorded:
            note = "".join(with_space(note, text("check.free_elbow", away=plan.away)))
        if aside is not None:
            tone, rest = "warn" if report.ok else tone, f"{rest} {text.render(aside)}"
        lead, rest = with_space(sign + text(word), rest)
        return (
            f'<p class="rl-verdict rl-{tone} rl-big"><b>{esc(lead)}</b>{esc(rest)}</p>'
            f'<p class="rl-note">{esc(note)}</p>'
        )

    def _answers(self, state: UiState, plan: Plan) -> str:
        """Returns the result of the slow-down, and the report in sentences, if they are about this plan."""
        check, sentence = state.check, ""
        if check.answer is not None and check.about is plan.report:
            answer = esc(self._text.render(check.answer))
            if check.found is not None:
                answer += f" {esc(check.found.explain(self._text.language))}"
            sentence += f'<p class="rl-verdict rl-{check.tone}" role="status">{answer}</p>'
        if check.explained is not None and check.explained[0] is plan.report:
            report, slowed = check.explained
            first, *rest = report.explain(self._text.language, self._text.units, slowed=slowed).splitlines()
            lines = "".join(f"<li>{esc(line.removeprefix('- '))}</li>" for line in rest)
            sentence += f'<div class="rl-words"><p>{esc(first)}</p><ul class="rl-list">{lines}</ul></div>'
        return sentence
