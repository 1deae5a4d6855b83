"""Which page has the controls: one at a time; every other page is a spectator and may ask for them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from rcilab.control_process.layout import OPERATOR_TIMEOUT

PATIENCE = 10.0  # [s] Time for the holder to answer a request for the controls, while the arm stands still.
_LOADING = 20.0  # [s] Time for a page that has just opened to send its first heartbeat.


@dataclass(frozen=True)
class ControlLock:
    """The open pages, in the order in which they opened, and the holder of the controls."""

    pages: tuple[int, ...] = ()
    """Client ids."""
    holder: int | None = None
    """None while the controls are free."""
    asking: int | None = None
    """The page that has asked the holder for the controls."""
    since: float = -math.inf
    """Time of that request, or since when the controls are free, as `time.monotonic` counts."""
    former: int | None = None
    """The holder before it fell silent; it regains the controls if it answers before another page takes them."""

    def arrive(self, page: int) -> ControlLock:
        """Returns the lock after a page has opened; it gets the controls if they are free."""
        if page in self.pages:
            return self
        pages = (*self.pages, page)
        return replace(self, pages=pages) if self.holder is not None else ControlLock(pages, page)

    def leave(self, page: int, now: float = -math.inf) -> ControlLock:
        """Returns the lock after a page has closed: its controls pass to the page that asked, or become free."""
        pages = tuple(other for other in self.pages if other != page)
        former = None if self.former == page else self.former
        if self.holder != page:
            asking = None if self.asking == page else self.asking
            return replace(self, pages=pages, asking=asking, former=former)
        return ControlLock(pages, self.asking, since=now, former=former)

    def take(self, page: int) -> ControlLock:
        """Returns the lock after an open page has got the controls."""
        return ControlLock(self.pages, page) if page in self.pages else self

    def ask(self, page: int, now: float) -> ControlLock:
        """Returns the lock after a page has asked: free controls are its own at once, otherwise the holder decides."""
        if page not in self.pages or page == self.holder or self.asking is not None:
            return self
        return self.take(page) if self.holder is None else replace(self, asking=page, since=now)

    def answer(self, page: int, yes: bool) -> ControlLock:
        """Returns the lock after a page has answered; only the holder's answer counts."""
        if page != self.holder or self.asking is None:
            return self
        return self.take(self.asking) if yes else replace(self, asking=None)

    def fall_silent(self, now: float) -> ControlLock:
        """Returns the lock after the holder's page has stopped answering, though its connection is open."""
        return ControlLock(self.pages, self.asking, since=now, former=self.holder if self.asking is None else None)

    def is_overdue(self, now: float) -> bool:
        """Returns whether the holder's time to answer is over."""
        return self.asking is not None and now - self.since > PATIENCE

    def allows(self, page: int | None) -> bool:
        """Returns whether a page may act; the application itself (None) always may."""
        return page is None or page == self.holder

    def number(self, page: int | None) -> int:
        """Returns the place of a page among the open ones, from 1; 0 if it is not open."""
        return self.pages.index(page) + 1 if page in self.pages else 0


class ClientHeartbeat:
    """When each page last sent a heartbeat. Written by the server's event loop, read by any thread."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._last_seen: dict[int, float] = {}

    def now(self) -> float:
        """Returns the time, [s]."""
        return self._clock()

    def came(self, page: int) -> None:
        """Registers a page that is still loading."""
        self._last_seen.setdefault(page, self._clock() + _LOADING - OPERATOR_TIMEOUT)

    def mark_seen(self, page: int) -> None:
        """Registers a heartbeat of a page."""
        self._last_seen[page] = self._clock()

    def went(self, page: int) -> None:
        """Removes a page."""
        self._last_seen.pop(page, None)

    def is_silent(self, page: int) -> bool:
        """Returns whether an open page has sent no heartbeat for `OPERATOR_TIMEOUT`."""
        return self._clock() - self._last_seen.get(page, math.inf) > OPERATOR_TIMEOUT
