"""Who may open a page and who may talk to it, decided from the headers of a request alone."""

from __future__ import annotations

import hmac
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

COOKIE = "rcilab_token"
_LOOPBACK = ("127.0.0.1", "::1", "localhost")


@dataclass(frozen=True, kw_only=True)
class Gate:
    """Decides about a request from its headers alone.

    Args:
        host: Address we listen on.
        port: Port we listen on.
        token: Secret that every page must bring, or None on loopback.
        title: What the page is called in a refusal.
    """

    host: str
    port: int
    token: str | None = None
    title: str = "this page"

    @property
    def names(self) -> frozenset[str]:
        """What a browser may call us in Host and Origin; empty when any name may lead here (0.0.0.0)."""
        if self.host in ("0.0.0.0", "::"):
            return frozenset()
        hosts = {self.host, *(_LOOPBACK if self.host in _LOOPBACK else ())}
        return frozenset(f"{_bracketed(name)}:{self.port}" for name in hosts)

    def refuse_page(self, host: str | None, path: str, cookie: str | None) -> str | None:
        """Returns why a page may not be served, or None when it may.

        A foreign Host means that somebody's DNS points at this machine (rebinding), so it is refused too.
        """
        if self.names and host not in self.names:
            return f"{self.title} answers to {' and '.join(sorted(self.names))} only"
        if self.token is not None and not (self._fits(_token_in(path)) or self._fits(_token_from(cookie))):
            return f"{self.title} needs its token: open the address that `rcilab --token` printed"
        return None

    def refuse_socket(self, host: str | None, origin: str | None, cookie: str | None) -> str | None:
        """Returns why a websocket may not be opened, or None when it may; a missing Origin is refused."""
        if origin is None:
            return "a websocket needs an Origin"
        scheme, _, name = origin.partition("://")
        if scheme not in ("http", "https") or name != host or (self.names and name not in self.names):
            return f"origin {origin!r} is not {self.title}"
        if self.token is not None and not self._fits(_token_from(cookie)):
            return "the token is missing or wrong"
        return None

    def _fits(self, given: str | None) -> bool:
        return given is not None and hmac.compare_digest(given.encode(), (self.token or "").encode())


def is_loopback(host: str) -> bool:
    """Returns whether only this machine can reach an address, as far as its spelling tells."""
    return host in _LOOPBACK or host.startswith("127.")


def _token_in(path: str) -> str | None:
    return (parse_qs(urlsplit(path).query).get("token") or [None])[0]


def _token_from(cookie: str | None) -> str | None:
    try:
        morsel = SimpleCookie(cookie or "").get(COOKIE)
    except CookieError:
        return None
    return morsel.value if morsel is not None else None


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
