"""Check: the pre-flight report in the controller's own terms, before anything moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcilab.workbench.setup.wanted import name_parts
from rcilab.workbench.text import Text
from rcilab.workbench.widgets import Ask, Html, esc

if TYPE_CHECKING:
    from rcilab.conformance import Report
    from rcilab.supervisor import SupervisorStatus
    from rcilab.workbench.store import UiState

_AMBER = {True: "check.exceeded", False: "check.tight"}
_TIGHT = 0.95  # A choice: from this share of a bound on, a row is amber.


class CheckPanel:
    """Every condition with its worst value, bound, joint, time and source."""

    def __init__(self, text: Text, ask: Ask) -> None:
        del ask
        self._text = text
        self._drawn: tuple[Report, tuple[str, ...]] | None = None

    def build(self, gui: Any, state: UiState) -> None:
        """Adds the report."""
        self._verdict = Html(gui)
        self._table = Html(gui)

    def show(self, state: UiState, status: SupervisorStatus) -> None:
        """Draws the report of the current plan."""
        text = self._text
        if state.plan is None:
            self._drawn = None
            reason = text.say(state.no_plan) if state.no_plan else text("check.nothing")
            self._verdict.show(f'<p class="rl-note">{esc(reason)}</p>')
            self._table.show("")
            return
        stale = state.plan.stale_parts(state.model, state.setup.wanted.box)
        report = state.plan.report
        if (report, stale) == self._drawn:
            return
        self._drawn = report, stale
        unheeded = sum(not row.ok for row in report.rows if row.condition.necessity == "recommended")
        if report.ok:
            code = "check.passed_unheeded" if unheeded else "check.passed_long"
            headline = ("good", "check.passed", text(code, count=unheeded))
        else:
            headline = ("bad", "check.failed", text("check.failed_long", count=len(report.violations)))
        if stale:
            headline = ("warn", "setup.stale", text("setup.stale_why", what=text.say(name_parts(stale))))
        tone, word, rest = headline
        self._verdict.show(
            f'<p class="rl-verdict rl-{tone} rl-big"><b>{esc(text(word))}</b> {esc(rest)}</p>'
            f'<p class="rl-note">{esc(text("check.note"))}</p>'
        )
        rows = "".join(self._row(row) for row in report.rows)
        from rcilab.conformance.explain import explain_violation

        language = "zh" if text.language == "zh" else "en"
        sentences = "".join(
            f"<li>{esc(explain_violation(violation, language))}</li>" for violation in report.violations[:8]
        )
        self._table.show(
            f'<div class="rl-cards">{rows}</div>' + (f'<ul class="rl-list">{sentences}</ul>' if sentences else "")
        )

    def _row(self, row: Any) -> str:
        text, condition = self._text, row.condition
        broken = not row.ok
        tone = (
            ("bad" if condition.necessity == "necessary" else "warn")
            if broken
            else "warn"
            if row.ratio > _TIGHT
            else "good"
        )
        word = text("check.kept" if tone == "good" else "check.broken" if tone == "bad" else _AMBER[broken])
        name = text(f"condition.{condition.id}")
        width = min(100.0, 100.0 * row.ratio)
        facts = [f"{_number(row.value)} / {_number(row.bound)} {pretty_unit(condition.unit)}"]
        facts += [text("check.joint", joint=row.joint)] if row.joint else []
        if row.links is not None:
            from rcilab.conformance.explain import explain_place

            facts.append(explain_place(row, "zh" if text.language == "zh" else "en"))
        facts.append(f"t = {row.time:.3f} s")
        fault = "" if condition.fault is None else f"<br>{esc(text('check.raises', fault=condition.fault.manual_name))}"
        return (
            f'<div class="rl-card rl-{tone}"><div class="rl-line"><b>{esc(name)}</b>'
            f'<span class="rl-badge">{esc(text("necessity." + condition.necessity))}</span>'
            f'<span class="rl-word">{esc(word)}</span><span class="rl-share">{100.0 * row.ratio:.1f} %</span></div>'
            f'<div class="rl-meter"><i style="width:{width:.1f}%"></i></div>'
            f'<div class="rl-facts">{esc(" · ".join(facts))}</div>'
            f'<div class="rl-source">{esc(condition.formula)} — {esc(condition.source)}{fault}</div></div>'
        )


def pretty_unit(unit: str) -> str:
    """Returns a unit with raised digits."""
    return unit.replace("^2", "²").replace("^3", "³")


def _number(value: float) -> str:
    size = abs(value)
    return f"{value:.0f}" if size >= 1000.0 else f"{value:.4g}" if size >= 1e-3 or size == 0.0 else f"{value:.1e}"
