"""ROKAE: the xMate arms, their faults and conditions, driven by the RCI."""

from __future__ import annotations

from rcilab.core.condition import ConditionTable
from rcilab.makers.maker import Capabilities
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.robots import ROBOTS


class Rokae:
    """The maker of the xMate arms."""

    name = "rokae"
    title = "ROKAE"
    interface = "the RCI"
    scheme = "rci"
    robots = ROBOTS
    capabilities = Capabilities(simulates=True, drives=True)

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the RCI."""
        return RCI_CONDITIONS

    def faults(self) -> type[Fault]:
        """Returns the twenty faults of the RCI."""
        return Fault


MAKER = Rokae()
