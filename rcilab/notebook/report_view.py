"""The report of the plan: every condition, its worst value, its bound, its source."""

from __future__ import annotations

from rcilab.app.check.report_rows import passed_sentence, row_facts, row_tone, row_word
from rcilab.conformance.explain import explain_formula, explain_source, explain_violation
from rcilab.conformance.report import ConditionResult, Report
from rcilab.notebook.part import Part
from rcilab.notebook.style import block, esc, soft, verdict, write

_LISTED = 8


class ReportView(Part):
    """The verdict, the violations as sentences, then every condition as a bar against its bound.

    Args:
        subject: A model, a session, or another part of the same arm.
        report: A report to show; defaults to that of the plan.
        language: "en" or "zh"; defaults to that of a given part, else of the notebook.
    """

    def __init__(self, subject: object, report: Report | None = None, *, language: str | None = None) -> None:
        super().__init__(subject, language)
        self._own = report
        self._verdict, self._rows = block(), block()
        self.build([self._verdict, self._rows], min_width="360px")
        self.subscribe("plan", self._show)

    @property
    def report(self) -> Report | None:
        """The displayed report; None while there is no plan."""
        if self._own is not None:
            return self._own
        return None if self.state.now.plan is None else self.state.now.plan.report

    def _show(self) -> None:
        text, report = self.text, self.report
        if report is None:
            reason = self.state.now.no_plan
            write(
                self._verdict,
                soft(text("plan.none", button=text("target.plan")) if reason is None else text.render(reason)),
            )
            write(self._rows, "")
            return
        if report.ok:
            sentence = verdict("good", text("check.passed"), passed_sentence(report, text))
        else:
            failed = text("check.failed_long", conditions=report.violated_conditions, count=len(report.violations))
            sentence = verdict("bad", text("check.failed"), failed)
        plan = self.state.now.plan
        elbow = (
            soft(text("target.elbow", away=plan.away)) if self._own is None and plan is not None and plan.away else ""
        )
        write(self._verdict, sentence + soft(text("check.note")) + elbow)
        broken = "".join(
            f"<li>{esc(explain_violation(violation, text.language))}</li>" for violation in report.violations[:_LISTED]
        )
        cards = "".join(self._card(row) for row in sorted(report.rows, key=lambda row: (row.ok, -row.ratio)))
        write(self._rows, f'<div class="rl-scroll">{f"<ul>{broken}</ul>" if broken else ""}{cards}</div>')

    def _card(self, row: ConditionResult) -> str:
        text, condition, tone = self.text, row.condition, row_tone(row)
        share = f"{100.0 * row.ratio:.1f} %" if row.has_share else ""
        fault = "" if condition.fault is None else " · " + text("check.raises", fault=condition.fault.manual_name)
        formula, source = explain_formula(condition, text.language), explain_source(condition, text.language)
        return (
            f'<div class="rl-card rl-{tone}"><div class="rl-row"><b>{esc(text(f"condition.{condition.id}"))}</b>'
            f'<span class="rl-soft">{esc(text("necessity." + condition.necessity))}</span>'
            f'<span class="rl-push">{esc(row_word(row, text))}</span><span class="rl-num">{share}</span></div>'
            f'<div class="rl-meter"><i style="width:{min(100.0, 100.0 * row.ratio):.1f}%"></i></div>'
            f'<div class="rl-num">{esc(" · ".join(row_facts(row, text)))}</div>'
            f'<div class="rl-soft">{esc(formula)} — {esc(source + fault)}</div></div>'
        )
