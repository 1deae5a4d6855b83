"""The lock of a session: one request or one motion at a time uses the connection, and none once it closes."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rcilab.core.errors import UsageError
from rcilab.i18n.translator import Remark

_CLOSED = Remark("the session was closed while a motion ran", "session_closed")
_CLOSE_TIMEOUT = 10.0  # [s] for another thread to stop its motion; the slowest joint needs 0.4 s.
_LOOK = 0.02  # [s] Longest wait for another thread's request before what that thread does is checked again.


class SessionLock:
    """Threads take it in turn for requests; while one runs a motion, only `stop` and `close` are accepted.

    Attributes:
        is_closing: Whether it cannot be taken any more.

    Args:
        disconnect: Ends the connection, once it is not in use; may be called twice.
    """

    def __init__(self, disconnect: Callable[[], object]) -> None:
        self.is_closing = False
        self._disconnect = disconnect
        self._busy = threading.RLock()  # Held by the thread that uses the connection.
        self._mover: int | None = None  # The thread that runs a motion.
        self._can_stop = False  # A motion is being checked, or runs.
        self._reason: str | None = None  # Why the motion is to stop.

    @property
    def is_moving(self) -> bool:
        """Whether a motion runs, in any thread."""
        return self._mover is not None

    def reason_to_stop(self, t: float) -> str | None:
        """Returns why the running motion is to stop, or None; its control loop calls it in every cycle."""
        if self.is_closing:
            return _CLOSED
        return self._reason

    @contextmanager
    def take(self, what: str) -> Iterator[None]:
        """Takes the connection: waits for another thread's request, not for a motion.

        Args:
            what: Purpose, for the error.

        Raises:
            UsageError: A motion runs, or the connection closes.
        """
        self._require_free(what)
        while not self._busy.acquire(timeout=_LOOK):
            self._require_free(what)
        try:
            self._require_free(what)  # Also where the lock is ours: a callback has it too.
            yield
        finally:
            self._busy.release()

    @contextmanager
    def take_unless_moving(self) -> Iterator[bool]:
        """Takes the connection as `take` does, or gives False: a motion runs, or began while it was waited for.

        Raises:
            UsageError: The connection closes.
        """
        is_mine = False
        while not (self.is_moving or is_mine):
            self._require_open()
            is_mine = self._busy.acquire(timeout=_LOOK)
        try:
            yield is_mine and not self.is_moving
        finally:
            if is_mine:
                self._busy.release()

    @contextmanager
    def begin_motion(self, what: str) -> Iterator[None]:
        """Takes the connection for a motion; a stop while it is still being checked counts. Raises as `take` does."""
        with self.take(what):
            self._reason, self._can_stop = None, True
            try:
                yield
            finally:
                self._can_stop = False

    @contextmanager
    def move(self) -> Iterator[None]:
        """Runs the motion of `begin_motion`: other uses are refused from here on, also by its callback."""
        self._mover = threading.get_ident()
        try:
            yield
        finally:
            self._mover = None
            if self.is_closing:
                self._disconnect()

    def stop(self, reason: str) -> None:
        """Stops the motion that runs or is about to; does nothing without one.

        Args:
            reason: Reason for its run; the first one counts.
        """
        if self._can_stop:
            self._reason = self._reason or reason

    def close(self) -> None:
        """Ends the connection once it is free; called from a callback, when the motion has ended."""
        self.is_closing = True
        if self._mover == threading.get_ident():
            return
        is_mine = self._busy.acquire(timeout=_CLOSE_TIMEOUT)
        try:
            self._disconnect()
        finally:
            if is_mine:
                self._busy.release()

    def _require_open(self) -> None:
        if self.is_closing:
            raise UsageError("this session is closed; connect again").coded("session_closed")

    def _require_free(self, what: str) -> None:
        self._require_open()
        if self.is_moving:
            said = f"a motion is running already: no {what} meanwhile; let it end, or stop() it first"
            raise UsageError(said).coded("moving")
