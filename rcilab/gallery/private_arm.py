"""The arm that faults are provoked on: one of the gallery's own, kept for the next provocation."""

from __future__ import annotations

import threading

from rcilab.background import Tell
from rcilab.faults import Fault
from rcilab.gallery.booth import Booth
from rcilab.gallery.exhibit import Exhibit


class PrivateArm:
    """A controller that stays. Threads that provoke take turns at it."""

    def __init__(self) -> None:
        self._booth: Booth | None = None
        self._lock = threading.Lock()  # Held by the thread that uses the booth.

    def provoke(self, fault: Fault, model: str, tell: Tell) -> Exhibit:
        """Returns what came of provoking a fault; who gives up meanwhile leaves the arm at rest."""
        with self._lock:
            tell(0.0)
            if self._booth is None or self._booth.model.name != model:
                self._drop()
                self._booth = Booth(model)
            return self._booth.provoke(fault, tell)

    def close(self) -> None:
        """Ends the controller, once nobody uses it."""
        with self._lock:
            self._drop()

    def _drop(self) -> None:
        if self._booth is not None:
            self._booth.close()
            self._booth = None
