"""The operator of an arm moved from a cell is at the notebook's page: when it is gone, the arm is stopped.

The page is asked from the first part, or the first sliders, that a notebook makes. Before, or where the kernel hears
no page while a cell runs (ipykernel before 7; before 7.4 VS Code, too), nothing is known and nothing is stopped.
Nor is it while a button of the user's own runs the motion in the thread that serves the page.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from rcilab.i18n.translator import Remark
from rcilab.notebook.browser_heartbeat import kernel_heart

if TYPE_CHECKING:
    from rcilab.execution.session import RobotSession

LEFT_ALONE = Remark("the notebook's page is gone", "page_gone")
"""What a run says that was stopped for it."""
_INTERRUPTED = Remark("the kernel was interrupted", "kernel_interrupted")
_LOOK = 0.1  # [s] Between two looks for a motion.


class BrowserWatchdog:
    """Looks after every session of the kernel. One thread; it sends nothing while nothing moves.

    It imports nothing either: two threads that load the same libraries can find them half loaded.

    Args:
        is_cell_running: Whether the kernel runs a cell.
    """

    def __init__(self, is_cell_running: Callable[[], bool]) -> None:
        kernel_heart().is_cell_running = is_cell_running
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="rcilab-notebook-page", daemon=True)
        self._thread.start()

    def halt(self) -> None:
        """Stops every arm that a session moves, also from a thread of the user's own."""
        for session in _sessions():
            session.stop(_INTERRUPTED)

    def close(self) -> None:
        """Ends the watch."""
        self._ending.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ending.wait(_LOOK):
            self._look()  # Holds no session while it waits: an unreferenced one is to be collected.

    def _look(self) -> None:
        sessions = _sessions()
        if not sessions:
            return
        heart = kernel_heart()
        heart.open()  # Before anything moves, so that nothing but questions comes meanwhile.
        moving = [session for session in sessions if session.is_moving]
        if moving:
            heart.beat()
        if moving and heart.is_gone:
            for session in moving:
                session.stop(LEFT_ALONE)


def _sessions() -> list[RobotSession]:
    # Where the module is not loaded yet, or another thread is loading it, no session can be open.
    find = getattr(sys.modules.get("rcilab.execution.session"), "open_sessions", None)
    return [] if find is None else find()
