"""The sessions of this process, for who looks after all of them, whoever made them."""

from __future__ import annotations

import threading
import weakref
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rcilab.execution.session import RobotSession

_lock = threading.Lock()
_made: weakref.WeakSet[RobotSession] = weakref.WeakSet()


def enlist(session: RobotSession) -> None:
    """Takes note of a session that has just been opened."""
    with _lock:
        _made.add(session)


def open_sessions() -> list[RobotSession]:
    """Returns the sessions that nobody has closed; for any thread."""
    with _lock:
        made = list(_made)
    return [session for session in made if not session.is_closed]
