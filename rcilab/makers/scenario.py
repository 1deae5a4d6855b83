"""A fault scenario: how one fault is provoked on a virtual controller, as a value. Each maker has its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol, TypeAlias

from numpy.typing import ArrayLike

from rcilab.conformance.common_conditions import compliant_limits
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.command import Command
from rcilab.core.fault import FaultCode
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import Mode, RobotState
from rcilab.model.robot_model import RobotModel
from rcilab.sim.api import Direction, NetworkFaults

Callback: TypeAlias = Callable[[RobotState, float], Command]
"""`(state, t) -> command`; t counts controller cycles, [s]."""

Group: TypeAlias = Literal["position", "velocity", "acceleration", "command", "contact"]
GROUPS: tuple[Group, ...] = ("position", "velocity", "acceleration", "command", "contact")
"""Groups of faults: position, velocity, acceleration and jerk, pose and torque, contact and network."""


class SimulatedWorld(Protocol):
    """Control of the simulation; a session's `SimulationControl`."""

    def push(self, wrench: ArrayLike, link: int | None = None) -> None:
        """Applies a force and a moment to a link, or to the tool."""
        ...

    def set_network(self, faults: NetworkFaults | None, direction: Direction = "both") -> None:
        """Impairs the network; None repairs it."""
        ...


class ScenarioRobot(Protocol):
    """The private robot; a session."""

    @property
    def model(self) -> RobotModel:
        """The arm."""
        ...

    @property
    def simulation(self) -> Any:
        """A `SimulatedWorld`."""
        ...

    def set_safety_box(self, box: SafetyBox) -> None:
        """Sets the safety box of the tool."""
        ...


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """The private robot, prepared by a scenario."""

    robot: ScenarioRobot
    commands: Any
    """The maker's own commands of the session, such as `robot.rci`."""
    start: RobotState
    """Position of the arm."""
    limits: Limits
    """The limits of its commands: the arm's own, narrowed or widened by settings."""
    box: SafetyBox | None = None
    """The safety box, if it is set."""

    def narrowed(self, upper: JointVector) -> Scene:
        """Returns the scene with soft limits of the joints, `upper` of shape (n,), [rad]."""
        joint = replace(self.limits.joint, upper=readonly_copy(upper))
        return replace(self, limits=replace(self.limits, joint=joint))

    def guarded(self, thresholds: JointVector) -> Scene:
        """Returns the scene with these collision thresholds, shape (n,), [N m]."""
        joint = replace(self.limits.joint, collision_threshold=readonly_copy(thresholds))
        return replace(self, limits=replace(self.limits, joint=joint))

    def yielding(self) -> Scene:
        """Returns the scene with the wider bounds on accelerations of a compliant arm."""
        return replace(self, limits=compliant_limits(self.limits))


def _as_it_is(scene: Scene) -> Scene:
    return scene


def _nothing(scene: Scene) -> None:
    del scene


def _at_home(model: RobotModel) -> JointVector:
    return model.home


@dataclass(frozen=True, eq=False, kw_only=True)
class FaultScenario:
    """One fault, and how to provoke it."""

    fault: FaultCode
    group: Group
    mode: Mode
    """The command mode."""
    act: Callable[[Scene], Callback] | None = None
    """Returns the callback that provokes the fault; None: a request does."""
    request: Callable[[Scene], tuple[FaultCode, ...]] | None = None
    """Sends requests that lead to an error, and returns the errors that are then reported; None: `act` does it."""
    prepare: Callable[[Scene], Scene] = field(default=_as_it_is)
    """Prepares the scene: narrows a limit, softens the arm. The arm does not move."""
    restore: Callable[[Scene], None] = field(default=_nothing)
    """Takes back what `prepare` has set, beyond limits and parameters, which are always reset."""
    start: Callable[[RobotModel], JointVector] = field(default=_at_home)
    """Returns the initial joint angles, shape (n,), [rad]."""
    needs_elbow: bool = False
    """Whether it needs an arm with an arm angle."""
    is_commanded: bool = False
    """Whether a command violates the condition, so that the arm does not follow it."""
    cuts_network: bool = False
    """Whether the network has to be repaired afterwards."""

    def __repr__(self) -> str:
        how = f"commanded as {self.mode}" if self.request is None else "by a refused request"
        return f"<FaultScenario {self.fault.manual_name}, {how}>"
