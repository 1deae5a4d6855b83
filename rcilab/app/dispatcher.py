"""The thread that acts: it takes requests from the queue, validates them, and replaces the state."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, TypeVar

from rcilab.app.autosave import Autosave, SavedState
from rcilab.app.cell.cell_actions import CellActions, EditCell
from rcilab.app.check.check_actions import CheckActions
from rcilab.app.connection import PageConnection
from rcilab.app.control_lock import ClientHeartbeat
from rcilab.app.control_lock_actions import (
    AnswerControls,
    ControlLockActions,
    PageClosed,
    PageOpened,
    Refuse,
    TakeControls,
)
from rcilab.app.edit_history import EditHistory
from rcilab.app.failures import Failures
from rcilab.app.goal.goal_actions import GoalActions, PoseGoal
from rcilab.app.goal.named_pose_actions import NamedPoseActions
from rcilab.app.jog.jog_actions import JogActions
from rcilab.app.learn.learn_actions import LearnActions
from rcilab.app.link.link_actions import LinkActions
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.program.program_actions import ProgramActions
from rcilab.app.request import Moving, Request, TypeField
from rcilab.app.run.export_actions import CancelExport, Deliver, ExportActions, ExportRun
from rcilab.app.run.folder_actions import ClearRuns, FolderActions
from rcilab.app.run.mode_actions import ModeActions
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.push_actions import PushActions
from rcilab.app.run.replay_actions import CloseRun, OpenRun, ReplayActions
from rcilab.app.run.run_actions import RobotCommand, RunActions
from rcilab.app.run.signal_actions import SignalActions
from rcilab.app.run.target_robot_actions import TargetRobotActions
from rcilab.app.run.watch_actions import WatchActions
from rcilab.app.run.world_actions import PressSafety, WorldActions
from rcilab.app.scene.scene_actions import SceneActions
from rcilab.app.setup.configuration_state import name_parts
from rcilab.app.setup.setup_actions import OpenTab, PressSetup, SetupActions, is_setup_field
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.app.view_actions import (
    CommitField,
    DrawInSoftware,
    DropProblem,
    Play,
    Seek,
    SetRecording,
    SetView,
    ShowPlot,
    ViewActions,
)
from rcilab.core.errors import RcilabError
from rcilab.core.memory import memory_needed
from rcilab.i18n.translator import message

_TICK = 0.03  # [s] About the display's rate; also the interval between two reads of the robot's status.
_REFUSAL_INTERVAL = 1.0  # [s] Minimum time between two answers to a page that acts without the controls.

_DURING_REPLAY = (
    Seek, Play, SetView, ShowPlot, SetRecording, CommitField, DropProblem, DrawInSoftware, OpenTab, ExportRun,
    CancelExport, ClearRuns, OpenRun, CloseRun, PressSafety, TakeControls, AnswerControls, PageOpened, PageClosed,
    Refuse,
)  # fmt: skip
"""What a page may ask for while it shows a recorded run, besides Stop: nothing that plans or moves."""

T = TypeVar("T")


class CoalescingQueue(Generic[T]):
    """A queue in which a newer request can replace a waiting older one.

    During a drag, twenty positions per second arrive; only the newest needs a solution.
    """

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._waiting: deque[tuple[str | None, T]] = deque()

    def put(self, request: T, key: str | None = None) -> None:
        """Appends a request and returns at once.

        Args:
            request: The request.
            key: The newest waiting request with the same key is replaced.
        """
        with self._condition:
            if key is not None and self._waiting and self._waiting[-1][0] == key:
                self._waiting[-1] = (key, request)
            else:
                self._waiting.append((key, request))
            self._condition.notify()

    def take(self, timeout: float) -> T | None:
        """Returns the oldest request, or None if none came within `timeout`, [s]."""
        with self._condition:
            if not self._waiting:
                self._condition.wait(timeout)
            return self._waiting.popleft()[1] if self._waiting else None


class Dispatcher:
    """Owns the state and the connection; all others read snapshots.

    Args:
        store: The state.
        connection: The robot.
        deliver: Sends a file to a page.
        autosave: Saves goal and program for a restart after a crash; None: nothing is saved.
        presence: When each page last sent a heartbeat.
        watch: Shows the motions of a foreign client; None for a robot of the page's own.
    """

    def __init__(
        self,
        store: Store,
        connection: PageConnection,
        deliver: Deliver = lambda page, name, stream, is_cancelled: True,
        autosave: Autosave | None = None,
        presence: ClientHeartbeat | None = None,
        watch: WatchActions | None = None,
    ) -> None:
        self._store, self._connection = store, connection
        self._autosave = autosave or Autosave(None)
        self._goal = GoalActions(store, connection)
        self.run = RunActions(store, connection)
        self._mode = ModeActions(store, connection)
        self._target_robot = TargetRobotActions(store, connection, self.run)
        self._world = WorldActions(store, connection)
        self._signals = SignalActions(store, connection, self.run.requests)
        self._push = PushActions(store, connection)
        self._setup = SetupActions(store, connection)
        self._cell = CellActions(store, self._setup)
        self._jog = JogActions(store, connection, self._goal)
        self._poses = NamedPoseActions(store, self._goal)
        self._program = ProgramActions(store, connection, self._goal)
        self._check = CheckActions(store, connection, self._goal, self._program)
        self._learn = LearnActions(store, connection)
        self._link = LinkActions(store, connection, self.run, self._program, self._cell)
        self._history = EditHistory(
            store,
            {
                "goal": lambda what: self._goal.pose_goal(PoseGoal(name=what)),
                "program": lambda what: self._program.editing.edit(EditProgram(what=what)),
                "cell": lambda what: self._cell.edit(EditCell(what=what)),
                "setup": lambda what: self._setup.press(PressSetup(what=what)),
            },
        )
        self._view = ViewActions(store)
        self._control_lock = ControlLockActions(store, connection, presence or ClientHeartbeat())
        self._scene = SceneActions(store, self._goal)
        self._export = ExportActions(store, deliver)
        self._folder = FolderActions(store)
        self._replay = ReplayActions(store, connection)
        self._watch = watch
        self._requests: CoalescingQueue[Request] = CoalescingQueue()
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()
        self._refused_at: dict[tuple[int | None, int | None], float] = {}  # Page and holder -> time, [s].
        self._refused_for: int | None = None  # Holder when another page was last refused.
        self.errors = Failures()
        """Failures of our own code; at most one a second is printed and shown on the page."""
        features = (
            self._goal, self._poses, self._scene, self._setup, self._cell, self._jog, self._push, self._program,
            self._program.editing, self._program.paths, self._check, self._learn, self.run, self._target_robot,
            self._mode, self._world, self._signals, self._view, self._export, self._folder, self._control_lock,
            self._link, self._history, self._replay,
        )  # fmt: skip
        self._handlers = {kind: act for feature in features for kind, act in feature.handlers.items()}
        self._handlers |= {
            TypeField: self._type_field,
            OpenTab: self._open_tab,
            RobotCommand: self._drive,
            Refuse: self._refuse,
        }

    def ask(self, request: Request) -> None:
        """Takes a request and returns at once; callable from any thread."""
        if isinstance(request, Moving):
            request = replace(request, stops=self._connection.stops)
        self._requests.put(request, request.replaces)

    def resume(self, *, language: str | None = None) -> None:
        """Restores the state of the previous workbench; before `start`.

        Args:
            language: The language of this start; None: the one chosen last.
        """
        kept = self._autosave.recall(self._store.state.model)
        for name, value in self._autosave.recall_looks().items():
            if name != "language" or language is None:
                self._view.set_view(SetView(page=None, name=name, value=value))
        if kept is not None:
            self._guard(lambda: self._resume(kept))
        for name, setup in self._autosave.recall_setups(self._store.state.model).items():
            self.run.remember_setup(name, setup)
        for program in self._autosave.recall_programs(self._store.state.model):
            self._program.lay_aside(program)
        for cell in self._autosave.recall_cells(self._store.state.model):
            self._cell.restore(cell)

    def start(self) -> None:
        """Starts the thread."""
        thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)
        thread.start()
        self._thread = thread

    def close(self) -> None:
        """Ends the thread."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(10.0)
        self._goal.close()
        self._cell.close()
        self._jog.release()
        self._push.close()
        self._world.close()
        self._program.close()
        self._check.close()
        self._learn.close()
        self._scene.close()
        self.run.close()
        self._export.close()
        self._replay.close()
        self._autosave.close(self._store.state)

    def act(self, request: Request) -> None:
        """Carries out one request; an error becomes a message on the page."""
        lock = self._store.state.control_lock
        if request.needs_control and not lock.allows(request.page) and not _is_stop(request):
            if not request.is_silent:
                self._refuse(request)
            return
        if self._store.state.replay is not None and not (isinstance(request, _DURING_REPLAY) or _is_stop(request)):
            if not request.is_silent:
                self._replay.refuse()
            return
        if _reloads_pages(request) and is_moving(self._connection.status()):
            self._store.notify("warn", message("ready.moving"), page=request.page)
            return
        self._guard(lambda: self._handlers[type(request)](request))

    def tick(self, elapsed: float) -> None:
        """Does periodic work: advances the preview, reads the robot's status, completes a plan."""
        self._view.advance(elapsed)
        self._control_lock.tick()
        if self._store.state.control_lock.holder != self._refused_for:
            self._store.clear_notices("control_lock")
        if self._watch is not None:
            self._watch.tick()
        event = self.run.watch()
        self._cell.tick()
        # The plan may already exist when the status arrives.
        if event == "arm_known" and self._store.state.plan is None:
            self._goal.plan()
        elif event == "standstill":
            self._goal.catch_up()
        self._goal.settle()
        status = self._connection.status()
        self._push.tick(status)
        self._mode.tick(status)
        self._world.tick(status)
        self._signals.tick(status)
        self._setup.tick(status)
        self._jog.tick(elapsed)
        self._poses.tick()
        self._folder.tick()
        self._replay.tick()
        self._program.tick()
        self._program.paths.tick()
        self._check.tick()
        self._learn.tick()
        self._scene.tick()
        self._history.tick()
        self._autosave.keep(self._store.state)

    def _resume(self, kept: SavedState) -> None:
        back: list[str] = [] if kept.program is None else ["program"]
        back += [] if kept.cell is None else ["cell"]
        back += kept.setup.parts
        self._setup.restore(kept.setup)
        if kept.cell is not None:
            self._cell.restore(kept.cell)
        if kept.q is not None:
            self._goal.set_joints(kept.q)
        if kept.program is not None and kept.program.model == self._store.state.model.name:
            self._program.restore(kept.program)
        if kept.q is not None:
            self._store.notify("good", message("notice.resumed"))
        elif back:
            name = self._store.state.model.name
            self._store.notify("good", message("setup.back", what=name_parts(tuple(back)), model=name))

    def _refuse(self, request: Request) -> None:
        """Informs a page that it is a spectator, unless it has the controls by now."""
        lock = self._store.state.control_lock
        now = time.monotonic()
        refused = (request.page, lock.holder)
        if lock.allows(request.page) or now - self._refused_at.get(refused, -_REFUSAL_INTERVAL) < _REFUSAL_INTERVAL:
            return
        self._refused_at = {key: at for key, at in self._refused_at.items() if now - at < _REFUSAL_INTERVAL}
        self._refused_at[refused] = now
        self._refused_for = lock.holder
        code = "control_lock.free" if lock.holder is None else "notice.watching"
        sentence = message(code, page=lock.number(lock.holder))
        self._store.notify("warn", sentence, page=request.page, cause="control_lock")

    def _drive(self, request: RobotCommand) -> None:
        if request.what == "pause":
            self._mode.pause()
        elif request.what == "resume":
            self._mode.resume()
        else:
            self.run.drive(request)

    def _open_tab(self, request: OpenTab) -> None:
        """Only the open tab has handles in the scene."""
        self._setup.open_tab(request)
        if request.name != "tab.cell":
            self._cell.deselect()

    def _type_field(self, request: TypeField) -> None:
        if is_setup_field(request.field):
            self._setup.type_field(request)
        elif request.field.startswith("cell."):
            self._cell.type_field(request)
        elif request.field.startswith("control."):
            self._mode.type_field(request)
        elif request.field.startswith("program."):
            self._program.editing.type_field(request)
        elif request.field.startswith("path."):
            self._program.paths.type_field(request)
        else:
            self._goal.type_field(request)

    def _run(self) -> None:
        last = time.monotonic()
        while not self._ending.is_set():
            request = self._requests.take(max(0.0, last + _TICK - time.monotonic()))
            if request is not None:
                self.act(request)
                self._store.changed.set()
            now = time.monotonic()
            if now - last >= _TICK:
                elapsed, last = now - last, now
                self._guard(lambda elapsed=elapsed: self.tick(elapsed), cause="tick")
                self._store.changed.set()

    def _guard(self, action: Callable[[], None], cause: str = "") -> None:
        """Shows the error of an action; with a `cause`, once until the action succeeds again."""
        try:
            with memory_needed():
                action()
        except RcilabError as error:
            if not cause or all(notice.cause != cause for notice in self._store.state.notices):
                self._store.notify("bad", explain_error(error), cause=cause)
        except Exception as error:  # A bug of ours must neither end the thread nor stay unnoticed.
            if self.errors.report(error):
                self._store.notify("bad", message("notice.bug", error=f"{type(error).__name__}: {error}"))
        else:
            if cause:
                self._store.clear_notices(cause)


def _is_stop(request: Request) -> bool:
    return isinstance(request, RobotCommand) and request.what == "stop"


def _reloads_pages(request: Request) -> bool:
    """Returns whether pages reload for a request; a motion would stop, as no page is open meanwhile."""
    is_graphics = isinstance(request, SetView) and request.name == "quality"
    return is_graphics or isinstance(request, DrawInSoftware)
