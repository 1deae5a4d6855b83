"""A speed override between the controls and the robot: sent once the last change was accepted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import PlanningError, RcilabError
from rcilab.i18n.translator import Message, message

if TYPE_CHECKING:
    from rcilab.control_process.status import SupervisorStatus

_SAME_OVERRIDE = 1e-3


class RequestedSpeed:
    """The speed override that the operator wants for a motion; only the newest of a slider's values is sent.

    Used by one thread, or under a lock.
    """

    def __init__(self) -> None:
        self._requested: float | None = None

    def choose(self, speed_override: float, status: SupervisorStatus | None) -> None:
        """Requests a speed override for the motion in progress; a paused motion stays paused."""
        if is_running(status) and status is not None and status.code == "moving":
            self._requested = speed_override

    def hold(self) -> None:
        """Requests that the motion is paused."""
        self._requested = 0.0

    def go_on(self, speed_override: float) -> None:
        """Requests that a paused motion continues with a speed override."""
        self._requested = speed_override

    def due(self, status: SupervisorStatus, *, is_pending: bool) -> float | None:
        """Returns the speed override to send to the robot now, if any; call it several times a second.

        Args:
            status: Status of the robot.
            is_pending: Whether the last change is not accepted yet; a newer value waits.
        """
        if is_pending:
            return None
        requested, self._requested = self._requested, None
        return (
            None
            if requested is None or not is_running(status) or abs(requested - status.speed_override) < _SAME_OVERRIDE
            else requested
        )

    def forget(self) -> None:
        """Drops the value: another robot is connected."""
        self._requested = None


def is_running(status: SupervisorStatus | None) -> bool:
    """Returns whether a motion is in progress whose speed override can change."""
    return status is not None and status.code in ("moving", "moving.held") and status.motion_duration is not None


def describe_override_refusal(
    error: RcilabError, speed_override: float, status: SupervisorStatus | None
) -> Message | None:
    """Returns why a motion continues unchanged; None if it has ended meanwhile.

    Args:
        error: Why the change failed.
        speed_override: The requested speed override; 0 pauses the motion.
        status: Status of the robot.
    """
    if isinstance(error, PlanningError):
        return message("speed_override.no_pause" if speed_override == 0.0 else "speed_override.no_change")
    return message("speed_override.late") if is_running(status) else None
