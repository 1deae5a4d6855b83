"""The operator sets an output, reads the inputs or restarts the controller."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Literal

from rcilab.app.connection import PageConnection
from rcilab.app.request import Handlers, Request
from rcilab.app.run.robot_requests import RobotRequests
from rcilab.app.store import Store
from rcilab.makers.maker import capabilities_of

if TYPE_CHECKING:
    from rcilab.control_process import SupervisorStatus
    from rcilab.model.robot_model import RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOutput(Request):
    """Switch a digital output, by its number."""

    signal: int
    level: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PressSignals(Request):
    """Read the digital inputs; or restart the controller, after a confirmation."""

    what: Literal["read", "reboot", "confirm", "cancel"]


def signal_rows(model: RobotModel, status: SupervisorStatus) -> list[tuple[str, bool | None, str, bool | None]]:
    """Returns a row for each signal: an output's name and its set level, an input's and its last level."""
    has = capabilities_of(model)
    columns = zip_longest(has.outputs, status.outputs, has.inputs, status.inputs or ())
    return [(output or "", is_set, name or "", is_high) for output, is_set, name, is_high in columns]


class SignalActions:
    """Owned by the dispatcher's thread; it never waits for the controller."""

    def __init__(self, store: Store, connection: PageConnection, requests: RobotRequests) -> None:
        self._store, self._connection, self._requests = store, connection, requests

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            SetOutput: self.set_output,
            PressSignals: self.press,
        }

    def set_output(self, request: SetOutput) -> None:
        """Sets a digital output."""
        self._requests.add("output", self._connection.robot().set_output(request.signal, request.level))

    def press(self, request: PressSignals) -> None:
        """Reads the inputs; restarts the controller after a confirmation."""
        if request.what == "read":
            self._requests.add("inputs", self._connection.robot().read_inputs())
            return
        was_asked = self._store.state.reboot_asked
        self._store.update(reboot_asked=request.what == "reboot")
        if request.what == "confirm" and was_asked:
            self._requests.add("reboot", self._connection.robot().reboot())

    def tick(self, status: SupervisorStatus) -> None:
        """Withdraws the question about a restart when the connection ends."""
        if self._store.state.reboot_asked and status.phase not in ("idle", "fault"):
            self._store.update(reboot_asked=False)
