"""A report as a small table for notebooks and pages."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.conformance.report import ConditionResult, Report

COLORS = {"ok": "#1a7f37", "advice": "#b26a00", "violated": "#c62828"}
"""Green, amber, red, each readable on white and on dark grey."""

_LISTED = 8
_CELL = 'style="text-align:left;white-space:nowrap;padding:2px 10px"'
_HEADINGS = ("", "condition", "worst", "bound", "used", "where", "t [s]", "source")


def report_html(report: Report) -> str:
    """Returns a table with one row a condition, then a sentence a violation."""
    verdict = "ok" if report.ok and not report.warnings else "advice" if report.ok else "violated"
    head = "".join(f"<th {_CELL}>{heading}</th>" for heading in _HEADINGS)
    body = "".join(_row(row) for row in report.rows)
    found = (*report.violations, *report.warnings)
    items = "".join(f"<li>{escape(str(violation))}</li>" for violation in found[:_LISTED])
    if len(found) > _LISTED:
        items += f"<li>… and {len(found) - _LISTED} more</li>"
    return (
        f'<div><b style="color:{COLORS[verdict]}">{escape(str(report).splitlines()[1])}</b>'
        f"<br>{escape(report.title)}"
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        + (f"<ul>{items}</ul>" if items else "")
        + "</div>"
    )


def _row(row: ConditionResult) -> str:
    value, bound, used = row.texts
    unit = escape(row.unit).replace("^2", "²").replace("^3", "³")
    name = f'<span title="{escape(row.condition.formula)}">{escape(row.condition.quantity)}</span>'
    if row.necessity == "recommended":
        name += " <i>(recommended)</i>"
    mark = f'<b style="color:{COLORS[row.verdict]}">{row.verdict}</b>'
    cells = (
        mark,
        name,
        f"{value} {unit}",
        f"{bound} {unit}",
        used,
        row.place,
        f"{row.time:.3f}",
        escape(row.source),
    )
    return "<tr>" + "".join(f"<td {_CELL}>{cell}</td>" for cell in cells) + "</tr>"
