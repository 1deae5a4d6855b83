"""Hand guiding through the control process: it asks the controller for it and notices when the controller ends it."""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

from rcilab.core.errors import InvalidValueError
from rcilab.core.state import RobotMode, RobotState
from rcilab.makers.rokae.driver.commands import RciCommands

GuideSpace: TypeAlias = Literal["joint", "cartesian"]
GuideKind: TypeAlias = Literal["free", "translation", "rotation"]


def require_guidable(space: object, kind: object) -> None:
    """Returns if there is such a way to guide an arm.

    Raises:
        InvalidValueError: There is none; the message lists those there are.
    """
    if space not in get_args(GuideSpace):
        raise InvalidValueError("space", space, f"is unknown; known: {', '.join(get_args(GuideSpace))}")
    if kind not in get_args(GuideKind):
        raise InvalidValueError("kind", kind, f"is unknown; known: {', '.join(get_args(GuideKind))}")


class HandGuide:
    """One time of hand guiding, from startDrag to stopDrag. Owned by the control process's thread.

    Args:
        commands: The connected controller.
    """

    def __init__(self, commands: RciCommands) -> None:
        self._commands = commands
        self._was_seen = False

    def start(self, space: GuideSpace, kind: GuideKind) -> None:
        """Frees the arm.

        Raises:
            CommandRejectedError: The controller refuses.
        """
        self._commands.start_drag(space, kind)

    def stop(self) -> None:
        """Holds the arm again; returns once it stands still."""
        self._commands.stop_drag()

    def has_ended(self, state: RobotState) -> bool:
        """Returns whether the controller has left guiding by itself: a fault, an emergency stop, power taken away.

        States that were on their way before the arm was freed do not count.
        """
        guided = state.robot_mode is RobotMode.GUIDING
        self._was_seen |= guided
        return (self._was_seen and not guided) or bool(state.faults)
