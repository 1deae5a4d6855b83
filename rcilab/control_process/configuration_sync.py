"""Which set-up the controller was told, whether it took it, and what it is told again at every new connection."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.errors import RcilabError, UsageError
from rcilab.core.spatial import IDENTITY
from rcilab.makers.configuration import RobotConfiguration

if TYPE_CHECKING:
    from rcilab.control_process.pending_request import PendingRequest
    from rcilab.model.robot_model import RobotModel


class ConfigurationSync:
    """Guarded by the lock of its owner.

    Args:
        setup: What the controller is told at its first connection.
    """

    def __init__(self, setup: RobotConfiguration) -> None:
        self.wanted = setup
        """What it was told last, all of it."""
        self.acknowledged = RobotConfiguration()
        """What it has answered yes to since it was connected."""
        self.times = 0
        """At how many connections it has taken a set-up."""
        self._waiting: list[tuple[PendingRequest, RobotConfiguration, bool]] = []
        self._refusal: RcilabError | None = None

    def follow(self, ticket: PendingRequest, setup: RobotConfiguration, *, is_new_connection: bool = False) -> None:
        """Takes note of a request that carries a set-up.

        Args:
            ticket: The request.
            setup: What it carries.
            is_new_connection: Whether it begins a connection: what the controller had before is then not known.
        """
        self.wanted = self.wanted.updated(setup)
        self._waiting.append((ticket, setup, is_new_connection))
        self._refusal = None

    def look(self) -> None:
        """Takes note of the answers, as far as there are any."""
        while self._waiting and self._waiting[0][0].done:
            ticket, setup, is_new_connection = self._waiting.pop(0)
            if is_new_connection:
                self.acknowledged = RobotConfiguration()
            if ticket.error is not None:
                self._refusal = ticket.error
                # It may have taken some of it: what it has of these parts now, nobody knows.
                self.acknowledged = self.acknowledged.without(setup.parts)
                continue
            self._refusal = None
            self.acknowledged = self.acknowledged.updated(setup)
            self.times += is_new_connection and bool(setup.parts)

    def require_given(self) -> None:
        """Makes sure that nothing is under way and that nothing was refused.

        Raises:
            UsageError: The controller has another set-up than motions are checked with.
        """
        self.look()
        if self._waiting:
            raise UsageError("the controller is being told its set-up; wait for the ticket of set_up()").coded(
                "telling_setup"
            )
        if self._refusal is not None and self.wanted.parts:
            raise UsageError(f"the controller did not take its set-up ({self._refusal}); call set_up() again").coded(
                "setup_refused", reason=self._refusal
            )


def standard_setup(model: RobotModel, *, is_virtual: bool) -> RobotConfiguration:
    """Returns what a controller is told unless somebody says otherwise.

    Args:
        model: The arm.
        is_virtual: Whether the controller is ours: then it is told of tool and load. A real one has its own settings.
    """
    if not is_virtual:
        return RobotConfiguration()
    has_tool = not model.T_flange_tool.is_close(IDENTITY, 0.0)
    return RobotConfiguration(
        tool=model.T_flange_tool if has_tool else None, load=model.load if model.load.mass else None
    )
