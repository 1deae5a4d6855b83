"""Table of facts of a run on the exported page: when, where and how it ran."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rcilab.core.cycle_log import state_cycles
from rcilab.core.error_base import plain_text
from rcilab.core.fault import name_faults
from rcilab.core.state import COMPLIANT_MODES
from rcilab.i18n.error_messages import describe_note

if TYPE_CHECKING:
    from rcilab.i18n.translator import Text
    from rcilab.recording.run import Run


def fact_rows(run: Run, text: Text) -> list[list[str]]:
    """Returns the rows of the table: name and text."""
    setup, report, period = run.setup, run.report, state_cycles(run.cycles)
    rows = [
        ("started", setup.started),
        ("target", " · ".join(part for part in (setup.target, setup.plant, setup.motion_kind) if part)),
        ("duration", text("facts.cycles", duration=run.duration, cycles=len(run.cycles), period=period)),
        ("ended", _ended(run, text)),
        ("health", _health(run, text)),
        ("delay", text("facts.delay_cycles", delay=run.delay)),
    ]
    if report is not None:
        verdict = text("facts.violates", count=len(report.violations))
        if report.ok:
            verdict = text("facts.conforms", share=100.0 * report.worst.ratio, id=report.worst.id)
        rows.append(("check", verdict))
    return [[text(f"facts.{name}"), plain_text(value)] for name, value in rows if value]


def describe_stop(stopped: str, faults: Iterable[object], text: Text) -> str:
    """Returns why a motion was stopped before its end, and the faults as which a safety stop was reported.

    Args:
        stopped: Value of `Run.stopped`.
        faults: Faults that the controller reported.
        text: Language of the user.
    """
    why, names = text.render(describe_note(stopped)), name_faults(faults)
    return text("stop.reported", why=why, faults=names) if names else why


def describe_goal(run: Run, text: Text) -> str:
    """Returns where a run that was not stopped ended: at its goal, next to it, or at the last command of a callback."""
    if run.missed_goal is not None:
        joint, angle = run.missed_goal
        is_compliant = run.setup.mode in COMPLIANT_MODES
        return text("run.yielded" if is_compliant else "run.missed_goal", joint=joint, angle=angle)
    return text("facts.goal" if run.plan is not None else "facts.last")


def _ended(run: Run, text: Text) -> str:
    if run.is_safety_stop:
        return text("facts.stopped", why=describe_stop(run.stopped or "", run.faults, text))
    if run.faults:
        return text("facts.faulted", faults=name_faults(run.faults))
    if not run.is_complete:
        return text("facts.damaged" if run.is_damaged else "facts.cut")
    if not run.stopped:
        return describe_goal(run, text)
    return text("facts.stopped", why=describe_stop(run.stopped or "", run.faults, text))


def _health(run: Run, text: Text) -> str:
    timing = run.timing
    if not run.realtime:
        return text("facts.lockstep", lost=timing.lost)
    health = text("facts.timing", lost=timing.lost, late=timing.late)
    return health if timing.lateness_p99 is None else health + text("facts.p99", p99=timing.lateness_p99 * 1e6)
