"""Hand guiding: the controller starts it on request and may end it by itself."""

from __future__ import annotations

from typing import get_args

from rcilab.core.errors import InvalidValueError
from rcilab.core.state import RobotMode, RobotState
from rcilab.makers.driver import Driver, GuideKind, GuideSpace


def require_guidable(space: object, kind: object) -> None:
    """Requires a valid space and kind of guiding.

    Raises:
        InvalidValueError: The space or the kind does not exist; the message lists those that do.
    """
    if space not in get_args(GuideSpace):
        raise InvalidValueError("space", space, f"is unknown; known: {', '.join(get_args(GuideSpace))}")
    if kind not in get_args(GuideKind):
        raise InvalidValueError("kind", kind, f"is unknown; known: {', '.join(get_args(GuideKind))}")


class HandGuide:
    """Hand guiding from its start to its end. Owned by the driver's thread.

    Args:
        driver: The connection.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._was_seen = False

    def start(self, space: GuideSpace, kind: GuideKind) -> None:
        """Starts hand guiding.

        Raises:
            CommandRejectedError: The controller refuses.
        """
        self._driver.start_guiding(space, kind)

    def stop(self) -> None:
        """Ends hand guiding; returns once the arm is stationary."""
        self._driver.stop_guiding()

    def has_ended(self, state: RobotState) -> bool:
        """Returns whether the controller has ended guiding by itself: a fault, an emergency stop, power off.

        States that were sent before guiding began do not count.
        """
        guided = state.robot_mode is RobotMode.GUIDING
        self._was_seen |= guided
        return (self._was_seen and not guided) or bool(state.faults)
