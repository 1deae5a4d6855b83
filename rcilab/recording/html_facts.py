"""What the exported page says of a run in its two tables, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.recording.run import Run
    from rcilab.words.text import Text


def error_rows(run: Run, text: Text) -> list[list[str]]:
    """Returns how far joints and tool were from the plan: where, RMS and largest."""
    tracking, units = run.tracking, text.units
    pairs = zip(tracking.joint_rms, tracking.joint_max, strict=True)
    rows = [[f"J{j}", *(units.angle_of(value, 4) for value in pair)] for j, pair in enumerate(pairs, start=1)]
    if run.model is not None:
        away = [units.length_of(value, 3) for value in (tracking.position_rms, tracking.position_max)]
        turn = [units.angle_of(value, 4) for value in (tracking.rotation_rms, tracking.rotation_max)]
        rows += [[text("table.tool"), *away], [text("table.turn"), *turn]]
    return rows


def fact_rows(run: Run, text: Text) -> list[list[str]]:
    """Returns when, where and how it went: a name and what there is to say."""
    setup, report = run.setup, run.report
    rows = [
        ("started", setup.started),
        ("target", " · ".join(part for part in (setup.target, setup.plant, setup.mode) if part)),
        ("duration", text("facts.cycles", duration=run.duration, cycles=len(run.cycles))),
        ("ended", _ended(run, text)),
        ("health", _health(run, text)),
        ("delay", text("facts.delay_cycles", delay=run.delay)),
    ]
    if report is not None:
        verdict = text("facts.violates", count=len(report.violations))
        if report.ok:
            verdict = text("facts.conforms", share=100.0 * report.worst.ratio, id=report.worst.id)
        rows.append(("check", verdict))
    return [[text(f"facts.{name}"), said] for name, said in rows if said]


def _ended(run: Run, text: Text) -> str:
    if run.faults:
        return text("facts.faulted", faults=", ".join(fault.manual_name for fault in run.faults))
    if not run.is_complete:
        return text("facts.cut")
    return text("facts.stopped", why=run.stopped) if run.stopped else text("facts.goal")


def _health(run: Run, text: Text) -> str:
    timing = run.timing
    if not run.realtime:
        return text("facts.lockstep", lost=timing.lost)
    return text("facts.timing", lost=timing.lost, late=timing.late, p99=timing.lateness_p99 * 1e6)
