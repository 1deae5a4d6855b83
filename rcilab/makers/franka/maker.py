"""Franka: the arms Panda and FR3, their errors and conditions, driven by their client libraries."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.condition import ConditionTable
from rcilab.core.state import MODES
from rcilab.makers.franka.bounds import CLIENT_PORT, LONGEST_TOOL, SINGLE_PRECISION
from rcilab.makers.franka.conditions import FCI_CONDITIONS
from rcilab.makers.franka.errors import FrankaError
from rcilab.makers.franka.robots import ROBOTS
from rcilab.makers.maker import Capabilities, Timing

if TYPE_CHECKING:
    from rcilab.makers.address import ControllerAddress
    from rcilab.makers.driver import ExpectedArm
    from rcilab.makers.franka.driver.fci_driver import FciDriver
    from rcilab.makers.parameters import ParameterGroup
    from rcilab.makers.scenario import FaultScenario
    from rcilab.model.robot_model import RobotModel
    from rcilab.sim.controller_config import ControllerConfig
    from rcilab.sim.maker_server import MakerServer
    from rcilab.sim.virtual_arm import VirtualArm


class Franka:
    """The maker of Panda and FR3."""

    name = "franka"
    title = "Franka"
    scheme = "fci"
    robots = ROBOTS
    client_port = CLIENT_PORT
    capabilities = Capabilities(
        simulates=True,
        drives=True,
        streams=True,
        modes=MODES,
        options=("lockstep",),
        setup=("tool", "load", "control"),
        longest_tool=LONGEST_TOOL,
    )
    timing = Timing(is_patient=True)

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the FCI."""
        return FCI_CONDITIONS

    def parameters(self, model: RobotModel) -> tuple[ParameterGroup, ...]:
        """Returns stiffness and collision thresholds."""
        from rcilab.makers.franka.parameters import parameter_groups

        return parameter_groups()

    def scenarios(self, model: RobotModel) -> tuple[FaultScenario, ...]:
        """Returns the scenarios of the errors of an arm."""
        from rcilab.makers.franka.scenarios import scenarios_of

        return scenarios_of(model.name)

    def parse_address(self, text: str) -> ControllerAddress:
        """Returns the parts of an address, fci://HOST."""
        from rcilab.makers.franka.driver.address import parse_address

        return parse_address(text)

    def open_driver(self, address: str, timeout: float, expected: ExpectedArm | None) -> FciDriver:
        """Returns a connection to a controller of Franka."""
        from rcilab.makers.franka.driver.fci_driver import open_driver

        return open_driver(address, timeout, expected)

    def state_rounding(self, model: RobotModel) -> float:
        """Returns that of single precision for the FR3, 0 for the Panda."""
        return SINGLE_PRECISION if model.name == "FR3" else 0.0

    def build_server(self, arm: VirtualArm, config: ControllerConfig) -> MakerServer:
        """Returns the FCI server of an arm."""
        from rcilab.makers.franka.controller.fci_server import build_fci_server

        return build_fci_server(arm, config)

    def faults(self) -> type[FrankaError]:
        """Returns the 41 errors of the FCI."""
        return FrankaError


MAKER = Franka()
