"""Faults are provoked beside the conductor's thread, on a controller that stays for the next one."""

from __future__ import annotations

import threading

from rcilab.errors import RcilabError
from rcilab.faults import Fault
from rcilab.gallery import Booth, Exhibit


class _Cancelled(Exception):
    """Nobody wants to see it any more."""


class GalleryWork:
    """One provocation at a time. Owned by the conductor's thread, which asks for the result at every tick."""

    def __init__(self) -> None:
        self._booth: Booth | None = None
        self._lock = threading.Lock()  # Held by the thread that uses the booth.
        self._job: _Job | None = None

    @property
    def progress(self) -> float | None:
        """How much is done, 0 to 1; None where nothing is being provoked."""
        return None if self._job is None else self._job.progress

    @property
    def is_done(self) -> bool:
        """Whether there is something to take."""
        return self._job is not None and self._job.done.is_set()

    def start(self, fault: Fault, model: str) -> None:
        """Begins; what was being provoked is dropped."""
        self.cancel()
        job = self._job = _Job(fault, model)
        threading.Thread(target=self._run, args=(job,), name="gallery", daemon=True).start()

    def cancel(self) -> None:
        """Drops what is being provoked, at once; the private arm is brought to rest beside."""
        if self._job is not None:
            self._job.unwanted.set()
        self._job = None

    def take(self) -> Exhibit | RcilabError:
        """Returns what came of it, once it is done."""
        job, self._job = self._job, None
        assert job is not None
        if isinstance(job.result, Exhibit | RcilabError):
            return job.result
        assert job.result is not None
        raise job.result

    def close(self) -> None:
        """Ends the private controller."""
        self.cancel()
        with self._lock:
            if self._booth is not None:
                self._booth.close()
                self._booth = None

    def _run(self, job: _Job) -> None:
        with self._lock:
            try:
                job.tell(0.0)
                if self._booth is None or self._booth.model.name != job.model:
                    if self._booth is not None:
                        self._booth.close()
                    self._booth = Booth(job.model)
                job.result = self._booth.provoke(job.fault, job.tell)
            except Exception as error:  # The conductor tells it, or raises it where its bugs are counted.
                job.result = error
        job.done.set()


class _Job:
    """One provocation."""

    def __init__(self, fault: Fault, model: str) -> None:
        self.fault, self.model = fault, model
        self.progress = 0.0
        self.unwanted, self.done = threading.Event(), threading.Event()
        self.result: Exhibit | Exception | None = None

    def tell(self, share: float) -> None:
        if self.unwanted.is_set():
            raise _Cancelled
        self.progress = share
