"""What a recipe is: how one fault is provoked, as a value. The recipes themselves are in `commands` and `arm`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from rcilab.conformance.common_conditions import yielding_limits
from rcilab.core.arrays import JointVector, readonly_copy
from rcilab.core.limits import Limits
from rcilab.core.safety_box import SafetyBox
from rcilab.core.state import Mode, RobotState
from rcilab.execution.control_loop import Callback
from rcilab.makers.rokae.faults import Fault

if TYPE_CHECKING:
    from rcilab.execution.session import RobotSession

Group: TypeAlias = Literal["position", "velocity", "acceleration", "command", "contact"]
GROUPS: tuple[Group, ...] = ("position", "velocity", "acceleration", "command", "contact")
"""What the gallery is hung by: where the arm is, how fast, how suddenly, what is no command, contact and network."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """The private robot as a recipe has prepared it."""

    robot: RobotSession
    start: RobotState
    """Where it stands."""
    limits: Limits
    """What it is judged by: the arm's own limits, narrowed or widened by what was set."""
    box: SafetyBox | None = None
    """The safety box that was set."""

    def narrowed(self, upper: JointVector) -> Scene:
        """Returns the scene with soft limits of the joints, `upper` of shape (n,), [rad]."""
        joint = replace(self.limits.joint, upper=readonly_copy(upper))
        return replace(self, limits=replace(self.limits, joint=joint))

    def guarded(self, thresholds: JointVector) -> Scene:
        """Returns the scene with these collision thresholds, shape (n,), [N m]."""
        joint = replace(self.limits.joint, collision_threshold=readonly_copy(thresholds))
        return replace(self, limits=replace(self.limits, joint=joint))

    def yielding(self) -> Scene:
        """Returns the scene with the wider bounds on accelerations that a yielding arm has."""
        return replace(self, limits=yielding_limits(self.limits))


def _as_it_is(scene: Scene) -> Scene:
    return scene


@dataclass(frozen=True, eq=False, kw_only=True)
class FaultScenario:
    """One fault, and what makes a controller report it."""

    fault: Fault
    group: Group
    mode: Mode
    """How the arm is commanded."""
    act: Callable[[Scene], Callback]
    """Returns the callback that does it wrong."""
    prepare: Callable[[Scene], Scene] = field(default=_as_it_is)
    """Sets the scene: narrows a limit, softens the arm. Nothing moves."""
    pose: tuple[float, ...] | None = None
    """Joint angles of a 7-axis arm that it begins at, [rad]; None: the arm's home."""
    needs_elbow: bool = False
    """Whether it takes an arm of 7 axes."""

    @property
    def place(self) -> tuple[int, bool]:
        """Where it hangs in its group: what is commanded beside what is measured of the same quantity."""
        name = self.fault.name.removeprefix("ACTUAL_").removeprefix("COMMAND_")
        first = min(fault for fault in Fault if fault.name.endswith(name))
        return int(first), self.fault.name.startswith("ACTUAL_")

    def start(self, home: JointVector) -> JointVector:
        """Returns where the arm is to stand at the beginning, shape (n,), [rad]."""
        if self.pose is None:
            return home
        pose = np.array(self.pose)
        return pose if len(home) == 7 else np.delete(pose, 2)

    def __repr__(self) -> str:
        return f"<Recipe {self.fault.manual_name}, commanded as {self.mode}>"
