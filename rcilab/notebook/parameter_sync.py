"""The parameters of the modes between the fields and the robot: told, acknowledged or refused, as the page does it."""

from __future__ import annotations

import math
import time

from rcilab.app.run.mode_parameters import SECOND_THOUGHT, ask_to_send, is_control_pending, with_number
from rcilab.control_process.status_messages import tell_error
from rcilab.core.errors import RcilabError, UsageError
from rcilab.i18n.translator import Message
from rcilab.makers.configuration import ControlPart
from rcilab.makers.rokae.driver.controller_parameters import standard_control
from rcilab.notebook.robot_side import RobotBackend
from rcilab.notebook.state import LabState


class ParameterSync:
    """Our own controller is told at once, a foreign one when asked for twice. Used by kernel and watching thread.

    Args:
        state: What the parts share.
    """

    def __init__(self, state: LabState) -> None:
        self._state = state
        self._is_under_way = False
        self._asked_to_send = -math.inf

    def set_number(self, part: ControlPart, place: int, value: float) -> None:
        """Wants another number. A session is told the part it belongs to only: it may have been set up by a cell."""
        state, limits = self._state, self._state.model.limits
        with state.lock:
            before = state.now.drive.control
            if before is None and state.session is None:
                before = standard_control(limits)
            state.set_drive(control=with_number(before, part, place, value, limits), refusal=None)
            state.tell("robot")

    def reset(self) -> None:
        """Wants what a controller wakes up with."""
        state = self._state
        with state.lock:
            state.set_drive(control=standard_control(state.model.limits), refusal=None)
            state.tell("robot")

    def press_send(self, robot: RobotBackend) -> Message | None:
        """Tells a controller that is not ours, at the second press; returns the question at the first."""
        now = time.monotonic()
        if now - self._asked_to_send > SECOND_THOUGHT:
            self._asked_to_send = now
            return ask_to_send(robot.name)
        self._asked_to_send = -math.inf
        self._state.set_drive(refusal=None)
        self._send(robot)
        return None

    def tick(self, robot: RobotBackend) -> None:
        """Tells our own controller what is new."""
        status = robot.status()
        if robot.is_virtual and self._state.now.drive.refusal is None and status.phase == "idle":
            self._send(robot)

    def take(self, error: RcilabError | None) -> None:
        """Takes note of the answer."""
        self._is_under_way = False
        if error is not None:
            self._state.set_drive(refusal=tell_error(error))

    def forget(self) -> None:
        """Expects no answer any more: another robot comes."""
        self._is_under_way = False
        self._state.set_drive(refusal=None)

    def _send(self, robot: RobotBackend) -> None:
        control = self._state.now.drive.control
        if self._is_under_way or control is None or not is_control_pending(control, robot.status().setup.control):
            return
        self._is_under_way = True
        try:
            robot.set_control(control)
        except UsageError as error:
            self.take(None if robot.is_virtual else error)  # Something else is under way: at one of the next looks.
        except RcilabError as error:
            self.take(error)
