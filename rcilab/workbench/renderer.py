"""Shows changes of state and robot in stage, panels and bar: at once, but at most thirty times a second."""

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING, Any

from rcilab.app.connection import PageConnection
from rcilab.app.failures import Failures
from rcilab.app.learn.learn_state import displayed_state
from rcilab.app.run.played_motion import moment_played
from rcilab.app.store import Store
from rcilab.app.text import Text
from rcilab.control_process.status import SupervisorStatus
from rcilab.core.clock import CYCLE_TIME
from rcilab.views.viser_ext.persistent_tab import PersistentTab
from rcilab.workbench.live import LiveChannel
from rcilab.workbench.page import dress
from rcilab.workbench.panels import Panel
from rcilab.workbench.panels.arm_state import ArmStatePanel
from rcilab.workbench.panels.branches import BranchesPanel
from rcilab.workbench.panels.cell import CellFilePanel, CellPanel
from rcilab.workbench.panels.cell_entry import CellEntryPanel, CellRestPanel
from rcilab.workbench.panels.check import CheckPanel
from rcilab.workbench.panels.elbow import ElbowPanel
from rcilab.workbench.panels.extras import ExtrasPanel
from rcilab.workbench.panels.fault_injection import FaultInjectionPanel
from rcilab.workbench.panels.health import HealthPanel
from rcilab.workbench.panels.jog import JogPanel, ToolJogPanel
from rcilab.workbench.panels.learn import LearnPanel
from rcilab.workbench.panels.learn_demo import LearnDemoPanel
from rcilab.workbench.panels.learn_lesson import LearnLessonPanel
from rcilab.workbench.panels.link import LinkPanel
from rcilab.workbench.panels.mode import ModePanel
from rcilab.workbench.panels.path import PathPanel
from rcilab.workbench.panels.path_type import PathTypePanel
from rcilab.workbench.panels.poses import PosesPanel
from rcilab.workbench.panels.program import ProgramPanel
from rcilab.workbench.panels.program_file import ProgramFilePanel
from rcilab.workbench.panels.push import PushPanel
from rcilab.workbench.panels.recording import RecordingPanel
from rcilab.workbench.panels.run import RunPanel
from rcilab.workbench.panels.runs_folder import RunsFolderPanel
from rcilab.workbench.panels.settings import SettingsPanel
from rcilab.workbench.panels.setup import SetupPanel
from rcilab.workbench.panels.setup_numbers import SetupNumbersPanel
from rcilab.workbench.panels.signals import SignalsPanel
from rcilab.workbench.panels.soft_limits import SoftLimitsPanel
from rcilab.workbench.panels.status import status_values
from rcilab.workbench.panels.target import TargetPanel
from rcilab.workbench.panels.target_robot import TargetRobotPanel
from rcilab.workbench.panels.timeline import TimelinePanel
from rcilab.workbench.panels.waypoint import WaypointPanel
from rcilab.workbench.scene.stage import Stage
from rcilab.workbench.scene.waypoint_markers import ProgramMarks
from rcilab.workbench.widgets import Ask

if TYPE_CHECKING:
    import viser

    from rcilab.app.store import UiState

_PERIOD = 1.0 / 30.0  # [s] The display's rate, which leaves processor time to the robot.
_AT_REST = 0.25  # [s] Interval of counters and clocks while nothing else changes.
_READ = 0.25
"""[s] Interval at which panels of closed tabs follow. During a drag with light graphics, all numbers and plots: a page
with software rendering shows the arm only once it has applied all updates that came with it."""
_MAIN_WIDTH, _TIMELINE_WIDTH = 352, 380  # [px]
_TABS = (
    ("tab.jog", "adjustments-horizontal", JogPanel, ToolJogPanel, ArmStatePanel, PosesPanel),
    ("tab.target", "current-location", TargetPanel, ElbowPanel, BranchesPanel, PathTypePanel),
    ("tab.program", "list-numbers", ProgramPanel, WaypointPanel, ProgramFilePanel, PathPanel, LinkPanel),
    ("tab.setup", "tool", SetupPanel, SetupNumbersPanel, SoftLimitsPanel),
    ("tab.cell", "box", CellPanel, CellEntryPanel, CellRestPanel, CellFilePanel),
    ("tab.check", "clipboard-check", CheckPanel),
    (
        "tab.run",
        "player-play",
        RunPanel,
        ArmStatePanel,
        RecordingPanel,
        TargetRobotPanel,
        ModePanel,
        PushPanel,
        SignalsPanel,
        FaultInjectionPanel,
        HealthPanel,
    ),
    ("tab.learn", "school", LearnLessonPanel, LearnPanel, LearnDemoPanel),
    ("tab.settings", "settings", SettingsPanel, ExtrasPanel, RunsFolderPanel),
)

