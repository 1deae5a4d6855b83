"""The interface of a maker of robots, and the registry of all makers.

A maker is a folder in `rcilab/makers` with a module `maker.py` that has a `MAKER`, and a folder `robots` with the data
files of its arms. Nothing outside its folder names it. `MAKER` is cheap to import: sockets and physics are imported by
its methods.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Literal, Protocol, TypeAlias, get_args

import numpy as np

from rcilab.conformance.common_conditions import START_POSITION_TOLERANCE
from rcilab.core.arrays import JointVector
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.condition import ConditionTable
from rcilab.core.errors import ModelError
from rcilab.core.fault import FaultCode
from rcilab.core.safety_box import require_straight
from rcilab.core.state import Mode
from rcilab.makers.configuration import RobotConfiguration, SetupPart, require_setup
from rcilab.model.robot_model import RobotModel
from rcilab.robots import ROBOTS_BY_MAKER

if TYPE_CHECKING:
    from rcilab.makers.driver import ExpectedArm, RobotAddress, StreamingDriver
    from rcilab.makers.parameters import ParameterGroup
    from rcilab.makers.scenario import FaultScenario
    from rcilab.sim.controller_config import ControllerConfig, ControllerOption
    from rcilab.sim.maker_server import MakerServer
    from rcilab.sim.virtual_arm import VirtualArm


@dataclass(frozen=True, slots=True, kw_only=True)
class Capabilities:
    """What rcilab can do with the arms of a maker beyond planning, checking and drawing."""

    simulates: bool = False
    """Whether there is a virtual controller."""
    drives: bool = False
    """Whether there is a driver for the real controller."""
    streams: bool = False
    """Whether the controller follows a command in every cycle, as a callback gives them."""
    modes: tuple[Mode, ...] = ()
    """Its command modes."""
    guides: bool = False
    """Whether it supports hand guiding."""
    outputs: tuple[str, ...] = ()
    """Names of its digital outputs, by number from 0."""
    inputs: tuple[str, ...] = ()
    """Names of its digital inputs, by number from 0."""
    reboots: bool = False
    """Whether it can be restarted over its interface."""
    switches_power: bool = False
    """Whether motor power is switched over its interface; otherwise the states say whether the arm can move."""
    has_gate: bool = False
    """Whether a safety gate stops it, besides the emergency stop."""
    stop_is_error: bool = False
    """Whether an emergency stop is an error that stays until a recovery, also after its release."""
    setup: tuple[SetupPart, ...] = ()
    """The parts of its configuration: safety box, tool, load, force-control frame, soft joint limits, parameters."""
    turns_box: bool = True
    """Whether its safety box may be turned; otherwise it has the axes of the base."""
    options: tuple[ControllerOption, ...] = ()
    """Options of its virtual controller that not every one has."""
    longest_tool: float = 2.0
    """Largest distance of tool, force-control frame and the load's centre of mass from the flange, [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """The periods of states and commands of a maker's interface."""

    state_period: float = CYCLE_TIME
    """Between two states, [s]."""
    command_period: float = CYCLE_TIME
    """Between two commands of a motion, [s]."""
    is_patient: bool = False
    """Whether a cycle of the virtual controller waits for its command, so that commands need not be played later."""

    @property
    def state_cycles(self) -> int:
        """`state_period` in cycles of the planning grid."""
        return max(1, round(self.state_period / CYCLE_TIME))

    @property
    def command_cycles(self) -> int:
        """`command_period` in cycles of the planning grid."""
        return max(1, round(self.command_period / CYCLE_TIME))


Feature: TypeAlias = Mode | SetupPart | Literal["simulation", "driving", "streaming", "guiding", "signals", "reboot"]
"""Features that an arm may lack; their texts are `feature.NAME`."""


class Maker(Protocol):
    """A maker of robots, as its folder describes it."""

    @property
    def name(self) -> str:
        """Name of its folder, such as "rokae"; a robot's description has it as `maker`."""
        ...

    @property
    def title(self) -> str:
        """Its name in texts, such as "ROKAE"."""
        ...

    @property
    def scheme(self) -> str:
        """URL scheme of its controllers, such as "rci" in rci://192.168.0.160:1337."""
        ...

    @property
    def client_port(self) -> int | None:
        """The TCP port that its clients insist on, so that two controllers need two addresses; None: any port."""
        ...

    @property
    def robots(self) -> Mapping[str, str]:
        """Its arms: name -> module of the data file in its folder `robots`."""
        ...

    @property
    def capabilities(self) -> Capabilities:
        """The capabilities of its arms."""
        ...

    @property
    def timing(self) -> Timing:
        """The periods of states and commands."""
        ...

    def conditions(self) -> ConditionTable:
        """Returns the conditions of its interface for a motion."""
        ...

    def state_rounding(self, model: RobotModel) -> float:
        """Returns the largest rounding of commanded positions in the states of an arm, [rad] or [m]; 0: none."""
        ...

    def faults(self) -> type[FaultCode]:
        """Returns the faults that its controllers report: number, name, cause, remedy."""
        ...

    def parameters(self, model: RobotModel) -> tuple[ParameterGroup, ...]:
        """Returns the parameters of a controller in addition to tool, load and limits, in display order."""
        ...

    def scenarios(self, model: RobotModel) -> tuple[FaultScenario, ...]:
        """Returns the scenarios that provoke faults of an arm on the virtual controller, in display order."""
        ...

    def build_server(self, arm: VirtualArm, config: ControllerConfig) -> MakerServer:
        """Returns the server of one of its arms; only with `capabilities.simulates`."""
        ...

    def parse_address(self, text: str) -> RobotAddress:
        """Returns the parts of the address of one of its controllers; only with `capabilities.drives`.

        Raises:
            InvalidValueError: It is not a valid address; the message says which part is wrong.
        """
        ...

    def open_driver(self, address: str, timeout: float, expected: ExpectedArm | None) -> StreamingDriver:
        """Returns a connection to one of its controllers; see `rcilab.makers.driver.open_driver`."""
        ...


