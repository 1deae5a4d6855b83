"""Who holds the controls: one page at a time, every other one watches."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Lease:
    """The open pages, in the order they came, and the one whose actions count."""

    pages: tuple[int, ...] = ()
    """Client ids."""
    holder: int | None = None
    """None when no page is open."""

    def arrive(self, page: int) -> Lease:
        """Returns the lease after a page has opened: the first one gets the controls."""
        if page in self.pages:
            return self
        return Lease((*self.pages, page), page if self.holder is None else self.holder)

    def leave(self, page: int) -> Lease:
        """Returns the lease after a page has gone: the controls pass to the one that came first."""
        pages = tuple(other for other in self.pages if other != page)
        if self.holder != page:
            return replace(self, pages=pages)
        return Lease(pages, pages[0] if pages else None)

    def take(self, page: int) -> Lease:
        """Returns the lease after an open page has taken the controls."""
        return replace(self, holder=page) if page in self.pages else self

    def allows(self, page: int | None) -> bool:
        """Returns whether this page may act; our own doing (None) always may."""
        return page is None or page == self.holder

    def number(self, page: int | None) -> int:
        """Returns the place of a page among the open ones, from 1; 0 when it is not open."""
        return self.pages.index(page) + 1 if page in self.pages else 0