_RUN = next(number for number, (label, *_) in enumerate(_TABS) if label == "tab.run")


def tab_name(index: int) -> str:
    """Returns the key of a tab's label, counted from 0; "" for an unknown tab."""
    return _TABS[index][0] if index < len(_TABS) else ""


class Renderer:
    """Owns every handle of the page. It reads snapshots; it does not use sockets.

    Args:
        server: The page.
        store: Has the state.
        session: The robot.
        live: The bar.
        ask: Takes requests.
    """

    def __init__(
        self, server: viser.ViserServer, store: Store, session: PageConnection, live: LiveChannel, ask: Ask
    ) -> None:
        self._server, self._store, self._session, self._live, self._ask = server, store, session, live, ask
        self._stage = Stage(server, ask)
        self._marks = ProgramMarks(server)
        self._text = _text_of(store.state)
        self._panels: list[Panel] = []
        self._tab_numbers: list[int] = []  # Index of the tab of each panel.
        self._open: dict[int, int] = {}  # Number of the open tab, by page. Owned by the event loop.
        self._closed_shown = -math.inf  # [s] When the panels of closed tabs were last shown.
        self._tabs: list[PersistentTab] = []  # Those of the main panel, then that of the timeline's window.
        self._built: tuple[object, ...] | None = None
        self._theme = ""
        self._shown: tuple[object, ...] = ()
        self._next = 0.0
        self._goal: object = None
        self._owed: float | None = None  # [s] Since when the panels show an old goal.
        self._drawn: tuple[object, ...] = ()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self.errors = Failures()
        """Failures of our own code; one a second at most is printed."""

    def start(self) -> None:
        """Draws once, then continues in a separate thread."""
        self.show()
        thread = threading.Thread(target=self._run, name="renderer", daemon=True)
        thread.start()
        self._thread = thread

    def close(self) -> None:
        """Ends the thread."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(5.0)

    def open_tab(self, page: int, index: int) -> None:
        """Shows a tab as it is now, counted from 0: a page has opened it."""
        self._open[page] = index
        self._closed_shown = self._next = -math.inf
        self._store.changed.set()

    def forget(self, page: int) -> None:
        """Forgets the open tab of a page that has closed."""
        self._open.pop(page, None)

    def playhead_at(self, share: float) -> float:
        """Returns the position in the motion, 0 to 1, at a share of the plots' time axis."""
        state = displayed_state(self._store.state)
        if state.plan is None:
            return 0.0
        return moment_played(state, share * self._timeline.end) / max(state.plan.motion.duration, CYCLE_TIME)

    def show(self) -> bool:
        """Shows one snapshot, and returns whether anything had changed; without changes it costs nothing."""
        state, status = self._store.state, self._session.status()
        shown, now = (state, *_traits(status)), time.monotonic()
        if shown == self._shown and now < self._next:
            return False
        is_whole = self._draw(state, status)
        self._shown, self._next = shown, now + (_AT_REST if is_whole else _PERIOD)
        return True

    def _draw(self, state: UiState, status: SupervisorStatus) -> bool:
        """Shows a snapshot, the scene first, as it may be dragged. Returns whether everything was updated."""
        if _looks(state) != self._built:
            with self._server.atomic():  # As one batch: waking viser's loop for each message doubles the time.
                self._build(state)
        if state.theme != self._theme:
            self._theme = state.theme
            dress(self._server, state.theme)
        seen = displayed_state(state)
        self._stage.show(displayed_state(state, scene=True), _seen_status(state, status), self._text)
        self._marks.show(seen, self._text)
        is_whole = not self._can_wait(state, status)
        if is_whole:
            self._show_panels(state, seen, status)
        first = _RUN if state.watched else 0  # The tab of a page that opens.
        self._live.publish(
            **status_values(seen, status, self._text, self._timeline.end, state),
            marks=self._timeline.marks,
            tab=first,
            drawing=state.paths.drawing is not None,
        )
        return is_whole

    def _can_wait(self, state: UiState, status: SupervisorStatus) -> bool:
        """Returns whether numbers and plots wait for the dragged arm; changes of the robot never do."""
        is_dragged = state.goal is not self._goal and self._stage.is_held
        if state.quality != "light" or not is_dragged or self._drawn != _traits(status):
            return False
        now = time.monotonic()
        self._owed = now if self._owed is None else self._owed
        return now - self._owed < _READ

    def _show_panels(self, state: UiState, seen: UiState, status: SupervisorStatus) -> None:
        self._goal, self._drawn, self._owed = state.goal, _traits(status), None
        now, opened = time.monotonic(), {len(_TABS), *list(self._open.values())}
        is_all = now - self._closed_shown >= _READ
        self._closed_shown = now if is_all else self._closed_shown
        for number, panel in zip(self._tab_numbers, self._panels, strict=True):
            if is_all or number in opened:
                if panel is self._timeline:
                    panel.show(seen, _seen_status(state, status))
                else:
                    panel.show(state, status)

    def _build(self, state: UiState) -> None:
        """Creates the panels again: another language or unit changes texts, another arm its joints."""
        gui: Any = self._server.gui  # Icons are plain strings here, which viser's types do not allow.
        if not self._tabs:
            self._lay_out(gui)
        self._text = _text_of(state)
        self._built = _looks(state)
        gui.set_panel_label(self._text("panel.main"))
        self._panels, self._tab_numbers = [], []
        self._closed_shown = -math.inf
        for number, (tab, (label, _, *kinds)) in enumerate(zip(self._tabs, _TABS, strict=False)):
            with tab.rebuild(self._text(label)):
                for kind in kinds:
                    panel = kind(self._text, self._ask)
                    panel.build(gui, state)
                    self._panels.append(panel)
                    self._tab_numbers.append(number)
        self._timeline = TimelinePanel(self._text, self._ask)
        with self._tabs[-1].rebuild(self._text("panel.timeline")):
            self._timeline.build(gui, displayed_state(state))
        self._panels.append(self._timeline)
        self._tab_numbers.append(len(_TABS))

    def _lay_out(self, gui: Any) -> None:
        """Creates the containers of the panels; they stay as arranged by the operator."""
        group, window = gui.add_tab_group(), gui.add_panel()
        window.dock_left()
        window.set_width(_TIMELINE_WIDTH)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_MAIN_WIDTH)
        self._tabs = [PersistentTab(group.add_tab, icon) for _, icon, *_ in _TABS]
        self._tabs.append(PersistentTab(window.add_tab, "timeline"))

    def _run(self) -> None:
        while not self._ending.is_set():
            self._store.changed.clear()
            began, has_drawn = time.monotonic(), True
            try:
                has_drawn = self.show()
            except Exception as error:  # A panel that fails must not stop the others.
                self.errors.report(error)
            if has_drawn:  # A slow page must not delay others.
                self._ending.wait(max(0.3 * _PERIOD, began + _PERIOD - time.monotonic()))
            else:
                self._store.changed.wait(_PERIOD)


def _text_of(state: UiState) -> Text:
    return Text(state.language, state.units, state.model.description.maker)


def _traits(status: SupervisorStatus) -> tuple[object, ...]:
    """Returns the values of the robot whose changes are shown at once; the others change all the time."""
    q, q_c = ((None if angles is None else angles.tobytes()) for angles in (status.q, status.q_c))
    return (
        status.phase, status.code, status.message, status.incident, status.address, status.robot_mode, status.faults,
        status.powered, status.T_flange_tool, status.setup, status.speed_override, q, q_c,
    )  # fmt: skip


def _looks(state: UiState) -> tuple[object, ...]:
    """Returns the values that the panels are created for."""
    return state.language, state.units, state.model.name, displayed_state(state).model.name


def _seen_status(state: UiState, status: SupervisorStatus) -> SupervisorStatus:
    """Returns the status for scene and timeline: beside an opened run, the robot is not shown."""
    return status if state.replay is None else SupervisorStatus()
