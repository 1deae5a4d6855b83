"""What happens when somebody chooses where motions go. Owned by the conductor's thread."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

from rcilab.client.address import parse_address
from rcilab.errors import RcilabError
from rcilab.workbench import requests
from rcilab.workbench.run.actions import RobotActions
from rcilab.workbench.run.driving import DESTINATIONS
from rcilab.workbench.run.pushing import Plant
from rcilab.workbench.run.readiness import is_moving
from rcilab.workbench.session import Session
from rcilab.workbench.store import Store
from rcilab.workbench.telling import tell_error
from rcilab.workbench.text import message

_ADDRESS = "address"
"""Names the trouble that what stands in the field is no address."""


class WhereActions:
    """Preview, the virtual controller with one of its arms, or a controller at an address."""

    def __init__(self, store: Store, session: Session, robot: RobotActions) -> None:
        self._store, self._session, self._robot = store, session, robot

    def choose(self, request: requests.ChooseDestination) -> None:
        """Connects to a destination; an address is named once more before anything is sent there."""
        state = self._store.state
        if request.where not in DESTINATIONS:
            return
        self._store.settle(_ADDRESS)
        if is_moving(self._session.status()):
            self._store.say("warn", message("notice.moving"))
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
            self._store.update(plant=cast("Plant", request.where))
            self._robot.open(state.model.name, "virtual")

    def _choose_address(self, request: requests.ChooseDestination) -> None:
        asked, address = self._store.state.drive.typed_address, request.address.strip()
        self._ask("")  # It was about what stood in the field before.
        if request.answer == "yes" and asked and address == asked:
            self._robot.open(self._store.state.model.name, asked)
            return
        if not address:
            self._store.say("warn", message("run.address_needed"), trouble=_ADDRESS)
            return
        try:
            parse_address(address)
        except RcilabError as error:
            self._store.say("bad", tell_error(error), trouble=_ADDRESS)
            return
        self._ask(address)

    def _ask(self, address: str) -> None:
        self._store.update(drive=replace(self._store.state.drive, typed_address=address))
