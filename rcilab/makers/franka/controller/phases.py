"""The phases of the robot, and the effect of each request and event in them: one table, pure.

    IDLE -> MOVING -> STOPPING -> IDLE
    IDLE <-> GUIDING            any of them -> REFLEX -> RECOVERING -> IDLE
                                any of them <-> USER_STOPPED

In every phase except for MOVING and GUIDING the arm stops if it still moves, and stays at standstill.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from rcilab.core.state import RobotMode
from rcilab.makers.franka.wire.versions import Status


class Phase(Enum):
    """The phase of the robot; the value is the robot mode in its state."""

    IDLE = (RobotMode.IDLE, 0)
    """Stationary, ready for a motion."""
    MOVING = (RobotMode.MOVE, 0)
    """Commands are followed."""
    STOPPING = (RobotMode.MOVE, 1)
    """The motion was ended; the arm stops."""
    GUIDING = (RobotMode.GUIDING, 0)
    """Guided by hand."""
    REFLEX = (RobotMode.REFLEX, 0)
    """An error stopped the arm."""
    USER_STOPPED = (RobotMode.USER_STOPPED, 0)
    """The user stop is pressed."""
    RECOVERING = (RobotMode.AUTOMATIC_ERROR_RECOVERY, 0)
    """Errors are being cleared."""

    def __init__(self, robot_mode: RobotMode, _number: int) -> None:
        self.robot_mode: Final = robot_mode
        """The mode in the state in this phase."""


IN_MOTION: Final = (Phase.MOVING, Phase.STOPPING)

MOVE_REFUSALS: Final = {
    Phase.MOVING: Status.NOT_POSSIBLE,
    Phase.STOPPING: Status.NOT_POSSIBLE,
    Phase.GUIDING: Status.NOT_POSSIBLE,
    Phase.REFLEX: Status.NOT_POSSIBLE,
    Phase.USER_STOPPED: Status.NOT_POSSIBLE,
    Phase.RECOVERING: Status.NOT_POSSIBLE,
}
"""The status of a Move that is refused, by the phase."""

STOP_STATUSES: Final = {
    Phase.IDLE: Status.SUCCESS,
    Phase.MOVING: Status.SUCCESS,
    Phase.STOPPING: Status.SUCCESS,
    Phase.GUIDING: Status.NOT_POSSIBLE,
    Phase.REFLEX: Status.SUCCESS,
    Phase.USER_STOPPED: Status.EMERGENCY_ABORTED,
    Phase.RECOVERING: Status.NOT_POSSIBLE,
}
"""The status of a StopMove, by the phase."""

RECOVERY_REFUSALS: Final = {
    Phase.MOVING: Status.NOT_POSSIBLE,
    Phase.STOPPING: Status.NOT_POSSIBLE,
    Phase.GUIDING: Status.NOT_POSSIBLE,
    Phase.USER_STOPPED: Status.EMERGENCY_ABORTED,
    Phase.RECOVERING: Status.NOT_POSSIBLE,
}
"""The status of an AutomaticErrorRecovery that is refused, by the phase."""

SETTABLE: Final = (Phase.IDLE, Phase.GUIDING, Phase.REFLEX, Phase.USER_STOPPED)
"""Phases in which a setter takes effect; in the others it is not possible."""

REASONS: Final = {
    Phase.MOVING: "a motion is in progress",
    Phase.STOPPING: "the arm still stops",
    Phase.GUIDING: "the arm is guided by hand",
    Phase.REFLEX: "an error stopped the arm: recover first",
    Phase.USER_STOPPED: "the user stop is pressed: release it",
    Phase.RECOVERING: "an error recovery is in progress",
}
"""Why a request is refused in a phase."""
