"""The workbench: opens the page first, then everything that takes time, and closes it all again."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING
from urllib.parse import quote

from rcilab.app.autosave import Autosave, autosave_file
from rcilab.app.cell.cell_actions import SelectEntry
from rcilab.app.check.check_actions import PressCheck
from rcilab.app.connection import PageConnection
from rcilab.app.control_lock import ClientHeartbeat
from rcilab.app.control_lock_actions import AnswerControls, PageClosed, PageOpened, Refuse, TakeControls
from rcilab.app.dispatcher import Dispatcher
from rcilab.app.edit_history import TurnBack
from rcilab.app.goal.goal import goal_at
from rcilab.app.goal.goal_actions import ChooseBranch
from rcilab.app.link.link_actions import AnswerLink, OpenLink
from rcilab.app.program.edit_actions import EditProgram, ShowRows
from rcilab.app.program.path_actions import DrawPath
from rcilab.app.request import Request
from rcilab.app.robot_connection import RobotConnection
from rcilab.app.run.replay import replayed, require_replayable
from rcilab.app.run.replay_actions import OpenRun
from rcilab.app.run.run_actions import RobotCommand
from rcilab.app.run.watch_actions import WatchActions
from rcilab.app.run.watched_controller import WatchedController
from rcilab.app.scene.scene_actions import CutWorkspace, EditElbow, HighlightBranch, ShowExtra
from rcilab.app.setup.setup_actions import OpenTab
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store, UiState
from rcilab.app.view_actions import CommitField, DrawInSoftware, Play, Seek, SetView
from rcilab.views.access_control import AccessPolicy
from rcilab.views.viser_ext.client_messages import send_file
from rcilab.views.viser_ext.control_list import list_controls
from rcilab.views.viser_server import GuardedServer
from rcilab.views.viser_stage import ViserEnvironment
from rcilab.workbench import live, security
from rcilab.workbench.page import decorate, introduce, send_commands
from rcilab.workbench.renderer import Renderer, tab_name

if TYPE_CHECKING:
    import viser

    from rcilab.core.errors import RcilabError
    from rcilab.recording.run import Run

_LOWEST, _HIGHEST = 200.0, 4000.0  # [px] Range of window heights for the layout of plots.
_SWITCH_INTERVAL = 1e-3  # [s] The event loop sends a new pose while the dispatcher plans: Python's 5 ms would show.
_BEAT = 0.4  # [s] The control process stops a motion after 2 s without an operator.


@dataclass(frozen=True, kw_only=True)
class WorkbenchConfig:
    """Options of a workbench."""

    model: str = "xMatePro7"
    target: str = "virtual"
    """"virtual" for an own virtual controller, or the address of a controller, rci://HOST:PORT."""
    host: str = "127.0.0.1"
    """Address to listen on; anything but loopback needs a token."""
    port: int = security.DEFAULT_PORT
    """0 takes any free port."""
    token: str | None = None
    """Secret that every page must bring, at least 16 characters; `access.find_token` makes one."""
    language: str | None = None
    """None is the last one on this port, or English."""
    quality: str | None = None
    """"full" or "light"; None is full, or light in a browser without a graphics card."""
    runs: Path | None = None
    """Folder for recordings of every motion, cycle by cycle; None keeps only the last run, in memory."""
    replay: Run | None = None
    """A run to show; nothing is connected then until the operator does."""
    watch: str | None = None
    """Simulation port of a virtual controller, HOST:PORT, whose foreign client the page watches."""