_FEATURE_NAMES: dict[Feature, str] = {
    "guiding": "hand guiding",
    "signals": "digital signals",
    "reboot": "restart on request",
    "box": "safety box",
    "force": "force-control frame",
    "joints": "soft joint limits",
    "control": "parameters of its modes",
    "streaming": "commands in every cycle",
    **{mode: f"{mode.replace('_', ' ')} mode" for mode in get_args(Mode)},
}


@cache
def all_makers() -> tuple[Maker, ...]:
    """Returns every maker, by name of the folder."""
    return tuple(import_module(f"rcilab.makers.{name}.maker").MAKER for name in ROBOTS_BY_MAKER)


def maker_of(model: RobotModel) -> Maker | None:
    """Returns the maker of an arm; None for an arm without a maker."""
    return next((maker for maker in all_makers() if maker.name == model.description.maker), None)


def capabilities_of(model: RobotModel) -> Capabilities:
    """Returns the capabilities of an arm; without a maker, none."""
    maker = maker_of(model)
    return Capabilities() if maker is None else maker.capabilities


def timing_of(model: RobotModel) -> Timing:
    """Returns the periods of an arm's states and commands; without a maker, one cycle."""
    maker = maker_of(model)
    return Timing() if maker is None else maker.timing


def parameters_of(model: RobotModel) -> tuple[ParameterGroup, ...]:
    """Returns the parameters of an arm's controller, see `Maker.parameters`."""
    maker = maker_of(model)
    return () if maker is None else maker.parameters(model)


def find_maker(name: str) -> Maker | None:
    """Returns the maker of an arm by the arm's name; None for another name."""
    return next((maker for maker in all_makers() if name in maker.robots), None)


def state_rounding_of(model: RobotModel) -> float:
    """Returns the largest rounding of commanded positions in the states of an arm, see `Maker.state_rounding`."""
    maker = maker_of(model)
    return 0.0 if maker is None else maker.state_rounding(model)


