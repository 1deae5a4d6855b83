"""Why a controller refuses a request: the RCI answers with a number; its state and two queries give the reason."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from typing import Any, Final

from rcilab.core.errors import RcilabError
from rcilab.core.state import RobotMode, RobotState
from rcilab.makers.rokae import wire as rci


class Refusal(Enum):
    """The reason of a refusal; the value names its texts, `status.VALUE` of the catalogues."""

    ESTOP = "estop", "an emergency stop is pressed: release it first, then switch the power on"
    GSTOP = "gstop", "the safety gate is open: close it first, then switch the power on"
    FAULT = "fault", "a fault has stopped the arm: recover() clears it, or power_off() and power_on()"
    GUIDED = "guided", "the arm is guided by hand: end that first (stop_drag())"
    RECOVERING = "recovering", "an error recovery is in progress: try again when it is over"
    MOVING = "moving", "a motion is in progress: wait for its end, or stop it first"
    POWER_OFF = "power_off", "the motors are off: switch them on first (power_on())"

    def __init__(self, word: str, sentence: str) -> None:
        self.word: Final = word
        self.sentence: Final = sentence
        """Its name and remedy, in English."""


_BY_MODE = {
    RobotMode.GUIDING: Refusal.GUIDED,
    RobotMode.REFLEX: Refusal.FAULT,
    RobotMode.AUTOMATIC_ERROR_RECOVERY: Refusal.RECOVERING,
    RobotMode.MOVE: Refusal.MOVING,
}
_STOPS = {rci.SafetyStop.ESTOP: Refusal.ESTOP, rci.SafetyStop.GSTOP: Refusal.GSTOP}
_STILL = 1e-9  # [rad/s] Commanded velocity at standstill; more is a stop that is not over yet.


def find_refusal(ask: Callable[[rci.Request], Any], latest: Callable[[], RobotState | None]) -> Refusal | None:
    """Returns why a controller has just refused a request as not possible now; None if it is unknown.

    Args:
        ask: Sends a request and returns the answer.
        latest: Returns the newest state.
    """
    with suppress(RcilabError):  # The refusal itself matters more than an error of the queries.
        stop = _STOPS.get(ask(rci.GetSafetyStopState()).state)
        if stop is not None:
            return stop
        is_powered = bool(ask(rci.GetMotorState()).power)
        state = latest()
        if state is not None and state.robot_mode in _BY_MODE:
            return _BY_MODE[state.robot_mode]
        if not is_powered:
            return Refusal.POWER_OFF
        if state is not None and float(abs(state.dq_c).max()) > _STILL:
            return Refusal.MOVING
    return None