class Workbench:
    """The page with everything behind it. `with Workbench(config) as bench: print(bench.url)`.

    Args:
        config: Its options.

    Raises:
        ModelError: No robot has this name, or it cannot be driven at an address.
        UsageError: The port is in use, the address needs a token, or the controller cannot be watched.
        ConnectionLostError: There is no controller to watch.
    """

    def __init__(self, config: WorkbenchConfig) -> None:
        model = security.require_openable(config.host, config.token, config.target, config.model)
        replay = config.replay
        if replay is not None:
            model = require_replayable(replay)
        watched = None if config.watch is None else WatchedController(config.watch)
        target = config.target if watched is None else watched.name
        model = model if watched is None else watched.model
        self._config = config
        self._bound = security.bind(config.host, config.port, config.token)
        self.port: int = self._bound.getsockname()[1]
        """Port of the page."""
        goal = goal_at(model, model.home)
        state = UiState(
            model=model,
            target=target,
            watched="" if watched is None else watched.name,
            goal=goal,
            language=config.language or "en",
            quality=config.quality or "full",
            is_quality_chosen=config.quality is not None,
        )
        if replay is not None:
            state = replayed(state, replay)
        self.store = Store(replace(state, runs=config.runs))
        self.session: PageConnection = RobotConnection(self._report_failure) if watched is None else watched
        # No autosave on a free port, which is not reused, nor for a page that only shows something.
        is_own = config.port and replay is None and watched is None
        autosave = Autosave(autosave_file(self.port) if is_own else None)
        self._presence = ClientHeartbeat()
        watch = None if watched is None else WatchActions(self.store, watched)
        self.dispatcher = Dispatcher(self.store, self.session, self._deliver, autosave, self._presence, watch)
        self.server: viser.ViserServer
        self._stopped = threading.Event()
        self._opened = False
        self._views: dict[int, ViserEnvironment] = {}  # By client id. Owned by the event loop.

    def _report_failure(self, error: RcilabError) -> None:
        self.store.notify("bad", explain_error(error, self.session.status()))

    @property
    def url(self) -> str:
        """Address for a browser."""
        host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(self._config.host, self._config.host)
        secret = f"?token={quote(self._config.token, safe='')}" if self._config.token else ""
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/{secret}"

    def start(self) -> None:
        """Serves the page, then connects to the robot in the background."""
        sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_INTERVAL))
        ask = self.dispatcher.ask
        # A page that watches cannot stop the motion, and shows that; otherwise Stop takes the direct path.
        stop = self.session.stop if self._config.watch is None else lambda: ask(RobotCommand(what="stop"))
        self.live = live.LiveChannel(stop, self._receive, lambda: self._guarded_server.guard.count_malformed())
        gate = AccessPolicy(host=self._config.host, port=self.port, token=self._config.token, title="this workbench")
        self._guarded_server = GuardedServer(
            self._bound,
            gate,
            decorate=self._decorate,
            routes={live.LIVE_PATH: self.live.serve, live.HEARTBEAT_PATH: self.live.serve_heartbeats},
            may_act=lambda page: self.store.state.control_lock.allows(page),
            refuse=lambda page: ask(Refuse(page=page)),
        )
        self.server = self._guarded_server.viser
        self._opened = True
        self._follow_pages()
        has_robot = self._config.replay is None and self._config.watch is None
        if has_robot:
            self.dispatcher.resume(language=self._config.language)
        self.renderer = Renderer(self.server, self.store, self.session, self.live, ask)
        self.renderer.start()
        self.dispatcher.start()
        if has_robot:
            self.dispatcher.run.open(self._config.model, self._config.target)
        threading.Thread(target=self._beat, name="operator", daemon=True).start()

    def close(self) -> None:
        """Stops a motion, ends the processes, closes the page. May be called twice."""
        if self._stopped.is_set():
            return
        self._stopped.set()
        if not self._opened:
            self._bound.close()
            return
        self.dispatcher.close()
        self.session.close()
        self.renderer.close()
        self._guarded_server.close()

    def _deliver(self, page: int | None, name: str, stream: IO[bytes], is_cancelled: Callable[[], bool]) -> bool:
        """Makes a page's browser save a file; cancelled when the page closes. Returns whether all was sent."""
        client = self.server.get_clients().get(-1 if page is None else page)
        return client is not None and send_file(client, name, stream, is_cancelled)

    def _follow_pages(self) -> None:
        ask = self.dispatcher.ask

        @self.server.on_client_connect
        async def _(client: viser.ClientHandle) -> None:
            ask(PageOpened(page=client.client_id))
            self._views[client.client_id] = ViserEnvironment(client.camera)
            introduce(client, self.live.introduce(client.client_id))

        @self.server.on_client_disconnect
        async def _(client: viser.ClientHandle) -> None:
            ask(PageClosed(page=client.client_id))
            self.live.forget(client.client_id)
            self.renderer.forget(client.client_id)
            self._views.pop(client.client_id, None)

    def _decorate(self, index: bytes) -> bytes:
        return decorate(index, self.store.state.quality)

    def _receive(self, page: int, message: live.PageMessage) -> None:
        """Handles a message of a page's live connection."""
        if isinstance(message, live.Here):
            self._here(page)
        elif isinstance(message, live.Home):
            self._bring_back(page, message.view)
        elif isinstance(message, live.Commands):
            self._list_commands(page)
        else:
            if isinstance(message, live.Tab):
                self.renderer.open_tab(page, message.index)
            self.dispatcher.ask(self._request_of(page, message))

    def _request_of(self, page: int, message: live.PageMessage) -> Request:
        match message:
            case live.Seek(share):
                return Seek(page=page, playhead=self.renderer.playhead_at(min(max(share, 0.0), 1.0)))
            case live.Play(playing):
                return Play(page=page, playing=playing, restart=True)
            case live.Size(height):
                return SetView(page=page, name="height", value=min(max(height, _LOWEST), _HIGHEST))
            case live.Tab(index):
                return OpenTab(page=page, name=tab_name(index))
            case live.Entered():
                return CommitField(page=page)
            case live.Take():
                return TakeControls(page=page)
            case live.Answer(yes):
                return AnswerControls(page=page, yes=yes)
            case live.Link(text):
                return OpenLink(page=page, text=text)
            case live.AnswerLink(yes):
                return AnswerLink(page=page, yes=yes)
            case live.Software():
                return DrawInSoftware(page=page)
            case live.Peek(branch):
                return HighlightBranch(page=page, index=branch)
            case live.Elbow(on):
                return EditElbow(page=page, on=on)
            case live.Branch(index):
                return ChooseBranch(page=page, index=index)
            case live.Condition(id):
                return PressCheck(page=page, what="row", row=id)
            case live.Extra(name, on):
                return ShowExtra(page=page, name=name, on=on)
            case live.Cut(axis, at):
                return CutWorkspace(page=page, axis=axis, at=at)
            case live.Entry(index):
                return SelectEntry(page=page, index=index)
            case live.Recorded(name):
                return OpenRun(page=page, name=name)
            case live.Rows(index):
                return ShowRows(page=page, index=index)
            case live.Draw(what):
                return DrawPath(page=page, what=what)
            case live.Turn(what):
                return TurnBack(page=page, what=what)
            case live.Edit(what, key, index):
                return EditProgram(page=page, what=what, key=key, index=index)
        raise AssertionError(message)

    def _bring_back(self, page: int, view: str) -> None:
        """Moves the camera of a page to a view; those of other pages stay."""
        if page in self._views:
            self._views[page].reset(view)

    def _list_commands(self, page: int) -> None:
        """Sends a page the list of its controls, for its command palette."""
        client = self.server.get_clients().get(page)
        if client is not None:
            send_commands(client, list_controls(self.server))

    def _here(self, page: int) -> None:
        """Registers a heartbeat of a page; only that of the operator counts for the robot."""
        self._presence.mark_seen(page)
        if self.store.state.control_lock.holder == page:
            self.session.heartbeat()

    def _beat(self) -> None:
        """Asks the pages continuously for heartbeats."""
        while not self._stopped.wait(_BEAT):
            self.live.beat()

    def __enter__(self) -> Workbench:
        try:
            self.start()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
