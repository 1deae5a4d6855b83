"""A report as a small table for notebooks and pages."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from rcilab.conformance.catalogue import Language, say
from rcilab.conformance.explain import (
    explain_formula,
    explain_place,
    explain_quantity,
    explain_source,
    explain_verdict,
    explain_violation,
)

if TYPE_CHECKING:
    from rcilab.conformance.report import ConditionResult, Report

COLORS = {"ok": "#1a7f37", "advice": "#b26a00", "violated": "#c62828"}
"""Green, amber, red, each readable on white and on dark grey."""

_LISTED = 8
_WORDS = 'style="text-align:left;padding:2px 6px"'
_CELL = 'style="text-align:left;white-space:nowrap;padding:2px 6px"'
_WRAPPED = (1, 5, 7)  # Columns of words, which may take a second line: a notebook at 1280 px shows the whole table.
_HEADINGS = ("condition", "worst", "bound", "used", "where", "time", "source")


def report_html(report: Report, language: Language = "en") -> str:
    """Returns a table with one row a condition, then a sentence a violation.

    Raises:
        InvalidValueError: There is no such language.
    """
    verdict = "ok" if report.ok and not report.warnings else "advice" if report.ok else "violated"
    headings = ("", *(say(language, f"html.{heading}") for heading in _HEADINGS))
    head = "".join(f"<th {_CELL}>{heading}</th>" for heading in headings)
    body = "".join(_row(row, language) for row in report.rows)
    is_english = language == "en"
    headline = str(report).splitlines()[1] if is_english else explain_verdict(report, language)
    found = (*report.violations, *report.warnings)
    sentences = [str(item) if is_english else explain_violation(item, language) for item in found[:_LISTED]]
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    if len(found) > _LISTED:
        items += f"<li>{say(language, 'html.more', count=str(len(found) - _LISTED))}</li>"
    return (
        f'<div><b style="color:{COLORS[verdict]}">{escape(headline)}</b>'
        f"<br>{escape(report.title.text(language))}"
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        + (f"<ul>{items}</ul>" if items else "")
        + "</div>"
    )


def _row(row: ConditionResult, language: Language) -> str:
    value, bound, used = row.texts
    place, quantity = row.place, row.condition.quantity  # In English as short as in `print(report)`.
    if language != "en":
        place, quantity = explain_place(row, language), explain_quantity(row.condition, language)
    unit = escape(row.unit).replace("^2", "²").replace("^3", "³")
    name = f'<span title="{escape(explain_formula(row.condition, language))}">{escape(quantity)}</span>'
    if row.necessity == "recommended":
        name += f" <i>{say(language, 'html.recommended')}</i>"
    mark = f'<b style="color:{COLORS[row.verdict]}">{say(language, f"html.{row.verdict}")}</b>'
    cells = (
        mark,
        name,
        f"{value} {unit}",
        f"{bound} {unit}",
        used,
        place,
        f"{row.time:.3f}",
        escape(explain_source(row.condition, language)),
    )
    styles = [_WORDS if column in _WRAPPED else _CELL for column in range(len(cells))]
    return "<tr>" + "".join(f"<td {style}>{cell}</td>" for style, cell in zip(styles, cells, strict=True)) + "</tr>"
