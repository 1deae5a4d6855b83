"""The pace of a notebook's robot, from the parts to the robot."""

from __future__ import annotations

from rcilab.control_process.requested_speed import RequestedSpeed, is_running, tell_pace_refusal
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import Message
from rcilab.notebook.robot_side import RobotBackend
from rcilab.notebook.state import LabState


class SpeedOverride:
    """Holds a motion under way, goes on with it, slows it down. Used by kernel and watching thread.

    Args:
        state: What the parts share.
    """

    def __init__(self, state: LabState) -> None:
        self._state = state
        self._wish = RequestedSpeed()
        self._asked: float | None = None  # What the robot was asked for and has not taken yet.
        self._was_running = False
        self.refusal: Message | None = None
        """Why the motion goes on as it is."""

    def choose(self, pace: float) -> None:
        """Wants motions to run at part of their planned speed; one that is held keeps waiting."""
        with self._state.lock:
            self._state.set_drive(pace=pace)
            self._wish.choose(pace, self._state.status)
            self._state.tell("robot")

    def pause(self) -> None:
        """Holds the motion under way."""
        with self._state.lock:
            self._wish.hold()

    def resume(self) -> None:
        """Goes on with a motion that is held."""
        with self._state.lock:
            self._wish.go_on(self._state.now.drive.pace)

    def tick(self, robot: RobotBackend) -> None:
        """Hands over what is wanted now."""
        status = robot.status()
        running, before = is_running(status), self._was_running
        self._was_running = running
        if running and not before:
            self.refusal = None
        with self._state.lock:
            pace = self._wish.due(status, is_under_way=self._asked is not None)
        if pace is None:
            return
        self.refusal, self._asked = None, pace
        try:
            robot.set_pace(pace)
        except RcilabError as error:
            self.take(error)

    def take(self, error: RcilabError | None) -> None:
        """Takes note of what became of a change."""
        pace, self._asked = self._asked, None
        if error is not None and pace is not None:
            self.refusal = tell_pace_refusal(error, pace, self._state.status)

    def forget(self) -> None:
        """Expects nothing any more: another robot comes."""
        self._wish.forget()
        self._asked, self._was_running, self.refusal = None, False, None
