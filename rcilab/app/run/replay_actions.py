"""Opens a recorded run of the folder on the page, and closes it. Owned by the dispatcher's thread."""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.app.connection import PageConnection
from rcilab.app.request import Handlers, Request
from rcilab.app.run.plan_readiness import is_moving
from rcilab.app.run.replay import Replay, open_replay
from rcilab.app.status_text import explain_error
from rcilab.app.store import Store
from rcilab.core.background_job import BackgroundJob
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import RcilabError
from rcilab.i18n.translator import message

_REFUSED = "replay"
"""Cause of the notice that a recorded run is shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenRun(Request):
    """Show a recorded run."""

    name: str
    """Name of its file, one of the list."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CloseRun(Request):
    """Go back to the robot."""


class ReplayActions:
    """The robot stays connected behind a recorded run; its next motion closes the run.

    Args:
        store: Has the list of runs.
        connection: The robot.
    """

    def __init__(self, store: Store, connection: PageConnection) -> None:
        self._store, self._connection = store, connection
        self._work: BackgroundJob[str, Replay] = BackgroundJob("replay")

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            OpenRun: self.open,
            CloseRun: self.close_run,
        }

    def open(self, request: OpenRun) -> None:
        """Starts to read a run; refused while the arm moves."""
        state = self._store.state
        if state.runs is None or all(run.name != request.name for run in state.folder.runs):
            return
        if is_moving(self._connection.status()):
            self._store.notify("warn", message("notice.moving"))
            return
        file = state.runs / request.name
        self._work.start(request.name, lambda progress: open_replay(file, state))

    def close_run(self, request: CloseRun) -> None:
        """Shows the robot again."""
        self._work.cancel()
        if self._store.state.replay is not None:
            self._show(None)

    def refuse(self) -> None:
        """Informs the operator that a request is about the robot, which is not shown."""
        self._store.clear_notices(_REFUSED)
        self._store.notify("warn", message("ready.replay"), cause=_REFUSED)

    def tick(self) -> None:
        """Shows a run that has been read; closes it once the arm moves."""
        if self._work.is_done:
            name, found = self._work.pop_result()
            if isinstance(found, RcilabError):
                self._store.notify("bad", message("replay.failed", file=name, error=explain_error(found)))
            elif not is_moving(self._connection.status()):
                self._show(found)
        if self._store.state.replay is not None and is_moving(self._connection.status()):
            self._show(None)
            self._store.notify("warn", message("replay.moving"))

    def _show(self, found: Replay | None) -> None:
        self._store.clear_notices(_REFUSED)
        self._store.update(replay=found, playhead=_start_of(found), playing=False)

    def close(self) -> None:
        """Ends reading."""
        self._work.cancel()


def _start_of(found: Replay | None) -> float:
    """Returns the place at which a run opens, 0 to 1: at its fault, or at its beginning."""
    if found is None or found.recording.moment is None or found.shown.plan is None:
        return 0.0
    recording = found.recording
    moment = found.recording.moment - recording.delay * CYCLE_TIME
    return min(max(moment / max(found.shown.plan.motion.duration, CYCLE_TIME), 0.0), 1.0)
