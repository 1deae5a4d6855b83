"""A pace between the controls and the robot: handed over once the last change was taken, as the page does it."""

from __future__ import annotations

from rcilab.errors import PlanningError, RcilabError
from rcilab.notebook.robot_side import RobotSide
from rcilab.notebook.state import LabState
from rcilab.supervisor import SupervisorStatus
from rcilab.words.text import Message, message

_SAME_PACE = 1e-3


class PaceDesk:
    """Holds a motion under way, goes on with it, slows it down. Used by kernel and watching thread.

    Args:
        state: What the parts share.
    """

    def __init__(self, state: LabState) -> None:
        self._state = state
        self._wish: float | None = None  # A pace that waits until the last change was taken.
        self._is_under_way = False
        self._was_running = False
        self.refusal: Message | None = None
        """Why the motion goes on as it is."""

    def choose(self, pace: float) -> None:
        """Wants motions to run at part of their planned speed; one that is held keeps waiting."""
        with self._state.lock:
            self._state.pace = pace
            status = self._state.status
            if status is not None and is_running(status) and status.code == "moving":
                self._wish = pace
            self._state.tell("robot")

    def pause(self) -> None:
        """Holds the motion under way."""
        with self._state.lock:
            self._wish = 0.0

    def resume(self) -> None:
        """Goes on with a motion that is held."""
        with self._state.lock:
            self._wish = self._state.pace

    def tick(self, robot: RobotSide) -> None:
        """Hands over what is wanted now; of a slider's many only the newest counts."""
        status = robot.status()
        running, before = is_running(status), self._was_running
        self._was_running = running
        with self._state.lock:
            if running and not before:
                self.refusal = None
                if self._wish is None and self._state.pace < 1.0:
                    self._wish = self._state.pace
            if self._is_under_way:
                return
            wish, self._wish = self._wish, None
        if wish is None or not running or abs(wish - status.pace) < _SAME_PACE:
            return
        self.refusal, self._is_under_way = None, True
        try:
            robot.set_pace(wish)
        except PlanningError:
            self._is_under_way = False
            self.refusal = message("pace.no_pause" if wish == 0.0 else "pace.no_change")
        except RcilabError as error:
            self.take(error)

    def take(self, error: RcilabError | None) -> None:
        """Takes note of what became of a change."""
        self._is_under_way = False
        if error is not None and is_running(self._state.status):
            self.refusal = message("pace.late")

    def forget(self) -> None:
        """Expects nothing any more: another robot comes."""
        self._wish, self._is_under_way, self._was_running, self.refusal = None, False, False, None


def is_running(status: SupervisorStatus | None) -> bool:
    """Returns whether a motion is under way whose pace can change."""
    return status is not None and status.code in ("moving", "moving.held") and status.motion_duration is not None
