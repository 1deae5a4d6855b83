"""The lock of a session: one request or one motion at a time uses the connection, and none once it closes."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from rcilab.core.errors import RcilabError, UsageError
from rcilab.i18n.translator import Remark

_CLOSED = Remark("the session was closed while a motion ran", "session_closed")
_CLOSE_TIMEOUT = 10.0  # [s] for another thread to stop its motion; the slowest joint needs 0.4 s.
_POLL_PERIOD = 0.02  # [s] Between two checks while waiting for another thread's request.


class SessionLock:
    """Threads acquire it in turn for requests; while one runs a motion, only `stop` and `close` are accepted.

    Attributes:
        is_closing: Whether it can no longer be acquired.

    Args:
        disconnect: Ends the connection, once it is not in use; may be called twice.
    """

    def __init__(self, disconnect: Callable[[], object]) -> None:
        self.is_closing = False
        self._disconnect = disconnect
        self._busy = threading.RLock()  # Held by the thread that uses the connection.
        self._motion_thread: int | None = None  # The thread that runs a motion.
        self._can_stop = False  # A motion is being checked or is running.
        self._reason: str | None = None  # Why the motion is being stopped.
        self._stop_planned: Callable[[], object] | None = None  # Stops the motion if the controller plans it.

    @property
    def is_moving(self) -> bool:
        """Whether a motion runs, in any thread."""
        return self._motion_thread is not None

    def reason_to_stop(self, t: float) -> str | None:
        """Returns the reason to stop the running motion, or None; its control loop calls this in every cycle."""
        if self.is_closing:
            return _CLOSED
        return self._reason

    @contextmanager
    def acquire(self, what: str) -> Iterator[None]:
        """Acquires the connection: waits for another thread's request, but not for a motion.

        Args:
            what: Purpose, for the error.

        Raises:
            UsageError: A motion runs, or the connection closes.
        """
        self._require_free(what)
        while not self._busy.acquire(timeout=_POLL_PERIOD):
            self._require_free(what)
        try:
            self._require_free(what)  # Also if this thread has the lock: a callback has it, too.
            yield
        finally:
            self._busy.release()

    @contextmanager
    def acquire_unless_moving(self) -> Iterator[bool]:
        """Acquires the connection like `acquire`, or yields False if a motion is running or begins meanwhile.

        Raises:
            UsageError: The connection closes.
        """
        is_acquired = False
        while not (self.is_moving or is_acquired):
            self._require_open()
            is_acquired = self._busy.acquire(timeout=_POLL_PERIOD)
        try:
            yield is_acquired and not self.is_moving
        finally:
            if is_acquired:
                self._busy.release()

    @contextmanager
    def begin_motion(self, what: str) -> Iterator[None]:
        """Acquires the connection for a motion; a stop counts from here on. Raises like `acquire`."""
        with self.acquire(what):
            self._reason, self._can_stop = None, True
            try:
                yield
            finally:
                self._can_stop = False

    @contextmanager
    def move(self, stop: Callable[[], object] | None = None) -> Iterator[None]:
        """Runs the motion of `begin_motion`: other requests, also those of its callback, are refused meanwhile.

        Args:
            stop: Stops a motion that the controller plans, whose end is awaited; None for one that is streamed.
        """
        self._motion_thread, self._stop_planned = threading.get_ident(), stop
        try:
            yield
        finally:
            self._motion_thread = self._stop_planned = None
            if self.is_closing:
                self._disconnect()

    def stop(self, reason: str) -> None:
        """Stops the motion that is being checked or is running; does nothing without one.

        Args:
            reason: Reason for its run; the first one counts.
        """
        if self._can_stop:
            self._reason = self._reason or reason
        if (stop := self._stop_planned) is not None:
            stop()

    def close(self) -> None:
        """Ends the connection once it is free; called from a callback, when the motion has ended."""
        self.is_closing = True
        if self._motion_thread == threading.get_ident():
            return
        if (stop := self._stop_planned) is not None:
            with suppress(RcilabError):
                stop()
        is_acquired = self._busy.acquire(timeout=_CLOSE_TIMEOUT)
        try:
            self._disconnect()
        finally:
            if is_acquired:
                self._busy.release()

    def _require_open(self) -> None:
        if self.is_closing:
            raise UsageError("this session is closed; connect again").coded("session_closed")

    def _require_free(self, what: str) -> None:
        self._require_open()
        if self.is_moving:
            raise UsageError(
                f"{what} is not possible while a motion is running; wait for its end, or stop() it first"
            ).coded("moving")
