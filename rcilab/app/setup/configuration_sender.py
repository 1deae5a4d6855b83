"""Sends tool, load, box and parameters to the controller: one request at a time, without waiting for its answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.app.connection import Connection
from rcilab.app.status_text import StartingError, explain_error
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import Message

if TYPE_CHECKING:
    from rcilab.control_process import PendingRequest
    from rcilab.makers.configuration import RobotConfiguration


class ConfigurationSender:
    """Owned by the thread that changes the state.

    Args:
        connection: The robot.
        refuse: Called with the reason if the controller refuses a request.
    """

    def __init__(self, connection: Connection, refuse: Callable[[Message], None]) -> None:
        self._connection, self._refuse = connection, refuse
        self._request: PendingRequest | None = None

    @property
    def is_underway(self) -> bool:
        """Whether an answer is awaited; the next request is sent after it was collected."""
        return self._request is not None

    def send(self, setup: RobotConfiguration) -> None:
        """Sends a request; nothing while the control process is still starting."""
        assert self._request is None
        try:
            self._request = self._connection.robot().configure(setup)
        except StartingError:
            return
        except RcilabError as error:
            self._refuse(explain_error(error))

    def collect(self) -> None:
        """Takes the answer, if there is one."""
        request = self._request
        if request is None or not request.done:
            return
        self._request = None
        if request.error is not None:
            self._refuse(explain_error(request.error))

    def forget(self) -> None:
        """Drops the request: another arm was chosen."""
        self._request = None
