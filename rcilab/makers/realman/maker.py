"""RealMan: the arms RM65, RM75, RML63-III, ECO65, ECO63 and GEN72, their errors and conditions."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING

from rcilab.core.condition import ConditionTable
from rcilab.core.errors import ModelError
from rcilab.makers.maker import Capabilities, Timing
from rcilab.makers.realman.bounds import ANGLE_STEP, LONGEST_TOOL
from rcilab.makers.realman.conditions import REALMAN_CONDITIONS
from rcilab.makers.realman.errors import RealManError
from rcilab.makers.realman.robots import ROBOTS

if TYPE_CHECKING:
    from rcilab.makers.driver import ExpectedArm, RobotAddress, StreamingDriver
    from rcilab.makers.parameters import ParameterGroup
    from rcilab.makers.scenario import FaultScenario
    from rcilab.model.robot_model import RobotModel
    from rcilab.sim.controller_config import ControllerConfig
    from rcilab.sim.maker_server import MakerServer
    from rcilab.sim.virtual_arm import VirtualArm


class RealMan:
    """The maker of RM65, RM75 and their relatives."""

    name = "realman"
    title = "RealMan"
    scheme = "realman"
    robots = ROBOTS
    client_port = None
    capabilities = Capabilities(simulates=True, options=("loop_back",), longest_tool=LONGEST_TOOL)
    timing = Timing()

    def conditions(self) -> ConditionTable:
        """Returns the conditions of the interface."""
        return REALMAN_CONDITIONS

    def parameters(self, model: RobotModel) -> tuple[ParameterGroup, ...]:
        """Returns none."""
        return ()

    def scenarios(self, model: RobotModel) -> tuple[FaultScenario, ...]:
        """Returns none."""
        return ()

    def parse_address(self, text: str) -> RobotAddress:
        """Raises an error.

        Raises:
            ModelError: Always: rcilab has no driver for these controllers.
        """
        raise _no_driver()

    def open_driver(self, address: str, timeout: float, expected: ExpectedArm | None) -> StreamingDriver:
        """Raises an error.

        Raises:
            ModelError: Always: rcilab has no driver for these controllers.
        """
        raise _no_driver()

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


def _no_driver() -> ModelError:
    sentence = (
        "RealMan's arms have no driver in rcilab: run rcilab controller and use the maker's client library, or plan, "
        "check and draw"
    )
    return ModelError(sentence).coded("no_driver", model="RealMan")


MAKER = RealMan()
