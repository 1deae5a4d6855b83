"""Requests that choose the destination of motions. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast

from rcilab.app.connection import PageConnection
from rcilab.app.request import Handlers, Request
from rcilab.app.run.drive_state import DESTINATIONS
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.run_actions import RunActions
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import message
from rcilab.makers.driver import parse_address
from rcilab.sim.controller_config import PlantKind

_ADDRESS = "address"
"""Cause of the notices of an invalid address."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChooseDestination(Request):
    """Choose the destination of motions; an address is confirmed first."""

    where: str
    """One of `DESTINATIONS`."""
    address: str = ""
    answer: Literal["", "yes", "no"] = ""


class TargetRobotActions:
    """Preview, the virtual controller with one of its arms, or a controller at an address."""

    def __init__(self, store: Store, connection: PageConnection, robot: RunActions) -> None:
        self._store, self._connection, self._robot = store, connection, robot

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            ChooseDestination: self.choose,
        }

    def choose(self, request: ChooseDestination) -> None:
        """Connects to a destination; an address is shown for confirmation before anything is sent there."""
        state = self._store.state
        if request.where not in DESTINATIONS:
            return
        self._store.clear_notices(_ADDRESS)
        if is_moving(self._connection.status()):
            self._store.notify("warn", message("notice.moving"))
            return
        if request.answer == "no":
            self._ask("")
        elif request.where == "preview":
            self._ask("")
            self._robot.disconnect()
        elif request.where == "address":
            self._choose_address(request)
        else:
            self._ask("")
            self._store.update(plant=cast("PlantKind", request.where))
            self._robot.open(state.model.name, "virtual")

    def _choose_address(self, request: ChooseDestination) -> None:
        asked, address = self._store.state.typed_address, request.address.strip()
        self._ask("")  # The question was about the previous text of the field.
        if request.answer == "yes" and asked and address == asked:
            self._robot.open(self._store.state.model.name, asked)
            return
        if not address:
            self._store.notify("warn", message("run.address_needed"), cause=_ADDRESS)
            return
        try:
            parse_address(address, self._store.state.model)
        except RcilabError as error:
            self._store.notify("bad", explain_error(error), cause=_ADDRESS)
            return
        self._ask(address)

    def _ask(self, address: str) -> None:
        self._store.update(typed_address=address)
