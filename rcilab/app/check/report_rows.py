"""A report on page and in notebook: tone, word and facts of a row."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rcilab.conformance.explain import explain_place
from rcilab.conformance.time_scaling import is_met_when_slower
from rcilab.i18n.condition_values import value_against_bound, with_unit

if TYPE_CHECKING:
    from rcilab.app.goal.goal import Tone
    from rcilab.conformance.report import ConditionResult, Report
    from rcilab.i18n.translator import Text

TIGHT = 0.95  # Share of a bound from which on a row is amber.


def count_unheeded(report: Report) -> int:
    """Returns how many recommended conditions are exceeded."""
    return sum(not row.ok for row in report.rows if row.necessity == "recommended")


def passed_sentence(report: Report, text: Text) -> str:
    """Returns what a report that passes says, and whether a slow-down meets the recommended conditions too."""
    unheeded = count_unheeded(report)
    if not unheeded:
        return text("check.passed_long")
    code = "check.passed_slower" if is_met_when_slower(report) else "check.passed_unheeded"
    return text(code, count=unheeded)


def row_tone(row: ConditionResult) -> Tone:
    """Returns good, warn (near a bound, or a recommendation that is not met) or bad."""
    if not row.ok:
        return "bad" if row.necessity == "necessary" else "warn"
    if row.start_excess:
        return "warn"
    return "warn" if row.ratio > TIGHT and row.condition.stage == "throughout" else "good"


def row_word(row: ConditionResult, text: Text) -> str:
    """Returns whether the condition holds, in a word."""
    tone = row_tone(row)
    if tone == "bad":
        return text("check.violated")
    if not row.ok:
        return text("check.below" if row.condition.is_clearance else "check.exceeded")
    return text("check.kept" if tone == "good" or row.start_excess else "check.tight")


def row_facts(row: ConditionResult, text: Text) -> list[str]:
    """Returns the worst value, where it is, and when."""
    value, bound = row.displayed
    if not math.isfinite(value):
        facts = [text("check.unknown")]
    elif row.condition.signal == "position" and value < 0.0:
        (number,) = text.units.format_numbers(row.unit, -value)
        facts = [text("check.inside", value=with_unit(number, row.unit, text))]
    elif row.limits is not None and row.has_share:
        low, high = row.limits
        numbers = text.units.format_numbers(row.unit, value, low, high, (low + high) / 2.0)
        worst, lowest, highest, middle = (with_unit(number, row.unit, text) for number in numbers)
        facts = [text("check.range", value=worst, low=lowest, high=highest, middle=middle)]
    elif bound:
        facts = [value_against_bound(value, bound, row.unit, text)]
    else:
        (number,) = text.units.format_numbers(row.unit, value)
        code = "check.above_zero" if row.condition.is_clearance else f"check.zero.{row.necessity}"
        facts = [text(code, value=with_unit(number, row.unit, text))]
    if row.links is not None:
        facts.append(explain_place(row, text.language))
    elif row.joint:
        facts.append(text("check.joint", joint=row.joint))
    elif row.start_excess:
        facts.append(text("check.led_in"))
    return [*facts, f"t = {row.time:.3f} s"]
