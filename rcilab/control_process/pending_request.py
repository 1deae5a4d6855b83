"""A request that the control process carries out, as its sender sees it."""

from __future__ import annotations

import threading

from rcilab.core.errors import DeadlineError, RcilabError


class PendingRequest:
    """A request that the control process carries out. Thread-safe.

    Args:
        what: Name of the request, for error messages.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._event = threading.Event()
        self._error: RcilabError | None = None

    @property
    def done(self) -> bool:
        """Whether the request has been carried out or has failed. For `execute`: the arm stands still again."""
        return self._event.is_set()

    @property
    def error(self) -> RcilabError | None:
        """Why it failed; None while it is in progress and when it succeeded.

        An `execute` that was stopped before its end has a `ControlError` without faults.
        """
        return self._error

    def wait(self, timeout: float | None = None) -> None:
        """Returns once the request has been carried out.

        Args:
            timeout: How long to wait, [s]; None waits as long as it takes.

        Raises:
            DeadlineError: It is still in progress after `timeout`; it goes on.
            RcilabError: It failed; the same object as `.error`.
        """
        if not self._event.wait(timeout):
            raise DeadlineError(f"{self._what} is still in progress after {timeout:g} s; it goes on, wait again")
        if self._error is not None:
            raise self._error

    def settle(self, error: RcilabError | None = None) -> None:
        """Marks it done; the supervisor calls this. Only the first call counts."""
        if not self._event.is_set():
            self._error = error
            self._event.set()

    def __repr__(self) -> str:
        state = "in progress" if not self.done else f"failed: {self._error}" if self._error else "done"
        return f"<PendingRequest {self._what}, {state}>"
