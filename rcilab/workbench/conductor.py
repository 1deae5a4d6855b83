"""The one thread that acts: takes requests from the mailbox, validates them, and exchanges the state."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rcilab.errors import RcilabError
from rcilab.workbench import requests
from rcilab.workbench.check.actions import CheckActions
from rcilab.workbench.failures import Failures
from rcilab.workbench.goal.actions import GoalActions
from rcilab.workbench.jog.actions import JogActions
from rcilab.workbench.jog.pose_actions import PoseActions
from rcilab.workbench.keepsake import Keepsake, Kept
from rcilab.workbench.learn.actions import LearnActions
from rcilab.workbench.lease import Presence
from rcilab.workbench.lease_actions import LeaseActions
from rcilab.workbench.mailbox import Mailbox
from rcilab.workbench.program.actions import ProgramActions
from rcilab.workbench.run.actions import RobotActions
from rcilab.workbench.run.export_actions import Deliver, ExportActions
from rcilab.workbench.run.folder_actions import FolderActions
from rcilab.workbench.run.mode_actions import ModeActions
from rcilab.workbench.run.push_actions import PushActions
from rcilab.workbench.run.readiness import is_moving
from rcilab.workbench.run.signal_actions import SignalActions
from rcilab.workbench.run.where_actions import WhereActions
from rcilab.workbench.run.world_actions import WorldActions
from rcilab.workbench.scene.actions import SceneActions
from rcilab.workbench.session import Session
from rcilab.workbench.setup.actions import SetupActions, is_setup_field
from rcilab.workbench.setup.wanted import name_parts
from rcilab.workbench.store import Store
from rcilab.workbench.telling import tell_error
from rcilab.workbench.text import message
from rcilab.workbench.view_actions import ViewActions

_TICK = 0.03  # [s] A choice: about the display's rate; also how often the robot is looked at.
_AGAIN = 1.0  # [s] A choice: a page that acts without the controls is told so once in that time.


class Conductor:
    """Owns the state and the session; everything else only reads snapshots.

    Args:
        store: The state.
        session: The robot side.
        deliver: Sends a file to a page.
        keepsake: Where goal and program are written down for the case of a crash; None: nowhere.
        presence: When pages were last heard of.
    """

    def __init__(
        self,
        store: Store,
        session: Session,
        deliver: Deliver = lambda page, name, stream, is_unwanted: True,
        keepsake: Keepsake | None = None,
        presence: Presence | None = None,
    ) -> None:
        self._store, self._session = store, session
        self._keepsake = keepsake or Keepsake(None)
        self._goal = GoalActions(store, session)
        self.robot = RobotActions(store, session)
        self._mode = ModeActions(store, session)
        self._where = WhereActions(store, session, self.robot)
        self._world = WorldActions(store, session)
        self._signals = SignalActions(store, session)
        self._push = PushActions(store, session)
        self._setup = SetupActions(store, session)
        self._jog = JogActions(store, session, self._goal)
        self._poses = PoseActions(store, self._goal)
        self._program = ProgramActions(store, session, self._goal)
        self._check = CheckActions(store, session, self._goal, self._program)
        self._learn = LearnActions(store, session)
        self._view = ViewActions(store)
        self._lease = LeaseActions(store, session, presence or Presence())
        self._scene = SceneActions(store, self._goal)
        self._export = ExportActions(store, deliver)
        self._folder = FolderActions(store)
        self._mailbox: Mailbox[requests.Request] = Mailbox()
        self._thread: threading.Thread | None = None
        self._ending = threading.Event()
        self._refused_at: dict[tuple[int | None, int | None], float] = {}  # Of page and holder, when: [s].
        self._refused_for: int | None = None  # Who held the controls when another page was last refused.
        self.errors = Failures()
        """Failures of our own code; one a second at most is printed and shown on the page."""
        self._actions: dict[type, Callable[[Any], None]] = {
            requests.MoveJoint: self._goal.move_joint,
            requests.PoseGoal: self._goal.pose_goal,
            requests.MoveTarget: self._goal.move_target,
            requests.TypeField: self._type_field,
            requests.SetArmAngle: self._goal.set_arm_angle,
            requests.ChooseBranch: self._goal.choose_branch,
            requests.DragElbow: self._scene.drag_elbow,
            requests.Peek: self._scene.peek,
            requests.Enter: self._view.enter,
            requests.DrawInSoftware: self._view.draw_in_software,
            requests.OpenTab: self._setup.open_tab,
            requests.ShowBead: self._scene.show_bead,
            requests.ShowExtra: self._scene.show_extra,
            requests.SetWay: self._goal.set_way,
            requests.Plan: self._goal.plan,
            requests.PlanRecovery: self._goal.plan_recovery,
            requests.SetSpeed: self._goal.set_speed,
            requests.SetLaw: self._goal.set_law,
            requests.Drive: self._drive,
            requests.SetDrive: self._mode.set_drive,
            requests.PressControl: self._mode.press,
            requests.SetNetwork: self._world.set_network,
            requests.PressSafety: self._world.press_safety,
            requests.SetWiring: self._world.set_wiring,
            requests.SetOutput: self._signals.set_output,
            requests.PressSignals: self._signals.press,
            requests.ChooseDestination: self._where.choose,
            requests.ChooseRobot: self.robot.choose_robot,
            requests.SetJog: self._jog.set_jog,
            requests.HoldJog: self._jog.hold,
            requests.PressJog: self._jog.press,
            requests.NamedPose: self._poses.act,
            requests.SetPush: self._push.set_push,
            requests.HoldPush: self._push.hold,
            requests.PullArm: self._push.pull,
            requests.MoveSetup: self._setup.move,
            requests.ResizeBox: self._setup.resize,
            requests.SetSetup: self._setup.set_setup,
            requests.PressSetup: self._setup.press,
            requests.EditProgram: self._program.editing.edit,
            requests.PlanProgram: self._program.plan,
            requests.CancelProgram: self._program.cancel,
            requests.LoadProgram: self._program.load,
            requests.Check: self._check.press,
            requests.Learn: self._learn.press,
            requests.Seek: self._view.seek,
            requests.Play: self._view.play,
            requests.SetView: self._view.set_view,
            requests.ShowPlot: self._view.show_plot,
            requests.Export: self._export.export,
            requests.CancelExport: self._export.cancel,
            requests.ClearRuns: self._folder.clear,
            requests.SetRecording: self._view.set_recording,
            requests.Refuse: self._refuse,
            requests.TakeControls: self._lease.take_controls,
            requests.AnswerControls: self._lease.answer,
            requests.PageCame: self._lease.page_came,
            requests.PageWent: self._lease.page_went,
        }

    def ask(self, request: requests.Request) -> None:
        """Takes a request and returns at once; callable from any thread."""
        if isinstance(request, requests.Moving):
            request = replace(request, stops=self._session.stops)
        self._mailbox.put(request, _coalescing_key(request))

    def resume(self, *, language: str | None = None) -> None:
        """Brings back what the workbench before this one had; before `start`.

        Args:
            language: The one that was asked for this time; None is the one that was chosen last.
        """
        kept = self._keepsake.recall(self._store.state.model)
        for name, value in self._keepsake.recall_looks().items():
            if name != "language" or language is None:
                self._view.set_view(requests.SetView(page=None, name=name, value=value))
        if kept is not None:
            self._guard(lambda: self._resume(kept))
        for name, setup in self._keepsake.recall_setups(self._store.state.model).items():
            self.robot.remember_setup(name, setup)
        for program in self._keepsake.recall_programs(self._store.state.model):
            self._program.lay_aside(program)

    def start(self) -> None:
        """Starts the thread."""
        thread = threading.Thread(target=self._run, name="conductor", daemon=True)
        thread.start()
        self._thread = thread

    def close(self) -> None:
        """Ends the thread."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(10.0)
        self._jog.release()
        self._push.close()
        self._world.close()
        self._program.close()
        self._check.close()
        self._learn.close()
        self._scene.close()
        self.robot.close()
        self._export.close()
        self._keepsake.close(self._store.state)

    def act(self, request: requests.Request) -> None:
        """Carries out one request; what goes wrong becomes a sentence on the page."""
        lease = self._store.state.lease
        if not isinstance(request, requests.Harmless) and not lease.allows(request.page) and not _is_stop(request):
            if not isinstance(request, requests.Silent):
                self._refuse(request)
            return
        if _reloads_pages(request) and is_moving(self._session.status()):
            self._store.say("warn", message("ready.moving"), page=request.page)
            return
        self._guard(lambda: self._actions[type(request)](request))

    def tick(self, elapsed: float) -> None:
        """Does what time asks for: the preview plays on, the robot is looked at, a plan completed."""
        self._view.advance(elapsed)
        self._lease.tick()
        if self._store.state.lease.holder != self._refused_for:
            self._store.settle("lease")
        event = self.robot.watch()
        if event == "placed":
            self._goal.plan()
        elif event == "rested":
            self._goal.catch_up()
        self._goal.settle()
        status = self._session.status()
        self._push.tick(status)
        self._mode.tick(status)
        self._world.tick(status)
        self._signals.tick(status)
        self._setup.tick(status)
        self._jog.tick(elapsed)
        self._poses.tick()
        self._folder.tick()
        self._program.tick()
        self._check.tick()
        self._learn.tick()
        self._scene.tick()
        self._keepsake.keep(self._store.state)

    def _resume(self, kept: Kept) -> None:
        back: list[str] = [] if kept.program is None else ["program"]
        back += kept.setup.parts
        self._setup.restore(kept.setup)
        if kept.q is not None:
            self._goal.pose(kept.q)
        if kept.program is not None and kept.program.model == self._store.state.model.name:
            self._program.restore(kept.program)
        if kept.q is not None:
            self._store.say("good", message("notice.resumed"))
        elif back:
            name = self._store.state.model.name
            self._store.say("good", message("setup.back", what=name_parts(tuple(back)), model=name))

    def _refuse(self, request: requests.Request) -> None:
        """Tells a page that it only watches, unless it has got the controls meanwhile."""
        lease = self._store.state.lease
        now = time.monotonic()
        refused = (request.page, lease.holder)
        if lease.allows(request.page) or now - self._refused_at.get(refused, -_AGAIN) < _AGAIN:
            return
        self._refused_at = {key: at for key, at in self._refused_at.items() if now - at < _AGAIN}
        self._refused_at[refused] = now
        self._refused_for = lease.holder
        code = "lease.free" if lease.holder is None else "notice.watching"
        said = message(code, page=lease.number(lease.holder))
        self._store.say("warn", said, page=request.page, trouble="lease")

    def _drive(self, request: requests.Drive) -> None:
        if request.what == "pause":
            self._mode.pause()
        elif request.what == "resume":
            self._mode.resume()
        else:
            self.robot.drive(request)

    def _type_field(self, request: requests.TypeField) -> None:
        if is_setup_field(request.field):
            self._setup.type_field(request)
        elif request.field.startswith("control."):
            self._mode.type_field(request)
        elif request.field.startswith("program."):
            self._program.editing.type_field(request)
        else:
            self._goal.type_field(request)

    def _run(self) -> None:
        last = time.monotonic()
        while not self._ending.is_set():
            request = self._mailbox.take(max(0.0, last + _TICK - time.monotonic()))
            if request is not None:
                self.act(request)
                self._store.changed.set()
            now = time.monotonic()
            if now - last >= _TICK:
                elapsed, last = now - last, now
                self._guard(lambda elapsed=elapsed: self.tick(elapsed))
                self._store.changed.set()

    def _guard(self, action: Callable[[], None]) -> None:
        try:
            action()
        except RcilabError as error:
            self._store.say("bad", tell_error(error))
        except Exception as error:  # A bug of ours must neither end the thread nor stay unseen.
            if self.errors.report(error):
                self._store.say("bad", message("notice.bug", error=f"{type(error).__name__}: {error}"))


