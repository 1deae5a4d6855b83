"""Franka: the arms Panda and FR3, their errors, conditions and virtual controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.condition import ConditionTable
from rcilab.makers.franka.conditions import FCI_CONDITIONS
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.robots import ROBOTS
from rcilab.makers.maker import Capabilities, PlanningOnly, Timing

if TYPE_CHECKING:
    from rcilab.sim.controller_config import ControllerConfig
    from rcilab.sim.maker_server import MakerServer
    from rcilab.sim.virtual_arm import VirtualArm


class Franka(PlanningOnly):
    """The maker of Panda and FR3."""

    name = "franka"
    title = "Franka"
    interface = "Franka's own interface"
    scheme = "fci"
    robots = ROBOTS
    capabilities = Capabilities(simulates=True, streams=True)
    timing = Timing()

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the FCI."""
        return FCI_CONDITIONS

    def build_server(self, arm: VirtualArm, config: ControllerConfig) -> MakerServer:
        """Returns the FCI server of an arm."""
        from rcilab.makers.franka.controller.fci_server import build_fci_server

        return build_fci_server(arm, config)

    def faults(self) -> type[FrankaError]:
        """Returns the 41 errors of the FCI."""
        return FrankaError


MAKER = Franka()
