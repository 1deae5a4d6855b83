"""What errors, incidents and states of the library are called on the page: see `control_process.status_messages`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.app.text import Message, message
from rcilab.control_process import status_messages as telling
from rcilab.control_process.status_messages import phase_code, tell_incident, tell_status
from rcilab.core.errors import RcilabError, UsageError
from rcilab.core.fault import name_faults

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus

__all__ = ["StartingError", "name_faults", "phase_code", "tell_error", "tell_incident", "tell_status"]


class StartingError(UsageError):
    """Something was asked of the control process before it was there."""


def tell_error(error: RcilabError, status: SupervisorStatus | None = None) -> Message:
    """Returns the sentence of the page for an error.

    Args:
        error: What went wrong.
        status: How the robot side stands, where the error came from there.
    """
    if isinstance(error, StartingError):
        return message("ready.starting")
    return telling.tell_error(error, status)
