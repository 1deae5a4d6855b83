"""Texts about the robot on Run: its status, its timing, the result of requests."""

from __future__ import annotations

import numpy as np

from rcilab.app.run.robot_requests import Outcome
from rcilab.app.session_connection import BusyError
from rcilab.app.status_text import describe_status, explain_error, health_values, phase_code
from rcilab.control_process import SupervisorStatus
from rcilab.core.errors import SAFETY_STOP, ControlError, RcilabError
from rcilab.i18n.error_messages import describe_note
from rcilab.i18n.translator import Message, Text, message
from rcilab.notebook.style import head, table, verdict
from rcilab.recording.html_facts import describe_goal, describe_stop
from rcilab.recording.run import describe_end

_OF_CYCLES = ("late", "lateness", "scheduling")  # Shown once there are cycles.


def name_phase(status: SupervisorStatus | None, text: Text) -> str:
    """Returns the short name of the robot's status."""
    if status is None:
        return text("phase.closed")
    return text(phase_code(status))


def describe_trouble(status: SupervisorStatus | None, text: Text) -> str:
    """Returns why the connection to the robot is lost; empty if it is not."""
    return "" if status is None or status.phase not in ("lost", "crashed") else text.render(describe_status(status))


def describe_refusal(error: RcilabError, status: SupervisorStatus | None = None) -> Message:
    """Returns why a request failed."""
    if isinstance(error, BusyError):
        return message("robot.busy", what=message(f"what.{error.in_progress}"))
    return explain_error(error, status)


def health_html(status: SupervisorStatus, text: Text) -> str:
    """Returns mode, power, network and timing, as the controller reports them."""
    rows = health_values(status, text).items()
    shown = [
        [text(f"health.{name}"), value] for name, value in rows if status.lateness.cycles or name not in _OF_CYCLES
    ]
    return head(text("run.health")) + table([], shown)


def outcome_html(outcome: Outcome, status: SupervisorStatus | None, text: Text, *, is_page_gone: bool = False) -> str:
    """Returns the result of a request.

    Args:
        outcome: The result.
        status: Status of the robot.
        text: The catalogue.
        is_page_gone: Whether the motion was stopped because the page is closed.
    """
    error, run = outcome.error, outcome.run
    stopped = verdict("warn", "▲", text("run.page_gone" if is_page_gone else "run.stopped"))
    if isinstance(error, ControlError) and error.code == SAFETY_STOP:
        why = describe_stop(describe_end(error), error.faults, text)
        return verdict("bad", "✗", text("run.safety_stop", why=why))
    if error is not None:
        faults = ", ".join(getattr(fault, "manual_name", str(fault)) for fault in getattr(error, "faults", ()))
        if faults:
            finding = error.finding if isinstance(error, ControlError) else ""
            found = f" {text.render(describe_note(finding))}" if finding else ""
            return verdict("bad", "✗", text("run.faulted", faults=faults) + found)
        if outcome.what == "execute":
            return stopped
        why = message("notice.failed", what=message(f"what.{outcome.what}"), error=describe_refusal(error, status))
        return verdict("bad", "✗", text.render(why))
    if run is not None and run.stopped:
        return stopped
    if run is not None and run.missed_goal is not None:
        return verdict("warn", "▲", describe_goal(run, text))
    if run is not None and len(run.q):
        largest = float(np.abs(np.nan_to_num(run.error)).max())
        return verdict("good", "✓", text("run.arrived", duration=run.duration, error=largest))
    return ""
