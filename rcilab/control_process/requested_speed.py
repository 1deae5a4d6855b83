"""A pace between the controls and the robot: handed over once the last change was taken."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import PlanningError, RcilabError
from rcilab.i18n.translator import Message, message

if TYPE_CHECKING:
    from rcilab.control_process.status import SupervisorStatus

_SAME_PACE = 1e-3


class RequestedSpeed:
    """The part of its planned speed that somebody wants a motion to run at; of a slider's many only the newest counts.

    Used by one thread, or under a lock.
    """

    def __init__(self) -> None:
        self._wish: float | None = None

    def choose(self, pace: float, status: SupervisorStatus | None) -> None:
        """Wants a pace for the motion under way; one that is held keeps waiting."""
        if is_running(status) and status is not None and status.code == "moving":
            self._wish = pace

    def hold(self) -> None:
        """Wants the motion to be held."""
        self._wish = 0.0

    def go_on(self, pace: float) -> None:
        """Wants a motion that is held to go on at a pace."""
        self._wish = pace

    def due(self, status: SupervisorStatus, *, is_under_way: bool) -> float | None:
        """Returns the pace that the robot is to be asked for now, if any; to be called several times a second.

        Args:
            status: How the robot stands.
            is_under_way: Whether the last change has not been taken yet; what is wanted meanwhile waits.
        """
        if is_under_way:
            return None
        wish, self._wish = self._wish, None
        return None if wish is None or not is_running(status) or abs(wish - status.pace) < _SAME_PACE else wish

    def forget(self) -> None:
        """Wants nothing any more: another robot comes."""
        self._wish = None


def is_running(status: SupervisorStatus | None) -> bool:
    """Returns whether a motion is under way whose pace can change."""
    return status is not None and status.code in ("moving", "moving.held") and status.motion_duration is not None


def tell_pace_refusal(error: RcilabError, pace: float, status: SupervisorStatus | None) -> Message | None:
    """Returns why a motion goes on as it is; None where it has ended meanwhile.

    Args:
        error: What the change came to.
        pace: What was wanted; 0 is to be held.
        status: How the robot stands.
    """
    if isinstance(error, PlanningError):
        return message("pace.no_pause" if pace == 0.0 else "pace.no_change")
    return message("pace.late") if is_running(status) else None
