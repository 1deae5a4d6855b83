"""What the page shows, as one frozen value, and the one place where it is exchanged."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from rcilab.app.check.check_state import CheckState
from rcilab.app.control_lock import ControlLock
from rcilab.app.goal.goal import Goal
from rcilab.app.goal.target_status import Tone
from rcilab.app.jog.jog_state import JogState
from rcilab.app.learn.learn_state import LearnState
from rcilab.app.planning import PathKind, Plan, PlannableLaw
from rcilab.app.program.program_draft import ProgramState
from rcilab.app.run.active_force import Plant, PushState
from rcilab.app.run.drive_state import DriveState
from rcilab.app.run.recording import Recording
from rcilab.app.scene.scene_extras import SceneState
from rcilab.app.setup.configuration_state import SetupState
from rcilab.app.text import Message
from rcilab.core.spatial import Pose
from rcilab.i18n.units import USUAL, Units
from rcilab.model.robot_model import RobotModel

if TYPE_CHECKING:
    from rcilab.app.run.export_actions import Export
    from rcilab.motion import Motion

Theme = Literal["light", "dark"]

_UNDO_DEPTH = 100
_NOTICES = 4  # Kept of each page, and of all pages together; a choice.


@dataclass(frozen=True, slots=True)
class Toast:
    """Something to say once, over the scene."""

    serial: int
    tone: Tone
    text: Message
    page: int | None = None
    """Client id of the only page it concerns; None: all of them."""
    trouble: str = ""
    """Names a trouble that it reports and that can end: then it is withdrawn."""


@dataclass(frozen=True, slots=True)
class RunsFolder:
    """What the folder of recorded runs holds, and what is to be cleared away."""

    count: int = 0
    size: int = 0
    """[bytes]."""
    keep: int = 20
    """How many of the newest ones are to stay."""
    asked: bool = False
    """Whether deleting awaits a second yes."""


@dataclass(frozen=True, eq=False, kw_only=True)
class UiState:
    """Everything the operator has set and everything that was computed from it."""

    model: RobotModel
    target: str = "virtual"
    """"virtual" or an address, rci://HOST:PORT."""
    plant: Plant = "ideal"
    """What the virtual controller moves."""
    push: PushState = field(default_factory=PushState)
    drive: DriveState = field(default_factory=DriveState)
    jog: JogState = field(default_factory=JogState)
    goal: Goal
    setup: SetupState = field(default_factory=SetupState)
    """Safety box, tool, load, force-control frame; `model` has this tool and this load."""
    scene: SceneState = field(default_factory=SceneState)
    """What was computed for the scene."""
    plan: Plan | None = None
    no_plan: Message | None = None
    """Why there is no plan."""
    program: ProgramState = field(default_factory=ProgramState)
    check: CheckState = field(default_factory=CheckState)
    learn: LearnState = field(default_factory=LearnState)
    asked: Motion | None = None
    """The motion that a foreign robot is to make and that awaits a second yes."""
    recording: Recording | None = None
    last_run: Recording | None = None
    """The run that was made last, whatever was planned since: for its table and for export."""
    record: bool = True
    """Whether every cycle of a motion is written to a file as well."""
    runs: Path | None = None
    """Folder of these files; None: there is none."""
    folder: RunsFolder = RunsFolder()
    export: Export | None = None
    """What is being written for a page."""
    speed: float = 0.5
    law: PlannableLaw = "torque_rate_limited"
    way: PathKind = "joint"
    """How the tool goes to the goal."""
    via: Pose | None = None
    """What an arc leads over."""
    busy: Message | None = None
    """What is being done that takes longer than a moment."""
    place: float = 0.0
    """Where in the plan the preview stands, 0 to 1."""
    playing: bool = False
    loop: bool = False
    """Whether the preview begins again at its end."""
    rate: float = 1.0
    plot_joint: int = 0
    """Joint shown in the plots, from 1; 0 shows all."""
    plots: frozenset[str] = frozenset({"q", "dq", "ddq", "jerk", "error", "tool"})
    """Which plots are shown; those of errors once there are some."""
    language: str = "en"
    units: Units = USUAL
    """What angles and lengths are shown and typed in; nothing is kept in them."""
    quality: str = "full"
    is_quality_chosen: bool = False
    """Whether the operator chose it; otherwise a browser without a graphics card makes it "light"."""
    theme: Theme = "light"
    height: float = 800.0
    """Height of the newest page's window, [px]: the plots fill it."""
    lease: ControlLock = field(default_factory=ControlLock)
    notices: tuple[Toast, ...] = ()
    """The newest of each page and of all pages together, oldest first: what one is told takes no place of another's."""
    entered: Mapping[int | None, float] = field(default_factory=lambda: MappingProxyType({}))
    """When a page last said that what is typed in it is complete, by page, [s] of the monotonic clock."""
    problems: Mapping[str, Message] = field(default_factory=lambda: MappingProxyType({}))
    """What is wrong with typed numbers, by field."""

    @property
    def notice(self) -> Toast | None:
        """The newest notice, whomever it concerns."""
        return self.notices[-1] if self.notices else None


