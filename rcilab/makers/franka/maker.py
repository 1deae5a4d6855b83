"""Franka: the arms Panda and FR3, their errors and conditions. Motions are planned and checked, but not simulated or driven."""

from __future__ import annotations

from rcilab.core.condition import ConditionTable
from rcilab.makers.franka.conditions import FCI_CONDITIONS
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.robots import ROBOTS
from rcilab.makers.maker import Capabilities, PlanningOnly, Timing


class Franka(PlanningOnly):
    """The maker of Panda and FR3."""

    name = "franka"
    title = "Franka"
    interface = "Franka's own interface"
    scheme = "fci"
    robots = ROBOTS
    capabilities = Capabilities()
    timing = Timing()

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the FCI."""
        return FCI_CONDITIONS

    def faults(self) -> type[FrankaError]:
        """Returns the 41 errors of the FCI."""
        return FrankaError


MAKER = Franka()
