"""Telling the controller of tool, load, box and parameters: one letter at a time, and nobody waits for its answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from rcilab.app.status_text import StartingError, tell_error
from rcilab.app.text import Message
from rcilab.core.errors import RcilabError

if TYPE_CHECKING:
    from rcilab.control_process import PendingRequest
    from rcilab.makers.configuration import RobotConfiguration


class ConfigurableRobot(Protocol):
    """What takes a configuration."""

    def set_up(self, setup: RobotConfiguration) -> PendingRequest:
        """Sends it, without waiting for the answer."""
        ...


class ConfigurationTarget(Protocol):
    """The robot of the moment."""

    def supervisor(self) -> ConfigurableRobot:
        """Returns what takes requests."""
        ...


class ConfigurationSender:
    """Owned by the conductor's thread.

    Args:
        session: The robot side.
        refuse: Takes why the controller did not take a letter.
    """

    def __init__(self, session: ConfigurationTarget, refuse: Callable[[Message], None]) -> None:
        self._session, self._refuse = session, refuse
        self._ticket: PendingRequest | None = None

    @property
    def is_underway(self) -> bool:
        """Whether an answer is awaited; nothing else is sent until it was collected."""
        return self._ticket is not None

    def send(self, setup: RobotConfiguration) -> None:
        """Sends a letter; a control process that is still starting gets none."""
        assert self._ticket is None
        try:
            self._ticket = self._session.supervisor().set_up(setup)
        except StartingError:
            return
        except RcilabError as error:
            self._refuse(tell_error(error))

    def collect(self) -> None:
        """Looks whether there is an answer."""
        ticket = self._ticket
        if ticket is None or not ticket.done:
            return
        self._ticket = None
        if ticket.error is not None:
            self._refuse(tell_error(ticket.error))

    def forget(self) -> None:
        """Awaits no answer any more: another arm was chosen."""
        self._ticket = None