class Store:
    """Holds the state. One thread (the conductor's) writes, any thread may read a snapshot."""

    def __init__(self, state: UiState) -> None:
        self._lock = threading.Lock()
        self._state = state
        self._past: list[Goal] = []
        self._notices = 0
        self.changed = threading.Event()
        """Set when a request has been carried out whole, cleared by who shows it."""

    @property
    def state(self) -> UiState:
        """The newest snapshot."""
        return self._state

    def update(self, **changes: Any) -> UiState:
        """Exchanges the state for one with these fields changed, and returns it."""
        with self._lock:
            self._state = replace(self._state, **changes)
            return self._state

    def say(self, tone: Tone, text: Message, *, page: int | None = None, trouble: str = "") -> None:
        """Shows a notice, on one page or on every page.

        Args:
            tone: How it looks.
            text: What it says.
            page: Client id of the only page it concerns; None: all of them.
            trouble: Names the trouble that it reports, for `settle`.
        """
        with self._lock:
            self._notices += 1
            new = Toast(self._notices, tone, text, page, trouble)
            same = [notice for notice in self._state.notices if notice.page == page]
            gone = same[: -(_NOTICES - 1)]
            kept = (notice for notice in self._state.notices if notice not in gone)
            self._state = replace(self._state, notices=(*kept, new))

    def forget_page(self, page: int) -> None:
        """Drops what was to be said to a page that has gone."""
        with self._lock:
            self._state = replace(self._state, notices=tuple(n for n in self._state.notices if n.page != page))

    def settle(self, trouble: str) -> None:
        """Withdraws the notices of a trouble that is over."""
        with self._lock:
            notices = self._state.notices
            if any(notice.trouble == trouble for notice in notices):
                self._state = replace(self._state, notices=tuple(n for n in notices if n.trouble != trouble))

    def complain(self, field: str, problem: Message) -> None:
        """Says beside a field what is wrong with what was typed."""
        self.update(problems=MappingProxyType({**self._state.problems, field: problem}))

    def clear_problems(self, *beginnings: str) -> None:
        """Takes back what was said beside all fields whose names begin so."""
        kept = {field: said for field, said in self._state.problems.items() if not field.startswith(beginnings)}
        self.update(problems=MappingProxyType(kept))

    def remember(self) -> None:
        """Keeps the goal of this moment, to come back to with `undo`."""
        self._past = [*self._past[-_UNDO_DEPTH:], self._state.goal]

    def undo(self) -> Goal | None:
        """Returns the goal that was remembered last, or None."""
        return self._past.pop() if self._past else None

    def forget(self) -> None:
        """Drops what could be undone: it belongs to another arm."""
        self._past = []
