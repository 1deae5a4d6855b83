"""The state of the page, as one frozen value, and its store."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

from rcilab.app.app_state import AppState
from rcilab.app.cell.cell_state import CellState, checked_cell
from rcilab.app.check.check_state import CheckState
from rcilab.app.control_lock import ControlLock
from rcilab.app.jog.jog_state import JogState
from rcilab.app.learn.learn_state import LearnState
from rcilab.app.link.page_link import LinkQuestion
from rcilab.app.program.path_state import PathState
from rcilab.app.program.program_draft import ProgramState
from rcilab.app.run.active_force import PushState
from rcilab.app.scene.scene_extras import SceneState
from rcilab.app.setup.configuration_state import SetupState
from rcilab.app.state_store import StateStore
from rcilab.core.safety_box import SafetyBox
from rcilab.i18n.translator import Message
from rcilab.i18n.units import USUAL, Units

if TYPE_CHECKING:
    from rcilab.app.run.export_actions import Export
    from rcilab.app.run.replay import Replay
    from rcilab.cell.cell import Cell
    from rcilab.model.robot_model import RobotModel
    from rcilab.recording.run_summary import RunSummary

Theme = Literal["light", "dark"]


@dataclass(frozen=True, slots=True)
class RunsFolder:
    """The folder of recorded runs, and what is to be deleted."""

    count: int = 0
    size: int = 0
    """[bytes]."""
    keep: int = 20
    """Number of newest ones to keep."""
    asked: bool = False
    """Whether deleting awaits a second confirmation."""
    runs: tuple[RunSummary, ...] = ()
    """The newest ones, newest first."""


@dataclass(frozen=True, eq=False, kw_only=True)
class UiState(AppState):
    """All settings of the operator on the page, and all values computed from them."""

    push: PushState = field(default_factory=PushState)
    typed_address: str = ""
    """The address that awaits a second confirmation."""
    reboot_asked: bool = False
    """Whether the question about a restart of the controller awaits its answer."""
    solid: Cell | None = None
    """The cell that the virtual controller was started with."""
    jog: JogState = field(default_factory=JogState)
    setup: SetupState = field(default_factory=SetupState)
    """Safety box, tool, load, force-control frame; `model` has this tool and this load."""
    cell: CellState = field(default_factory=CellState)
    scene: SceneState = field(default_factory=SceneState)
    """Values computed for the scene."""
    program: ProgramState = field(default_factory=ProgramState)
    paths: PathState = field(default_factory=PathState)
    check: CheckState = field(default_factory=CheckState)
    learn: LearnState = field(default_factory=LearnState)
    link: LinkQuestion | None = None
    """The link that replaces something once its page has confirmed that."""
    folder: RunsFolder = RunsFolder()
    replay: Replay | None = None
    """A recorded run that is shown in place of the robot; nothing can be executed meanwhile."""
    export: Export | None = None
    """The export in progress."""
    busy: Message | None = None
    """The job in progress."""
    loop: bool = False
    """Whether the preview is repeated."""
    rate: float = 1.0
    plot_joint: int = 0
    """Joint shown in the plots, from 1; 0 shows all."""
    plots: frozenset[str] = frozenset({"q", "dq", "ddq", "jerk", "error", "tool"})
    """The visible plots; those of errors once there are some."""
    turns: tuple[bool, bool] = (False, False)
    """Whether there is an edit to undo, and one to repeat, on the whole page."""
    language: str = "en"
    units: Units = USUAL
    """Units in which angles and lengths are shown and typed; values are stored in SI."""
    quality: str = "full"
    is_quality_chosen: bool = False
    """Whether the operator chose it; otherwise it is "light" for a browser without a graphics card."""
    theme: Theme = "light"
    height: float = 800.0
    """Height of the newest page's window, [px]: the plots fill it."""
    control_lock: ControlLock = field(default_factory=ControlLock)
    entered: Mapping[int | None, float] = field(default_factory=lambda: MappingProxyType({}))
    """Time at which a page last reported that its typed text is complete, by page, [s] of the monotonic clock."""

    @property
    def box(self) -> SafetyBox | None:
        """The safety box that plans are checked with."""
        return self.setup.wanted.box

    def cell_for(self, model: RobotModel) -> Cell | None:
        """Returns the cell that plans for an arm are checked in, with its tool and load; None without one."""
        cell = self.cell.cell
        return None if cell is None or cell.model != model.name else checked_cell(cell, model)


class Store(StateStore[UiState]):
    """The state of the page. One thread, the dispatcher's, writes; any thread may read a snapshot."""