def start_tolerance_of(model: RobotModel) -> float:
    """Returns the largest distance of a motion's start from the commanded angles in the states of an arm, [rad]."""
    return max(START_POSITION_TOLERANCE, state_rounding_of(model))


def commanded_start(start: JointVector, q_c: JointVector, model: RobotModel) -> JointVector:
    """Returns where an arm is commanded: at the start of a motion, if a state differs from it by its rounding only.

    Args:
        start: Start of a motion, [rad].
        q_c: Commanded joint angles of a state, shape (n,), [rad].
        model: The arm.
    """
    is_there = len(start) == len(q_c) and float(np.abs(start - q_c).max()) <= state_rounding_of(model)
    return start if is_there else q_c


def simulated_robots() -> tuple[str, ...]:
    """Returns the names of the arms that have a virtual controller."""
    return _robots_of(maker for maker in all_makers() if maker.capabilities.simulates)


def find_missing_feature(model: RobotModel, feature: Feature) -> ModelError | None:
    """Returns why an arm lacks a feature, as the error of a call that needs it; None if it has the feature."""
    capabilities = capabilities_of(model)
    simulates, drives = capabilities.simulates, capabilities.drives
    if feature == "simulation" and simulates:
        return None
    if feature == "driving" and drives:
        return None
    if not (simulates or drives):
        return _plan_only_error(model)
    if feature == "simulation":
        sentence = f"{model.name} has no virtual controller in rcilab: connect to a real one"
        return ModelError(sentence).coded("no_simulation", model=model.name)
    if feature == "driving":
        return ModelError(f"{model.name} has no driver in rcilab: simulate it").coded("no_driver", model=model.name)
    has = {
        "streaming": capabilities.streams,
        "guiding": capabilities.guides,
        "signals": bool(capabilities.outputs or capabilities.inputs),
        "reboot": capabilities.reboots,
    }
    if has.get(feature, feature in (*capabilities.modes, *capabilities.setup)):
        return None
    sentence = f"the controller of {model.name} has no {_FEATURE_NAMES.get(feature, feature.replace('_', ' '))}"
    return ModelError(sentence).coded("no_feature", model=model.name, feature=feature)


def _plan_only_error(model: RobotModel) -> ModelError:
    maker, possible = maker_of(model), ", ".join(simulated_robots())
    name = "its maker" if maker is None else maker.title
    return ModelError(
        f"{model.name} is driven by {name}'s own interface, which rcilab does not implement: plan for it, check and "
        f"draw its motions, but simulate and drive one of {possible}"
    ).coded("only_planned", model=model.name, maker=name, robots=possible)


def require_feature(model: RobotModel, feature: Feature) -> RobotModel:
    """Returns `model` if its arm has a feature.

    Raises:
        ModelError: It lacks the feature; the message says why, and what is possible.
    """
    missing = find_missing_feature(model, feature)
    if missing is not None:
        raise missing
    return model


def require_parts(model: RobotModel, configuration: object) -> RobotConfiguration:
    """Returns a configuration if an arm has all its parts.

    Raises:
        InvalidValueError: It is not a configuration, or its safety box is turned and that of the arm cannot be.
        ModelError: The arm lacks a part of it.
    """
    setup = require_setup(configuration)
    for part in setup.parts:
        require_feature(model, part)
    if setup.box is not None and not capabilities_of(model).turns_box:
        require_straight(setup.box)
    return setup


def require_simulator(model: RobotModel) -> RobotModel:
    """Returns `model` if its arm has a virtual controller; see `require_feature`."""
    return require_feature(model, "simulation")


def require_driver(model: RobotModel) -> RobotModel:
    """Returns `model` if its arm can be driven, a virtual one or a real one.

    Raises:
        ModelError: It cannot; the message says what is possible.
    """
    return model if find_missing_feature(model, "simulation") is None else require_feature(model, "driving")


def _robots_of(makers: Iterable[Maker]) -> tuple[str, ...]:
    return tuple(name for maker in makers for name in maker.robots)
