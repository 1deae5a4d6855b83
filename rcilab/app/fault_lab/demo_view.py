"""An exhibit as page and notebook show it: the same words in the same order; each brings its own style sheet."""

from __future__ import annotations

import math
import re
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from rcilab.conformance.explain import explain_formula, explain_source
from rcilab.core.arrays import Array
from rcilab.i18n.condition_values import unit_name, with_unit
from rcilab.i18n.error_messages import describe_note

if TYPE_CHECKING:
    from rcilab.app.fault_lab.fault_demo import FaultDemo
    from rcilab.i18n.translator import Text

_NEAR = 0.5  # Share of the lower bound from which on it is shown: a far one would press the curve flat.


def head_html(exhibit: FaultDemo, text: Text) -> str:
    """Returns which fault it is, what was done, and what broke which bound."""
    row = exhibit.condition
    others = [fault.manual_name for fault in exhibit.reported if fault is not exhibit.fault]
    also = f" {text('learn.also', faults=', '.join(others))}" if others else ""
    value, bound = text.units.format_numbers(row.unit, exhibit.value, exhibit.bound)
    unit = unit_name(row.unit, text)
    facts = text(
        "learn.number", value=value, bound=with_unit(bound, row.unit, text),
        time=f"{exhibit.time:.3f}", sample=exhibit.sample,
    )  # fmt: skip
    sent = exhibit.describe("sent", text.language, text.units)
    place = text("check.joint", joint=exhibit.signal.axis) + " · " if exhibit.signal.axis else ""
    return (
        f'<p class="rl-verdict rl-bad rl-big"><b>◆ {_breakable(exhibit.fault.manual_name)}</b> '
        f"{escape(text('learn.reported', number=exhibit.fault.value))}{escape(also)}</p>"
        f'<p class="rl-note"><b>{escape(text("learn.done"))}</b> {escape(sent)}</p>'
        f'<div class="rl-plot-title">{escape(text(f"condition.{row.id}"))} [{escape(unit or "1")}]</div>'
        f'<p class="rl-note rl-under">{escape(place)}{escape(facts)}</p>'
    )


def body_html(exhibit: FaultDemo, text: Text) -> str:
    """Returns legend, cause, remedy, condition and the way out."""
    language, row = text.language, exhibit.condition
    steps = "".join(f"<li>{escape(step)}</li>" for step in exhibit.tell_way_out(language))
    executed = f'<span class="rl-dim">{escape(text("learn.executed"))}</span>'
    legend = "".join(
        f'<span class="rl-sign-{sign}">{escape(text(f"learn.legend.{sign}"))}</span>' for sign in ("limit", "fault")
    )
    source, manual = explain_source(row, language), f"manual.{exhibit.fault.maker}"
    rows = (
        ("learn.cause", escape(exhibit.describe("explanation", language, text.units))),
        ("learn.remedy", escape(exhibit.describe("prevention", language, text.units))),
        (
            "learn.condition",
            f"{escape(explain_formula(row, language))}<br><span class='rl-dim'>{escape(source)}</span>",
        ),
        *((("learn.manual", escape(text(manual, number=exhibit.fault.value))),) if text.has(manual) else ()),
        ("learn.way_out", f'<ol class="rl-steps-out">{steps}</ol>{executed}'),
        ("learn.said", f"<code>{escape(text.render(describe_note(exhibit.said)))}</code>"),
    )
    table = "".join(f"<tr><th>{escape(text(key))}</th><td>{cell}</td></tr>" for key, cell in rows)
    return f'<div class="rl-legend">{legend}</div><table class="rl-table rl-facts-table rl-exhibit">{table}</table>'


def seen_lower(values: Array, lower: float) -> float:
    """Returns the bound below where the curve comes near it, else NaN: it is not drawn.

    Args:
        values: What a condition bounds, shape (N,).
        lower: Its bound below.
    """
    least = float(np.nanmin(np.where(np.isfinite(values), values, np.nan)))
    return lower if math.isfinite(lower) and least < _NEAR * lower else math.nan


def _breakable(name: str) -> str:
    """Returns a name that may be broken before every word in it."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "<wbr>", escape(name))
