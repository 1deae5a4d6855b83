"""The messages of page and notebook for errors, incidents and states: what happened and which button to press.

The sentences of the library are English and name Python calls. Page and notebook have texts of their own for these
keys, because their buttons differ.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rcilab.control_process.launch import START_TIMEOUT
from rcilab.control_process.process_supervisor import ANSWER_TIMEOUT
from rcilab.core.errors import (
    CertificateError,
    ConnectionLostError,
    ControlError,
    InvalidValueError,
    RcilabError,
    UsageError,
)
from rcilab.core.fault import FaultCode, name_faults
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import LiteralText, Message, Text, message

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus

FAILED_STARTS = ("crashed.slow_start", "crashed.no_start")
"""States without a robot to reconnect."""
_CRASHES = ("crashed.controller", "crashed.worker", "crashed.frozen", *FAILED_STARTS)
_PHASES = {
    **{code: f"phase.{code}" for code in _CRASHES}, "moving.held": "phase.held", "moving.guided": "phase.guided",
    "fault.released": "phase.released", "lost.rebooted": "phase.rebooted", "watched.idle": "phase.watched",
    "watched.moving": "phase.watched_moving", "watched.lost": "phase.watched_lost",
}  # fmt: skip
"""States that have a text of their own instead of that of their phase."""
_SAFETY_STOPS = {"fault.pressed": "ready.pressed", "fault.released": "ready.released"}
_LOST = ("lost.silent", "lost.unreachable", "lost.closed", "lost.other_arm", "lost.rebooted")


class StartingError(UsageError):
    """A request to the control process before it has started."""


def explain_error(error: RcilabError, status: SupervisorStatus | None = None) -> Message:
    """Returns the message for an error.

    Args:
        error: The error.
        status: Status of the robot, if the error came from there.
    """
    if isinstance(error, StartingError):
        return message("ready.starting")
    if isinstance(error, ControlError) and error.faults and not error.code:
        return message("notice.fault", faults=name_faults(error.faults))
    if isinstance(error, InvalidValueError) and error.name == "address":
        return message("address.bad", typed=str(error.value))
    if isinstance(error, CertificateError):
        return message("notice.stale")
    if isinstance(error, ConnectionLostError) and status is not None:
        known = status.code in (*_CRASHES, *_LOST) or status.incident is None
        return _describe_loss(status.code if known or status.incident is None else status.incident.code, status)
    return message("notice.error", text=describe_error(error))


def describe_incident(code: str, sentence: str, status: SupervisorStatus) -> Message:
    """Returns the message for an incident of the supervisor."""
    if code in _SAFETY_STOPS:
        return message(_SAFETY_STOPS[code])
    if code == "fault":
        return message("notice.fault", faults=name_faults(status.faults))
    if code in _CRASHES or code in _LOST:
        return _describe_loss(code, status)
    return message("notice.plain", text=LiteralText(sentence))


def describe_status(status: SupervisorStatus) -> Message:
    """Returns what the robot is doing, as one message."""
    if status.code in _SAFETY_STOPS:
        return message(_SAFETY_STOPS[status.code])
    if status.code == "fault":
        return message("ready.fault_of", faults=name_faults(status.faults))
    if status.code in _CRASHES or status.code in _LOST:
        return _describe_loss(status.code, status)
    return message(phase_code(status))


def describe_success(status: SupervisorStatus) -> Message:
    """Returns the share of commands in time; the controller keeps that of the last motion until the next one.

    Before the first motion it is the controller's initial number, which has no meaning.
    """
    is_moving = status.phase in ("moving", "stopping")
    if not is_moving and status.motion_time is None:
        return message("health.success_none")
    code = "health.success_now" if is_moving else "health.success_last"
    share = math.floor(1000.0 * status.success_rate + 1e-9) / 10.0  # Rounded down: 100.0 % is all of them.
    return message(code, share=f"{share:.1f}")


def health_values(status: SupervisorStatus, text: Text) -> dict[str, str]:
    """Returns mode, power, network and timing, by the ends of the keys of their names."""
    mode, control, late = status.robot_mode, status.controller_mode, status.lateness
    return {
        "mode": "—" if mode is None else text(f"robot_mode.{mode.name}"),
        "control": "—" if control is None else text(f"controller_mode.{control.name}"),
        "power": {None: "—", True: text("run.on"), False: text("run.off")}[status.powered],
        "success": text.render(describe_success(status)),
        "rate": f"{status.rate_hz:.0f} Hz",
        "late": text("run.late_value", late=status.late_cycles, lost=status.lost_cycles, cycles=late.cycles),
        "lateness": f"{late.p50:.0f} / {late.p99:.0f} / {late.p999:.0f} / {late.max:.0f} µs",
        "scheduling": text(f"scheduling.{status.scheduling}"),
    }


def phase_code(status: SupervisorStatus) -> str:
    """Returns the key of the short name of the robot's status."""
    if status.phase in ("idle", "fault") and status.is_pressed:
        return "phase.pressed"
    if status.phase == "idle" and status.powered is False:
        return "phase.unpowered"
    return _PHASES.get(status.code, f"phase.{status.phase}")


def _describe_loss(code: str, status: SupervisorStatus) -> Message:
    """Returns what was lost, and what to press; the message for our own controller does not mention a cable."""
    if code in _CRASHES:
        return message(f"incident.{code}", seconds=f"{START_TIMEOUT:g}", next=message(_what_follows(status)))
    if code == "lost.other_arm":
        return message("incident.lost.other_arm", address=status.target)
    if status.target == "virtual":
        return message("incident.lost.rebooted_virtual" if code == "lost.rebooted" else "incident.lost.virtual")
    known = code if code in _LOST else "lost.unreachable"
    return message(f"incident.{known}", address=status.target, seconds=f"{ANSWER_TIMEOUT:g}")


def _what_follows(status: SupervisorStatus) -> str:
    """Returns the key of what happens after the end of one of our processes."""
    if status.incident is not None and status.incident.is_restarted:
        return "incident.again"
    return "incident.choose" if status.phase == "closed" else "incident.press"


def describe_remedy(fault: FaultCode, text: Text) -> str:
    """Returns the remedy for a fault; "" if its maker gives none."""
    key = next((key for key in (f"remedy.{fault.key}", f"remedy.{fault.maker}") if text.has(key)), None)
    return "" if key is None else f"{text('run.remedy')} {text(key)}"
