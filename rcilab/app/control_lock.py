"""Who holds the controls: one page at a time, every other one watches and may ask for them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from rcilab.control_process.layout import OPERATOR_TIMEOUT

PATIENCE = 10.0  # [s] For so long the holder may think about handing over, while the arm stands.
_LOADING = 20.0  # [s] A page that has just opened may take so long until its first word.


@dataclass(frozen=True)
class ControlLock:
    """The open pages, in the order they came, and the one whose actions count."""

    pages: tuple[int, ...] = ()
    """Client ids."""
    holder: int | None = None
    """None while the controls are free."""
    asking: int | None = None
    """The page that has asked the holder for the controls."""
    since: float = -math.inf
    """When it asked, or when the controls became free, as `time.monotonic` counts."""
    former: int | None = None
    """Held the controls until it fell silent; gets them back if it speaks before another page takes them."""

    def arrive(self, page: int) -> ControlLock:
        """Returns the lease after a page has opened; it gets the controls when they are free."""
        if page in self.pages:
            return self
        pages = (*self.pages, page)
        return replace(self, pages=pages) if self.holder is not None else ControlLock(pages, page)

    def leave(self, page: int, now: float = -math.inf) -> ControlLock:
        """Returns the lease after a page has gone: its controls pass to the one that has asked, or become free."""
        pages = tuple(other for other in self.pages if other != page)
        former = None if self.former == page else self.former
        if self.holder != page:
            asking = None if self.asking == page else self.asking
            return replace(self, pages=pages, asking=asking, former=former)
        return ControlLock(pages, self.asking, since=now, former=former)

    def take(self, page: int) -> ControlLock:
        """Returns the lease after an open page has got the controls."""
        return ControlLock(self.pages, page) if page in self.pages else self

    def ask(self, page: int, now: float) -> ControlLock:
        """Returns the lease after a page has asked: free controls are its own at once, else the holder decides."""
        if page not in self.pages or page == self.holder or self.asking is not None:
            return self
        return self.take(page) if self.holder is None else replace(self, asking=page, since=now)

    def answer(self, page: int, yes: bool) -> ControlLock:
        """Returns the lease after a page has answered; only the holder's answer counts."""
        if page != self.holder or self.asking is None:
            return self
        return self.take(self.asking) if yes else replace(self, asking=None)

    def fall_silent(self, now: float) -> ControlLock:
        """Returns the lease after the holder's page has stopped answering, though it seems to be open."""
        return ControlLock(self.pages, self.asking, since=now, former=self.holder if self.asking is None else None)

    def is_overdue(self, now: float) -> bool:
        """Returns whether the holder has had its time to answer."""
        return self.asking is not None and now - self.since > PATIENCE

    def allows(self, page: int | None) -> bool:
        """Returns whether this page may act; our own doing (None) always may."""
        return page is None or page == self.holder

    def number(self, page: int | None) -> int:
        """Returns the place of a page among the open ones, from 1; 0 when it is not open."""
        return self.pages.index(page) + 1 if page in self.pages else 0


class ClientHeartbeat:
    """When each page was last heard of. Written by the server's event loop, read by anybody."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._heard: dict[int, float] = {}

    def now(self) -> float:
        """Returns the time, [s]."""
        return self._clock()

    def came(self, page: int) -> None:
        """Notes a page that is still loading."""
        self._heard.setdefault(page, self._clock() + _LOADING - OPERATOR_TIMEOUT)

    def heard(self, page: int) -> None:
        """Notes that a page has answered."""
        self._heard[page] = self._clock()

    def went(self, page: int) -> None:
        """Forgets a page."""
        self._heard.pop(page, None)

    def is_silent(self, page: int) -> bool:
        """Returns whether a page that ought to answer has not done so for `OPERATOR_TIMEOUT`."""
        return self._clock() - self._heard.get(page, math.inf) > OPERATOR_TIMEOUT
