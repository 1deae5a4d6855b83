"""UFACTORY: the arms xArm5, xArm6, xArm7, Lite6 and 850, their errors and conditions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rcilab.core.condition import ConditionTable
from rcilab.makers.maker import Capabilities, Timing
from rcilab.makers.ufactory.bounds import (
    CLIENT_PORT,
    INPUTS,
    LONGEST_TOOL,
    OUTPUTS,
    REPORT_PERIOD,
    SINGLE_PRECISION,
)
from rcilab.makers.ufactory.conditions import UFACTORY_CONDITIONS
from rcilab.makers.ufactory.errors import UfactoryError
from rcilab.makers.ufactory.robots import ROBOTS

if TYPE_CHECKING:
    from rcilab.makers.address import ControllerAddress
    from rcilab.makers.driver import ExpectedArm
    from rcilab.makers.parameters import ParameterGroup
    from rcilab.makers.scenario import FaultScenario
    from rcilab.makers.ufactory.driver.xarm_driver import XArmDriver
    from rcilab.model.robot_model import RobotModel
    from rcilab.sim.controller_config import ControllerConfig
    from rcilab.sim.maker_server import MakerServer
    from rcilab.sim.virtual_arm import VirtualArm


class Ufactory:
    """The maker of the xArms, the Lite6 and the 850."""

    name = "ufactory"
    title = "UFACTORY"
    scheme = "xarm"
    robots = ROBOTS
    client_port = CLIENT_PORT
    capabilities = Capabilities(
        simulates=True,
        drives=True,
        streams=True,
        modes=("joint_position",),
        guides=True,
        outputs=OUTPUTS,
        inputs=INPUTS,
        switches_power=True,
        stop_is_error=True,
        setup=("box", "tool", "load", "joints", "control"),
        turns_box=False,
        options=("loop_back",),
        longest_tool=LONGEST_TOOL,
    )
    timing = Timing(state_period=REPORT_PERIOD, command_period=REPORT_PERIOD)

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the interface."""
        return UFACTORY_CONDITIONS

    def parameters(self, model: RobotModel) -> tuple[ParameterGroup, ...]:
        """Returns sensitivities and limits of planned motions."""
        from rcilab.makers.ufactory.parameters import parameter_groups

        return parameter_groups()

    def scenarios(self, model: RobotModel) -> tuple[FaultScenario, ...]:
        """Returns the scenarios of the errors of an arm."""
        from rcilab.makers.ufactory.scenarios import scenarios_of

        return scenarios_of(model.name)

    def parse_address(self, text: str) -> ControllerAddress:
        """Returns the parts of an address, xarm://HOST."""
        from rcilab.makers.ufactory.driver.address import parse_address

        return parse_address(text)

    def open_driver(self, address: str, timeout: float, expected: ExpectedArm | None) -> XArmDriver:
        """Returns a connection to a controller of UFACTORY."""
        from rcilab.makers.ufactory.driver.xarm_driver import open_driver

        return open_driver(address, timeout, expected)

    def state_rounding(self, model: RobotModel) -> float:
        """Returns that of single precision."""
        return SINGLE_PRECISION

    def build_server(self, arm: VirtualArm, config: ControllerConfig) -> MakerServer:
        """Returns the server of an arm."""
        from rcilab.makers.ufactory.controller.xarm_server import build_xarm_server

        return build_xarm_server(arm, config)

    def faults(self) -> type[UfactoryError]:
        """Returns the errors of the controller."""
        return UfactoryError


MAKER = Ufactory()
