"""The rows of the report as HTML: condition, necessity, worst value, bound, unit, source, joint, time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.app.check.report_rows import row_facts, row_tone, row_word
from rcilab.app.text import Text
from rcilab.conformance.explain import explain_formula, explain_source
from rcilab.workbench.widgets import esc

if TYPE_CHECKING:
    from rcilab.conformance.report import ConditionResult, Report
    from rcilab.model.robot_model import RobotModel

_MANY = 10.0  # From this share on, it is shown as a factor.
_ORDER = {"bad": 0, "warn": 1, "good": 2}
_SIGNS = {"good": "✓", "warn": "▲", "bad": "◆"}


def rows_html(report: Report, model: RobotModel, chosen: str, text: Text) -> str:
    """Returns all rows, violated and tight ones first; a click on a row shows its moment."""
    rows = sorted(report.rows, key=lambda row: (_ORDER[row_tone(row)], row.ok))
    return f'<div class="rl-cards rl-pick">{"".join(row_html(row, model, chosen, text) for row in rows)}</div>'


def row_html(row: ConditionResult, model: RobotModel, chosen: str, text: Text) -> str:
    """Returns one row."""
    condition, tone = row.condition, row_tone(row)
    facts = row_facts(row, text)
    if condition.signal == "torque":
        facts.append(load_words(model, text))
    name, fault = text(f"condition.{condition.id}"), ""
    if condition.fault is not None:
        fault = f"<br>{esc(text('check.raises', fault=condition.fault.manual_name))}"
    source = explain_source(condition, text.language)
    current = ' aria-current="true"' if condition.id == chosen else ""
    return (
        f'<div class="rl-card rl-{tone}" role="button" tabindex="0" data-condition="{esc(condition.id)}"{current} '
        f'title="{esc(text("check.row_hint"))}">'
        f'<div class="rl-line"><i class="rl-sign">{_SIGNS[tone]}</i><b>{esc(name)}</b>'
        f'<span class="rl-word">{esc(row_word(row, text))}</span><span class="rl-share">{_share(row)}</span></div>'
        f'<div class="rl-meter"><i style="width:{min(100.0, 100.0 * row.ratio):.1f}%"></i></div>'
        f'<div class="rl-facts"><span class="rl-badge">{esc(text("necessity." + condition.necessity))}</span> '
        f"{esc(' · '.join(facts))}</div>"
        f'<div class="rl-source">{esc(explain_formula(condition, text.language))} — {esc(source)}{fault}</div></div>'
    )


def _share(row: ConditionResult) -> str:
    if not row.has_share:
        return ""
    return f"{100.0 * row.ratio:.1f} %" if row.ratio < _MANY else f"{row.ratio:.0f} ×"


def load_words(model: RobotModel, text: Text) -> str:
    """Returns the load of the torques of a row."""
    mass = model.load.mass
    return text("check.load", mass=f"{mass:g}") if mass > 0.0 else text("check.no_load")
