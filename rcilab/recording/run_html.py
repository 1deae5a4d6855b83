"""HTML table of a run for notebooks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING

from rcilab.core.error_base import plain_text
from rcilab.core.fault import name_faults
from rcilab.i18n.catalogue import load_catalogue
from rcilab.i18n.error_messages import describe_note
from rcilab.i18n.locale import require_language
from rcilab.i18n.translator import Text
from rcilab.recording.html_facts import describe_goal

if TYPE_CHECKING:
    from rcilab.recording.run import Run


def _error(run: Run, words: Mapping[str, str]) -> str:
    """Returns the largest error; of a stopped run, also the time until which it was compared."""
    deviation, stop = f"{math.degrees(run.largest_error):.3g} deg", run.stop_time
    return deviation if stop is None or run.plan is None else words["card.until"].format(error=deviation, time=stop)


def run_html(run: Run, language: str = "en") -> str:
    """Returns a table with duration, end, largest error and timing of a run.

    Raises:
        InvalidValueError: The language is unknown.
    """
    words, timing = load_catalogue("rcilab.recording", require_language(language)), run.timing
    ended = words["card.fault" if run.faults else "card.goal"]
    text = Text(language, "rcilab.recording")
    if run.stopped:
        ended = text.render(describe_note(run.stopped))
    elif run.missed_goal is not None:
        ended = describe_goal(run, text)
    rows = [
        ("duration", words["card.cycles"].format(duration=run.duration, cycles=len(run.cycles))),
        ("ended", ended),
        ("faults", name_faults(run.faults) or words["card.none"]),
        ("error", _error(run, words)),
        ("success", f"{float(run.success_rate[-1]):.3f}" if len(run.cycles) else "-"),
        ("lost", f"{timing.lost}"),
    ]
    times = [1e6 * t for t in (timing.lateness_median, timing.lateness_p99, timing.lateness_max) if t is not None]
    if run.realtime and times:
        median, p99, largest = times
        rows.append(("late", words["card.lateness"].format(median=median, p99=p99, max=largest)))
    elif not run.realtime:
        rows.append(("timing", words["card.lockstep"]))
    cells = "".join(
        f"<tr><th style='text-align:left'>{words[f'card.{name}']}</th><td>{escape(plain_text(value))}</td></tr>"
        for name, value in rows
    )
    return f"<table><caption>{words['card.title']}</caption>{cells}</table>"
