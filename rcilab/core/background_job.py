"""One background job at a time, for work that would block the thread of the page or the notebook."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Generic, TypeAlias, TypeVar

from rcilab.core.errors import RcilabError

Context = TypeVar("Context")
Result = TypeVar("Result")

ProgressCallback: TypeAlias = Callable[[float], None]
"""Receives the progress, 0 to 1; raises an exception that ends the job once the job is cancelled."""


class BackgroundJob(Generic[Context, Result]):
    """Starts and cancels jobs and returns their results. Its owner polls it several times a second.

    Args:
        name: Name of its threads.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._job: _Job[Context, Result] | None = None

    @property
    def progress(self) -> float | None:
        """Progress of the job, 0 to 1; None without a job."""
        return None if self._job is None else self._job.progress

    @property
    def is_done(self) -> bool:
        """Whether a result is ready."""
        return self._job is not None and self._job.outcome.done()

    def wait(self, timeout: float) -> None:
        """Waits until a result is ready, at most `timeout`, [s]; returns at once without a job."""
        job = self._job
        if job is not None:
            wait([job.outcome], timeout)

    def start(self, context: Context, run: Callable[[ProgressCallback], Result]) -> None:
        """Starts a job; a running one is cancelled.

        Args:
            context: Value that is returned with the result of the job.
            run: The job.
        """
        self.cancel()
        self._job = _Job(context, run)
        threading.Thread(target=self._job.run, name=self._name, daemon=True).start()

    def cancel(self) -> None:
        """Cancels the job at once; its thread ends at its next progress report."""
        if self._job is not None:
            self._job.cancelled.set()
        self._job = None

    def pop_result(self) -> tuple[Context, Result | RcilabError]:
        """Removes the finished job and returns its context and result; an `RcilabError` is returned as the result."""
        job, self._job = self._job, None
        assert job is not None
        try:
            return job.context, job.outcome.result()
        except RcilabError as error:
            return job.context, error


class _CancelledError(Exception):
    """The job was cancelled."""


class _Job(Generic[Context, Result]):
    """One job in its thread."""

    def __init__(self, context: Context, run: Callable[[ProgressCallback], Result]) -> None:
        self.context, self._run = context, run
        self.progress = 0.0
        self.cancelled = threading.Event()
        self.outcome: Future[Result] = Future()

    def run(self) -> None:
        try:
            self.outcome.set_result(self._run(self._report_progress))
        except Exception as error:  # `pop_result` returns or raises it.
            self.outcome.set_exception(error)

    def _report_progress(self, share: float) -> None:
        if self.cancelled.is_set():
            raise _CancelledError
        self.progress = share
