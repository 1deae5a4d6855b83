"""Stops an arm that a cell moves when the notebook's page is gone, and with it the operator.

Heartbeats are sent once the notebook has a part or sliders. Before, or where the kernel handles no message of the page
while a cell runs (ipykernel before 7; before 7.4 VS Code, too), no motion is stopped. The same holds
while a button of the user's own runs the motion in the thread that serves the page.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.i18n.translator import Remark
from rcilab.notebook.browser_heartbeat import kernel_heartbeat

if TYPE_CHECKING:
    from rcilab.execution.session import RobotSession

PAGE_GONE = Remark("the notebook's page is gone", "page_gone")
"""Reason in a run that was stopped because the page is gone."""
_INTERRUPTED = Remark("the kernel was interrupted", "kernel_interrupted")
_POLL_INTERVAL = 0.1  # [s] Between two checks for a motion.


class BrowserWatchdog:
    """Watches every session of the kernel. One thread; it sends no heartbeats while no arm moves.

    It imports nothing either: of two threads that import the same library, one can find it incomplete.

    Args:
        is_cell_running: Whether the kernel runs a cell.
    """

    def __init__(self, is_cell_running: Callable[[], bool]) -> None:
        kernel_heartbeat().is_cell_running = is_cell_running
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="rcilab-notebook-page", daemon=True)
        self._thread.start()

    def halt(self) -> None:
        """Stops every arm that a session moves, also from a thread of the user."""
        for session in _sessions():
            session.stop(_INTERRUPTED)

    def close(self) -> None:
        """Ends the watchdog."""
        self._ending.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ending.wait(_POLL_INTERVAL):
            self._check()  # No session is referenced while waiting, so that an unused one can be collected.

    def _check(self) -> None:
        sessions = _sessions()
        if not sessions:
            return
        heartbeat = kernel_heartbeat()
        heartbeat.open()  # Before any motion, so that only heartbeats are sent during one.
        moving = [session for session in sessions if session.is_moving]
        if moving:
            heartbeat.beat()
        if moving and heartbeat.is_gone:
            for session in moving:
                session.stop(PAGE_GONE)


def _sessions() -> list[RobotSession]:
    # While the module is not loaded, or another thread is loading it, no session can be open.
    find = getattr(sys.modules.get("rcilab.execution.session"), "open_sessions", None)
    return [] if find is None else find()
