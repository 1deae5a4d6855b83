"""ROKAE: the xMate arms, their faults and conditions, driven by the RCI."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.condition import ConditionTable
from rcilab.core.state import MODES
from rcilab.makers.maker import Capabilities, Timing
from rcilab.makers.rokae.bounds import LONGEST_TOOL, SIGNAL_NAMES
from rcilab.makers.rokae.conditions import RCI_CONDITIONS
from rcilab.makers.rokae.faults import Fault
from rcilab.makers.rokae.robots import ROBOTS

if TYPE_CHECKING:
    from rcilab.makers.driver import ExpectedArm
    from rcilab.makers.parameters import ParameterGroup
    from rcilab.makers.rokae.controller.rci_server import RciServer
    from rcilab.makers.rokae.driver.address import RciAddress
    from rcilab.makers.rokae.driver.rci_driver import RciDriver
    from rcilab.makers.scenario import FaultScenario
    from rcilab.model.robot_model import RobotModel
    from rcilab.sim.controller_config import ControllerConfig
    from rcilab.sim.virtual_arm import VirtualArm


class Rokae:
    """The maker of the xMate arms."""

    name = "rokae"
    title = "ROKAE"
    scheme = "rci"
    client_port = None
    robots = ROBOTS
    capabilities = Capabilities(
        simulates=True,
        drives=True,
        streams=True,
        modes=MODES,
        guides=True,
        reboots=True,
        switches_power=True,
        has_gate=True,
        outputs=tuple(f"DO{name}" for name in SIGNAL_NAMES),
        inputs=tuple(f"DI{name}" for name in SIGNAL_NAMES),
        setup=("box", "tool", "load", "force", "joints", "control"),
        options=("auto_limit", "loop_back", "on_loss", "force_sign", "mode_delay", "lockstep"),
        longest_tool=LONGEST_TOOL,
    )
    timing = Timing()

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the RCI."""
        return RCI_CONDITIONS

    def state_rounding(self, model: RobotModel) -> float:
        """Returns 0: states have the commanded doubles."""
        return 0.0

    def faults(self) -> type[Fault]:
        """Returns the twenty faults of the RCI."""
        return Fault

    def parameters(self, model: RobotModel) -> tuple[ParameterGroup, ...]:
        """Returns stiffness, desired wrench, collision thresholds and filters."""
        from rcilab.makers.rokae.parameters import parameter_groups

        return parameter_groups(model.limits)

    def scenarios(self, model: RobotModel) -> tuple[FaultScenario, ...]:
        """Returns one scenario for each fault."""
        from rcilab.makers.rokae.scenarios import SCENARIOS

        return SCENARIOS

    def build_server(self, arm: VirtualArm, config: ControllerConfig) -> RciServer:
        """Returns the virtual side of the RCI."""
        from rcilab.makers.rokae.controller.rci_server import build_rci_server

        return build_rci_server(arm, config)

    def parse_address(self, text: str) -> RciAddress:
        """Returns the parts of an address, rci://HOST:PORT."""
        from rcilab.makers.rokae.driver.address import parse_address

        return parse_address(text)

    def open_driver(self, address: str, timeout: float, expected: ExpectedArm | None) -> RciDriver:
        """Returns a connection to an RCI controller."""
        from rcilab.makers.rokae.driver.rci_driver import open_driver

        return open_driver(address, timeout, expected)


MAKER = Rokae()
