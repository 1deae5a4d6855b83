"""A demo as HTML for page and notebook: the same text in the same order; each has its own style sheet."""

from __future__ import annotations

import math
import re
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from rcilab.conformance.explain import explain_formula, explain_source
from rcilab.core.arrays import Array
from rcilab.core.cycle_log import state_cycles
from rcilab.i18n.condition_values import unit_name, with_unit
from rcilab.i18n.error_messages import describe_note

if TYPE_CHECKING:
    from rcilab.app.fault_lab.fault_demo import FaultDemo
    from rcilab.app.fault_lab.signals import FaultSignal
    from rcilab.core.condition import Condition
    from rcilab.i18n.locale import Language
    from rcilab.i18n.translator import Text

AFTER_FAULT = 0.06  # Part of the recorded time that the curve continues after the fault, so that its mark is complete.
MARGIN = 0.12  # Part of the height above and below the curve.
_NEAR = 0.5  # Share of the lower bound from which on it is shown: a distant bound would flatten the curve.


def head_html(demo: FaultDemo, text: Text) -> str:
    """Returns the fault, what was sent, and which bound it violated."""
    others = [fault.manual_name for fault in demo.reported if fault is not demo.fault]
    also = f" {text('learn.also', faults=', '.join(others))}" if others else ""
    sent = demo.describe("sent", text.language, text.units)
    key = f"fault.{demo.fault.key}"
    reported = (
        text("learn.reported_name", name=text(key) if text.has(key) else demo.fault.cause)
        if re.search(r"\d", demo.fault.manual_name)  # The maker names it by its number.
        else text("learn.reported", number=demo.fault.value)
    )
    return (
        f'<p class="rl-verdict rl-bad rl-big"><b>◆ {_breakable(demo.fault.manual_name)}</b> '
        f"{escape(reported)}{escape(also)}</p>"
        f'<p class="rl-note"><b>{escape(text("learn.done"))}</b> {escape(sent)}</p>'
        f"{'' if demo.signal is None else _signal_html(demo, demo.signal, text)}"
    )


def _signal_html(demo: FaultDemo, signal: FaultSignal, text: Text) -> str:
    """Returns the title of the curve, the value and its bound."""
    row = signal.condition
    value, bound = text.units.format_numbers(row.unit, signal.value, signal.bound)
    unit = unit_name(row.unit, text)
    by_clock = state_cycles(demo.cycles) > 1  # The record has not every cycle of the controller.
    facts = text(
        ("learn.number_recorded" if signal.has_curve else "learn.number_reported") if by_clock else "learn.number",
        value=value, bound=with_unit(bound, row.unit, text), time=f"{demo.time:.3f}", sample=demo.cycle,
    )  # fmt: skip
    place = text("check.joint", joint=signal.axis) + " · " if signal.axis else ""
    return (
        f'<div class="rl-plot-title">{escape(text(f"condition.{row.id}"))} [{escape(unit or "1")}]</div>'
        f'<p class="rl-note rl-under">{escape(place)}{escape(facts)}</p>'
    )


def body_html(demo: FaultDemo, text: Text) -> str:
    """Returns legend, cause, remedy, condition and recovery."""
    language = text.language
    steps = "".join(f"<li>{escape(step)}</li>" for step in demo.recovery_steps(language))
    executed = f'<span class="rl-dim">{escape(text("learn.executed"))}</span>'
    legend = "".join(
        f'<span class="rl-sign-{sign}">{escape(text(f"learn.legend.{sign}"))}</span>' for sign in ("limit", "fault")
    )
    manual = f"manual.{demo.fault.maker}"
    rows = (
        ("learn.cause", escape(demo.describe("explanation", language, text.units))),
        ("learn.remedy", escape(demo.describe("prevention", language, text.units))),
        *(() if demo.condition is None else (("learn.condition", _condition_html(demo.condition, language)),)),
        *((("learn.manual", escape(text(manual, number=demo.fault.value))),) if text.has(manual) else ()),
        ("learn.way_out", f'<ol class="rl-steps-out">{steps}</ol>{executed}'),
        ("learn.said", f"<code>{escape(text.render(describe_note(demo.sentence)))}</code>"),
    )
    table = "".join(f"<tr><th>{escape(text(key))}</th><td>{cell}</td></tr>" for key, cell in rows)
    shown = f'<div class="rl-legend">{legend}</div>' if demo.signal is not None and demo.signal.has_curve else ""
    return f'{shown}<table class="rl-table rl-facts-table rl-demo">{table}</table>'


def _condition_html(row: Condition, language: Language) -> str:
    source = escape(explain_source(row, language))
    return f"{escape(explain_formula(row, language))}<br><span class='rl-dim'>{source}</span>"


def seen_lower(values: Array, lower: Array) -> Array:
    """Returns the lower bound if the curve comes near it, else NaN: it is not drawn.

    Args:
        values: Values of the bounded quantity, shape (N,).
        lower: Its lower bound, shape (N,).
    """
    least, nearest = float(np.nanmin(np.where(np.isfinite(values), values, np.nan))), float(lower.max())
    is_near = math.isfinite(nearest) and least < _NEAR * nearest
    return lower if is_near else np.full(len(lower), math.nan)


def _breakable(name: str) -> str:
    """Returns a name with a possible line break before each of its words."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "<wbr>", escape(name))
