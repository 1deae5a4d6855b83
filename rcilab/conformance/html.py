"""A report as an HTML table, for notebooks."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from rcilab.conformance.catalogue import Language, translate
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

_MAX_LISTED = 8
_TEXT_CELL = 'style="text-align:left;padding:2px 6px"'
_CELL = 'style="text-align:left;white-space:nowrap;padding:2px 6px"'
_TEXT_COLUMNS = (1, 5, 7)  # They may wrap, so that the table fits a notebook at 1280 px.
_HEADINGS = ("condition", "worst", "bound", "used", "where", "time", "source")


def report_html(report: Report, language: Language = "en") -> str:
    """Returns a table with one row per condition, then a sentence per violation.

    Raises:
        InvalidValueError: The language is unknown.
    """
    verdict = "ok" if report.ok and not report.warnings else "advice" if report.ok else "violated"
    headings = ("", *(translate(language, f"html.{heading}") for heading in _HEADINGS))
    head = "".join(f"<th {_CELL}>{heading}</th>" for heading in headings)
    body = "".join(_row(row, language) for row in report.rows)
    is_english = language == "en"
    headline = str(report).splitlines()[1] if is_english else explain_verdict(report, language)
    found = (*report.violations, *report.warnings)
    sentences = [str(item) if is_english else explain_violation(item, language) for item in found[:_MAX_LISTED]]
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    if len(found) > _MAX_LISTED:
        items += f"<li>{translate(language, 'html.more', count=str(len(found) - _MAX_LISTED))}</li>"
    return (
        f'<div><b style="color:{COLORS[verdict]}">{escape(headline)}</b>'
        f"<br>{escape(report.title.text(language))}"
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        + (f"<ul>{items}</ul>" if items else "")
        + "</div>"
    )


def _row(row: ConditionResult, language: Language) -> str:
    value, bound, used = row.texts
    place, quantity = row.location, row.condition.quantity  # In English as short as in `print(report)`.
    if language != "en":
        place, quantity = explain_place(row, language), explain_quantity(row.condition, language)
    unit = escape(row.unit).replace("^2", "²").replace("^3", "³")
    name = f'<span title="{escape(explain_formula(row.condition, language))}">{escape(quantity)}</span>'
    if row.necessity == "recommended":
        name += f" <i>{translate(language, 'html.recommended')}</i>"
    mark = f'<b style="color:{COLORS[row.verdict]}">{translate(language, f"html.{row.verdict}")}</b>'
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
    styles = [_TEXT_CELL if column in _TEXT_COLUMNS else _CELL for column in range(len(cells))]
    return "<tr>" + "".join(f"<td {style}>{cell}</td>" for style, cell in zip(styles, cells, strict=True)) + "</tr>"
