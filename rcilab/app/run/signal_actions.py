"""What happens when the operator sets an output, reads the inputs or restarts the controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from rcilab.app.request import Handlers, Request
from rcilab.app.robot_connection import RobotConnection
from rcilab.app.status_text import tell_error
from rcilab.app.store import Store
from rcilab.app.text import message

if TYPE_CHECKING:
    from rcilab.control_process import PendingRequest, SupervisorStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOutput(Request):
    """A digital output, 0 to 5, on or off."""

    signal: int
    level: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PressSignals(Request):
    """Reads the digital inputs; or restarts the controller, once that is confirmed."""

    what: Literal["read", "reboot", "confirm", "cancel"]


class SignalActions:
    """Owned by the conductor's thread; it never waits for the controller."""

    def __init__(self, store: Store, session: RobotConnection) -> None:
        self._store, self._session = store, session
        self._tickets: list[tuple[str, PendingRequest]] = []

    @property
    def handlers(self) -> Handlers:
        """What it does for each of its requests."""
        return {
            SetOutput: self.set_output,
            PressSignals: self.press,
        }

    def set_output(self, request: SetOutput) -> None:
        """Sets a digital output."""
        ticket = self._session.supervisor().set_output(request.signal, request.level)
        self._tickets.append(("output", ticket))

    def press(self, request: PressSignals) -> None:
        """Reads the inputs; restarts the controller when that was confirmed."""
        if request.what == "read":
            self._tickets.append(("inputs", self._session.supervisor().read_inputs()))
            return
        was_asked = self._store.state.reboot_asked
        self._store.update(reboot_asked=request.what == "reboot")
        if request.what == "confirm" and was_asked:
            self._tickets.append(("reboot", self._session.supervisor().reboot()))

    def tick(self, status: SupervisorStatus) -> None:
        """Looks at the answers; a question about a restart ends with the connection."""
        if self._store.state.reboot_asked and status.phase not in ("idle", "fault"):
            self._store.update(reboot_asked=False)
        waiting = []
        for what, ticket in self._tickets:
            if not ticket.done:
                waiting.append((what, ticket))
            elif ticket.error is not None:
                refused = message("notice.refused", what=message(f"drive.{what}"), error=tell_error(ticket.error))
                self._store.say("bad", refused)
            elif what == "reboot":
                self._store.say("warn", message("signals.rebooted"))
        self._tickets = waiting
