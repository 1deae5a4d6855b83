"""One job at a time beside the thread of page or notebook: what takes longer than they may stand still."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Generic, TypeAlias, TypeVar

from rcilab.core.errors import RcilabError

Context = TypeVar("Context")
Result = TypeVar("Result")

ProgressCallback: TypeAlias = Callable[[float], None]
"""Takes how much is done, 0 to 1; does not return where nobody wants the result any more."""


class BackgroundJob(Generic[Context, Result]):
    """Starts, drops and takes jobs. Its owner looks several times a second what has come of one.

    Args:
        name: Of the threads.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._job: _Job[Context, Result] | None = None

    @property
    def progress(self) -> float | None:
        """How much is done, 0 to 1; None where nothing is being worked out."""
        return None if self._job is None else self._job.progress

    @property
    def is_done(self) -> bool:
        """Whether there is something to take."""
        return self._job is not None and self._job.outcome.done()

    def wait(self, timeout: float) -> None:
        """Returns once there is something to take, at the latest after a while, [s]; at once where there is no job."""
        job = self._job
        if job is not None:
            wait([job.outcome], timeout)

    def start(self, about: Context, run: Callable[[ProgressCallback], Result]) -> None:
        """Begins; what was being worked out is dropped.

        Args:
            about: What it is about; comes back with the result.
            run: Does it.
        """
        self.cancel()
        self._job = _Job(about, run)
        threading.Thread(target=self._job.run, name=self._name, daemon=True).start()

    def cancel(self) -> None:
        """Drops what is being worked out, at once; its thread ends when it next tells how much is done."""
        if self._job is not None:
            self._job.unwanted.set()
        self._job = None

    def take(self) -> tuple[Context, Result | RcilabError]:
        """Returns what the job was about and what came of it, once it is done; a failure of ours is raised."""
        job, self._job = self._job, None
        assert job is not None
        try:
            return job.about, job.outcome.result()
        except RcilabError as error:
            return job.about, error


class _CancelledError(Exception):
    """Nobody wants the result any more."""


class _Job(Generic[Context, Result]):
    """One job in its thread."""

    def __init__(self, about: Context, run: Callable[[ProgressCallback], Result]) -> None:
        self.about, self._run = about, run
        self.progress = 0.0
        self.unwanted = threading.Event()
        self.outcome: Future[Result] = Future()

    def run(self) -> None:
        try:
            self.outcome.set_result(self._run(self._tell))
        except Exception as error:  # Whoever takes it tells it, or raises it where bugs are counted.
            self.outcome.set_exception(error)

    def _tell(self, share: float) -> None:
        if self.unwanted.is_set():
            raise _CancelledError
        self.progress = share