def _coalescing_key(request: requests.Request) -> str | None:
    """Returns what a newer request replaces an older one by: drags and sliders, nothing that is pressed once."""
    if isinstance(request, requests.MoveTarget) and not request.ended:
        return f"target.{request.page}"
    if isinstance(request, requests.MoveJoint):
        return f"joint.{request.joint}.{request.page}"
    if isinstance(request, requests.MoveSetup | requests.ResizeBox) and not request.ended:
        return f"{type(request).__name__}.{request.page}"
    if isinstance(request, requests.DragElbow) and request.phase == "update":
        return f"elbow.{request.page}"
    if isinstance(request, requests.PullArm) and request.phase == "update":
        return f"pull.{request.page}"
    if isinstance(request, requests.SetNetwork) and request.name is not None:
        return f"network.{request.name}.{request.page}"
    if isinstance(request, requests.SetDrive) and request.pace is not None:
        return f"pace.{request.page}"
    if isinstance(
        request,
        requests.Seek | requests.SetSpeed | requests.SetArmAngle | requests.HoldPush | requests.HoldJog | requests.Peek,
    ):
        return f"{type(request).__name__}.{request.page}"
    return None


def _is_stop(request: requests.Request) -> bool:
    return isinstance(request, requests.Drive) and request.what == "stop"


def _reloads_pages(request: requests.Request) -> bool:
    """Returns whether pages load themselves again for a request; a motion would stop for want of a page."""
    is_graphics = isinstance(request, requests.SetView) and request.name == "quality"
    return is_graphics or isinstance(request, requests.DrawInSoftware)
