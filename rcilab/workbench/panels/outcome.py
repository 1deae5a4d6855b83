"""The progress of a motion and the result of the last one: shown next to Execute, without scrolling."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rcilab.app.run.drive_state import destination
from rcilab.app.text import Text
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.cycle_log import state_cycles
from rcilab.core.fault import name_faults
from rcilab.i18n.error_messages import describe_note
from rcilab.i18n.translator import Remark
from rcilab.makers.maker import capabilities_of
from rcilab.recording.html_facts import describe_goal, describe_stop
from rcilab.workbench.widgets import esc, esc_names

if TYPE_CHECKING:
    from rcilab.app.run.recording import Recording
    from rcilab.app.store import UiState
    from rcilab.control_process import SupervisorStatus
    from rcilab.recording.run import Run


def progress_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns the progress of a motion, or of the planning of a program, as a bar; nothing without either."""
    if state.program.progress is not None:
        return _bar(state.program.progress)
    if status.code not in ("moving", "moving.held") or status.motion_plan_time is None or not status.motion_duration:
        return ""
    sentence = text(
        "run.way", place=f"{status.motion_plan_time:.1f}", speed_override=f"{100.0 * status.speed_override:.0f}"
    )
    if status.code == "moving.held":
        sentence = text("run.held", place=f"{status.motion_plan_time:.1f}")
    if status.awaited is not None:
        names = capabilities_of(state.model).inputs
        sentence = text("program.waiting", signal=names[status.awaited])
    duration = status.motion_duration if state.plan is None else state.plan.motion.duration
    share = min(max(status.motion_plan_time / duration, 0.0), 1.0)
    return f'<p class="rl-note" role="status">{esc(sentence)}</p>{_bar(share)}'


def _bar(share: float) -> str:
    return f'<div class="rl-meter rl-way"><i style="width:{100.0 * share:.0f}%"></i></div>'


def outcome_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns the result of the last motion; nothing before the first one.

    It is a plain note if it is not about the current robot, and then names the robot that it is about.
    """
    recording = state.recording if state.recording is not None else state.last_run
    if recording is None or recording.run is None:
        return ""
    if state.watched and recording is not state.last_run:  # In progress, or its end is being checked.
        return ""
    tone, ended, facts = _outcome(recording, text)
    elsewhere = _elsewhere(recording.run, state, status, text)
    if elsewhere:
        return f'<p class="rl-note">{esc(text("record.last_on", where=elsewhere))} {esc(ended)} {esc(facts)}</p>'
    last = "" if recording is state.recording else esc(text("record.last")) + " "
    finding = recording.finding or _reported_stop(recording.run)
    finding = finding and f"<br>{esc(text.render(describe_note(finding)))}"
    return f'<p class="rl-verdict rl-{tone}">{last}<b>{esc_names(ended)}</b> {esc(facts)}{finding or ""}</p>'


def replay_html(state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns the recorded run that is shown without a connection: its arm, its time, and how it ended; else ""."""
    recording = state.recording
    if status.phase != "closed" or recording is None or recording.run is None:
        return ""
    run = recording.run
    made = run.setup
    where = text(f"where.{made.plant}") if made.target == "virtual" and made.plant else made.target
    when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(made.started_ns * 1e-9)) if made.started_ns else ""
    facts = " · ".join(filter(None, ("" if run.model is None else run.model.name, when, where)))
    tone, ended, _ = _outcome(recording, text)
    is_said = run.stopped is None or run.faults or run.is_safety_stop
    reason = "" if is_said else _describe_stop(run, text)
    why = reason and f"<br><small>{esc(reason)}</small>"
    return f'<p class="rl-verdict rl-{tone}"><b>{esc(text("record.replay"))}</b> {esc(facts)}<br>{esc(ended)}{why}</p>'


def _describe_stop(run: Run, text: Text) -> str:
    return describe_stop(run.stopped or "", run.faults, text)


def _reported_stop(run: Run) -> Remark | None:
    """Returns the first reason that a virtual controller recorded for the stop of its client's motion."""
    return run.stopped.parts[0] if run.has_playout and isinstance(run.stopped, Remark) else None


def _elsewhere(run: Run, state: UiState, status: SupervisorStatus, text: Text) -> str:
    """Returns where a run was made, and with which arm, if that is not the current destination; else ""."""
    made, arm = run.setup, state.model.name if run.model is None else run.model.name
    here = state.plant if state.target == "virtual" else state.target
    there = made.plant if made.target == "virtual" else made.target
    if there in ("", here) and arm == state.model.name and destination(state, status) != "preview":
        return ""
    where = text(f"where.{there}") if made.target == "virtual" and there else there
    return " · ".join(filter(None, (where, arm)))


def _outcome(recording: Recording, text: Text) -> tuple[str, str, str]:
    run = recording.run
    assert run is not None
    lost = run.timing.lost
    facts = text("record.facts", duration=f"{run.duration:.3f}", cycles=len(run.t), lost=lost)
    rows = len(run.t) + (0 if run.has_playout else lost)  # A play-out has rows of the cycles without a command.
    missing = round(float(run.t.max(initial=0.0)) / (CYCLE_TIME * state_cycles(run.cycles))) + 1 - rows
    if missing > 0:
        facts += " " + text("record.missing", count=missing)
    moment = "" if recording.moment is None else f"{recording.moment - run.begin:.3f}"
    if run.is_safety_stop:
        moment = moment or f"{run.duration:.3f}"  # A stop need not set an error bit.
        return "bad", text("record.safety_stop", moment=moment, why=_describe_stop(run, text)), facts
    if run.faults:
        faults = name_faults(run.faults)
        return "bad", text("record.faulted", faults=faults, moment=moment), facts
    if not run.is_complete:
        return "warn", text("record.damaged" if run.is_damaged else "record.cut"), facts
    if run.stopped:
        return "warn", text("record.operator_absent" if recording.is_operator_absent else "record.stopped"), facts
    if run.missed_goal is not None:
        return "warn", describe_goal(run, text), facts
    return "good", text("record.arrived"), facts
