"""The future of a request to the control process."""

from __future__ import annotations

import threading

from rcilab.core.errors import DeadlineError, RcilabError


class PendingRequest:
    """The future of a request to the control process. Thread-safe.

    Args:
        what: Name of the request, for error messages.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._event = threading.Event()
        self._error: RcilabError | None = None

    @property
    def done(self) -> bool:
        """Whether the request has succeeded or failed. For `execute`: the arm is stationary again."""
        return self._event.is_set()

    @property
    def error(self) -> RcilabError | None:
        """Why it failed; None while it is in progress and if it succeeded.

        A stopped `execute` has a `ControlError` without faults.
        """
        return self._error

    def wait(self, timeout: float | None = None) -> None:
        """Returns once the request has succeeded.

        Args:
            timeout: Timeout, [s]; None: no timeout.

        Raises:
            DeadlineError: It is still in progress after `timeout`; it continues.
            RcilabError: It failed; the same object as `.error`.
        """
        if not self._event.wait(timeout):
            raise DeadlineError(f"{self._what} is still in progress after {timeout:g} s; it continues, wait again")
        if self._error is not None:
            raise self._error

    def settle(self, error: RcilabError | None = None) -> None:
        """Marks it done; called by the supervisor. Only the first call has an effect."""
        if not self._event.is_set():
            self._error = error
            self._event.set()

    def __repr__(self) -> str:
        state = "in progress" if not self.done else f"failed: {self._error}" if self._error else "done"
        return f"<PendingRequest {self._what}, {state}>"
