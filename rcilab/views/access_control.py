"""Access control of a page and its websockets, from the headers of a request alone."""

from __future__ import annotations

import hmac
import ipaddress
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from urllib.parse import parse_qs, quote, unquote, urlsplit

_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_FIRST_DELAY = 0.1  # [s] Tuning value: not noticeable after a mistyped token.
_LONGEST_DELAY = 5.0  # [s] Tuning value: browsers and users still wait this long.
_RESET_TIME = 60.0  # [s] Tuning value: without a wrong token for this long, the delay starts again at the first one.


@dataclass(frozen=True)
class Refusal:
    """Why a request is refused."""

    reason: str
    has_wrong_token: bool = False
    """Whether the request had a wrong token."""


@dataclass(frozen=True, kw_only=True)
class AccessPolicy:
    """Accepts or refuses requests by their headers.

    Args:
        host: Address of the server.
        port: Port of the server.
        token: Secret that every page must send, or None on loopback.
        title: Name of the page in a refusal.
    """

    host: str
    port: int
    token: str | None = None
    title: str = "this page"

    @property
    def names(self) -> frozenset[str]:
        """Allowed values of Host and Origin; empty if any name is allowed (0.0.0.0)."""
        if self.host in ("0.0.0.0", "::"):
            return frozenset()
        hosts = {self.host, *(_LOOPBACK if self.host in _LOOPBACK else ())}
        return frozenset(f"{_bracketed(name)}:{self.port}" for name in hosts)

    @property
    def cookie(self) -> str | None:
        """Cookie for a page that sent the token; its name has the port, because browsers share cookies among ports."""
        return None if self.token is None else f"{self._cookie_name}={quote(self.token, safe='')}"

    def refuse_page(self, host: str | None, path: str, cookie: str | None) -> Refusal | None:
        """Returns why a page must not be served, or None if it may.

        A foreign Host is refused too: it means that the DNS of another domain points to this machine (rebinding).
        """
        if self.names and host not in self.names:
            return Refusal(f"{self.title} is available as {' and '.join(sorted(self.names))} only")
        given = [*parse_qs(urlsplit(path).query).get("token", ()), *self._tokens_in(cookie)]
        if self._lacks_token(given):
            return Refusal(f"{self.title} needs its token: open the address that rcilab printed", bool(given))
        return None

    def refuse_socket(self, host: str | None, origin: str | None, cookie: str | None) -> Refusal | None:
        """Returns why a websocket must not be opened, or None if it may; a missing Origin is refused."""
        if origin is None:
            return Refusal("a websocket needs an Origin")
        scheme, _, name = origin.partition("://")
        if scheme not in ("http", "https") or name != host or (self.names and name not in self.names):
            return Refusal(f"origin {origin!r} is not {self.title}")
        given = list(self._tokens_in(cookie))
        if self._lacks_token(given):
            return Refusal("the token is missing or wrong", bool(given))
        return None

    @property
    def _cookie_name(self) -> str:
        return f"rcilab_token_{self.port}"

    def _lacks_token(self, given: list[str]) -> bool:
        if self.token is None:
            return False
        expected = self.token.encode()
        return not any([hmac.compare_digest(one.encode(errors="replace"), expected) for one in given])

    def _tokens_in(self, cookie: str | None) -> Iterator[str]:
        for part in (cookie or "").split(";"):
            name, _, value = part.strip().partition("=")
            if name == self._cookie_name:
                yield unquote(value)


class WrongTokenDelay:
    """Delay of the reply to a wrong token: longer each time, reset after a time without wrong tokens.

    Args:
        clock: Returns the time, [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._last, self._delay = float("-inf"), 0.0

    def delay(self) -> float:
        """Returns the delay of the reply to a wrong token received now, [s]."""
        now = self._clock()
        is_first = now - self._last > _RESET_TIME
        self._last = now
        self._delay = _FIRST_DELAY if is_first else min(2.0 * self._delay, _LONGEST_DELAY)
        return self._delay


def is_loopback(host: str) -> bool:
    """Returns whether a host resolves to loopback addresses only.

    Raises:
        OSError: It is neither an address nor a known name.
    """
    found = {info[4][0] for info in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)}
    return all(ipaddress.ip_address(str(address).partition("%")[0]).is_loopback for address in found)


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
