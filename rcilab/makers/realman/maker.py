"""RealMan: the arms RM65, RM75, RML63-III, ECO65, ECO63 and GEN72, their errors and conditions."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING

from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import ConditionTable
from rcilab.makers.maker import Capabilities, Timing
from rcilab.makers.realman.bounds import ANGLE_STEP, INPUTS, LONGEST_TOOL, OUTPUTS, PUSH_PERIOD
from rcilab.makers.realman.conditions import REALMAN_CONDITIONS
from rcilab.makers.realman.errors import RealManError
from rcilab.makers.realman.robots import ROBOTS

if TYPE_CHECKING:
    from rcilab.makers.address import ControllerAddress
    from rcilab.makers.driver import ExpectedArm
    from rcilab.makers.parameters import ParameterGroup
    from rcilab.makers.realman.driver.realman_driver import RealManDriver
    from rcilab.makers.scenario import FaultScenario
    from rcilab.model.robot_model import RobotModel
    from rcilab.sim.controller_config import ControllerConfig
    from rcilab.sim.maker_server import MakerServer
    from rcilab.sim.virtual_arm import VirtualArm

_PERIOD = PUSH_PERIOD * CYCLE_TIME  # [s]


class RealMan:
    """The maker of RM65, RM75 and their relatives."""

    name = "realman"
    title = "RealMan"
    scheme = "realman"
    robots = ROBOTS
    client_port = None
    capabilities = Capabilities(
        simulates=True,
        drives=True,
        streams=True,
        modes=("joint_position",),
        outputs=OUTPUTS,
        inputs=INPUTS,
        switches_power=True,
        setup=("tool", "load", "joints", "control"),
        options=("loop_back",),
        longest_tool=LONGEST_TOOL,
    )
    timing = Timing(state_period=_PERIOD, command_period=_PERIOD)

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the interface."""
        return REALMAN_CONDITIONS

    def parameters(self, model: RobotModel) -> tuple[ParameterGroup, ...]:
        """Returns the limits of joints and tool, and the collision stage."""
        from rcilab.makers.realman.parameters import parameter_groups

        return parameter_groups(model)

    def scenarios(self, model: RobotModel) -> tuple[FaultScenario, ...]:
        """Returns the scenarios of its errors, the same for every arm."""
        from rcilab.makers.realman.scenarios import scenarios

        return scenarios()

    def parse_address(self, text: str) -> ControllerAddress:
        """Returns the parts of an address, realman://HOST:PORT."""
        from rcilab.makers.realman.driver.address import parse_address

        return parse_address(text)

    def open_driver(self, address: str, timeout: float, expected: ExpectedArm | None) -> RealManDriver:
        """Returns a connection to a controller of RealMan."""
        from rcilab.makers.realman.driver.realman_driver import open_driver

        return open_driver(address, timeout, expected)

    def state_rounding(self, model: RobotModel) -> float:
        """Returns the resolution of joint angles on the wire, [rad]."""
        return radians(ANGLE_STEP)

    def build_server(self, arm: VirtualArm, config: ControllerConfig) -> MakerServer:
        """Returns the server of an arm."""
        from rcilab.makers.realman.controller.realman_server import build_realman_server

        return build_realman_server(arm, config)

    def faults(self) -> type[RealManError]:
        """Returns the errors of the controllers and of their joints."""
        return RealManError


MAKER = RealMan()
