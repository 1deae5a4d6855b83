"""The part of the state that page and notebook share: the arm, the goal, the plan, how it is run, the last run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from rcilab.app.goal.goal import Goal, Tone
from rcilab.app.planning import PathType, Plan
from rcilab.app.run.drive_state import DriveState
from rcilab.app.run.world_state import WorldState
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message
from rcilab.model.robot_model import RobotModel
from rcilab.motion.joint import DEFAULT_JOINT_SPEED, JointLaw
from rcilab.sim.controller_config import PlantKind

if TYPE_CHECKING:
    from rcilab.app.run.recording import Recording
    from rcilab.cell.cell import Cell
    from rcilab.motion.motion import Motion


@dataclass(frozen=True, slots=True)
class Toast:
    """A message that is shown once."""

    serial: int
    tone: Tone
    text: Message
    page: int | None = None
    """Client id of the only page that shows it; None: all pages."""
    cause: str = ""
    """Key of the cause of a notice; notices with it are withdrawn together."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AppState:
    """State of the features that page and notebook have in common."""

    model: RobotModel
    target: str = "virtual"
    """"virtual" or an address, rci://HOST:PORT."""
    watched: str = ""
    """Address of the controller whose foreign client the page only watches; "" for a robot of its own."""
    plant: PlantKind = "ideal"
    """What the virtual controller drives."""
    world: WorldState = field(default_factory=WorldState)
    """The virtual controller itself: its network, wiring and buttons."""
    drive: DriveState = field(default_factory=DriveState)
    goal: Goal
    plan: Plan | None = None
    no_plan: Message | None = None
    """Why there is no plan."""
    asked: Motion | None = None
    """The motion of a foreign robot that waits for the operator's second confirmation."""
    recording: Recording | None = None
    last_run: Recording | None = None
    """The last run, whatever was planned since: for its table and for export."""
    record: bool = True
    """Whether every cycle of a motion is written to a file as well."""
    runs: Path | None = None
    """Folder of these files; None: no file is written."""
    speed: float = DEFAULT_JOINT_SPEED
    law: JointLaw = "torque_rate_limited"
    path_type: PathType = "joint"
    """How the tool moves to the goal."""
    search: float | None = None
    """Progress of the search for a path around obstacles, 0 to 1; None without one."""
    via: Pose | None = None
    """Via point of an arc."""
    playhead: float = 0.0
    """Place of the preview in the plan, 0 to 1."""
    playing: bool = False
    notices: tuple[Toast, ...] = ()
    """The newest of each page and of all pages together, oldest first: those of one page never displace others."""
    problems: Mapping[str, Message] = field(default_factory=lambda: MappingProxyType({}))
    """Problems of typed numbers, by field."""

    session_cell: Cell | None = None
    """The cell of the session that executes."""

    @property
    def is_virtual(self) -> bool:
        """Whether the robot is a virtual controller: no hardware moves."""
        return self.target == "virtual"

    @property
    def notice(self) -> Toast | None:
        """The newest notice, for any page."""
        return self.notices[-1] if self.notices else None

    @property
    def box(self) -> SafetyBox | None:
        """The safety box that plans are checked with."""
        return None

    def cell_for(self, model: RobotModel) -> Cell | None:
        """Returns the cell that plans for an arm are checked in, with its tool and load; None without one."""
        return self.session_cell
