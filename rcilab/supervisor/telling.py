"""What errors, incidents and states of the library are called on page and in notebook: what happened, what to press.

The library's own sentences advise Python calls, in English; none of them belongs there. Each face has its own words
for these keys, because each has its own buttons.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.errors import (
    CertificateError,
    CommandRejectedError,
    ConnectionLostError,
    ControlError,
    InvalidValueError,
    RcilabError,
    UnreachableError,
)
from rcilab.faults import Fault
from rcilab.posing.reach import why_not
from rcilab.words.text import Message, message

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rcilab.supervisor import SupervisorStatus

_CRASHES = ("crashed.controller", "crashed.worker", "crashed.frozen")
_LOST = ("lost.silent", "lost.unreachable", "lost.other_arm")


def tell_error(error: RcilabError, status: SupervisorStatus | None = None) -> Message:
    """Returns the sentence for an error.

    Args:
        error: What went wrong.
        status: How the robot side stands, where the error came from there.
    """
    if isinstance(error, ControlError) and error.faults:
        return message("notice.fault", faults=name_faults(error.faults))
    if isinstance(error, InvalidValueError) and error.name == "address":
        return message("address.bad", typed=str(error.value))
    if isinstance(error, CertificateError):
        return message("notice.stale")
    if isinstance(error, CommandRejectedError):
        name = getattr(error.status, "name", None)
        if name is not None:  # Else it came in another way than by a status of the manual's.
            return message("error.rejected", command=error.command, why=message(f"status.{name}"))
    if isinstance(error, UnreachableError) and hasattr(error, "distance"):
        return why_not(error)
    if isinstance(error, ConnectionLostError) and status is not None:
        known = status.code in (*_CRASHES, *_LOST) or status.incident is None
        return _tell_loss(status.code if known or status.incident is None else status.incident.code, status)
    return message("notice.plain", text=str(error))


def tell_incident(code: str, sentence: str, status: SupervisorStatus) -> Message:
    """Returns the sentence for an incident of the supervisor."""
    if code == "fault":
        return message("notice.fault", faults=name_faults(status.faults))
    if code in _CRASHES or code in _LOST:
        return _tell_loss(code, status)
    return message("notice.plain", text=sentence)


def tell_status(status: SupervisorStatus) -> Message:
    """Returns what the robot side is doing, in one sentence."""
    if status.code == "fault":
        return message("ready.fault_of", faults=name_faults(status.faults))
    if status.code in _CRASHES or status.code in _LOST:
        return _tell_loss(status.code, status)
    return message(f"phase.{status.phase}")


def phase_code(status: SupervisorStatus) -> str:
    """Returns the key of the two or three words for what the robot side is doing."""
    return f"phase.{status.code}" if status.code in _CRASHES else f"phase.{status.phase}"


def name_faults(faults: Iterable[object]) -> str:
    """Returns faults as the manual prints them: their one name everywhere."""
    return ", ".join(fault.manual_name for fault in faults if isinstance(fault, Fault))


def _tell_loss(code: str, status: SupervisorStatus) -> Message:
    """Returns what has gone, of whom, and what to press; a lost connection to our own controller names no cable."""
    if code in _CRASHES:
        pid = status.controller_pid if code == "crashed.controller" else status.worker_pid
        return message(f"incident.{code}", next=message("incident.again" if pid is not None else "incident.press"))
    if code == "lost.other_arm":
        return message("incident.lost.other_arm", address=status.target)
    if status.target == "virtual":
        return message("incident.lost.virtual")
    known = code if code in _LOST else "lost.unreachable"
    from rcilab.supervisor.keeper import ANSWER_TIMEOUT

    return message(f"incident.{known}", address=status.target, seconds=f"{ANSWER_TIMEOUT:g}")
