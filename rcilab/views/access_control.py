"""Who may open a page and who may talk to it, decided from the headers of a request alone."""

from __future__ import annotations

import hmac
import ipaddress
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from urllib.parse import parse_qs, quote, unquote, urlsplit

_LOOPBACK = ("127.0.0.1", "::1", "localhost")
_FIRST_DELAY = 0.1  # [s] A tuning value: not noticed after a mistyped token.
_LONGEST_DELAY = 5.0  # [s] A tuning value: as long as a browser and its user wait without giving up.
_FORGOTTEN = 60.0  # [s] A tuning value: after so long without a wrong token the next one is the first again.


@dataclass(frozen=True)
class Refusal:
    """Why a request is not answered."""

    reason: str
    is_guess: bool = False
    """Whether it came with a wrong token."""


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

    @property
    def cookie(self) -> str | None:
        """What a page that brought the token is to keep: one cookie a port, as browsers share them among ports."""
        return None if self.token is None else f"{self._cookie_name}={quote(self.token, safe='')}"

    def refuse_page(self, host: str | None, path: str, cookie: str | None) -> Refusal | None:
        """Returns why a page may not be served, or None when it may.

        A foreign Host means that another domain's DNS points at this machine (rebinding), so it is refused too.
        """
        if self.names and host not in self.names:
            return Refusal(f"{self.title} answers to {' and '.join(sorted(self.names))} only")
        given = [*parse_qs(urlsplit(path).query).get("token", ()), *self._tokens_in(cookie)]
        if self._is_short_of_token(given):
            return Refusal(f"{self.title} needs its token: open the address that rcilab printed", bool(given))
        return None

    def refuse_socket(self, host: str | None, origin: str | None, cookie: str | None) -> Refusal | None:
        """Returns why a websocket may not be opened, or None when it may; a missing Origin is refused."""
        if origin is None:
            return Refusal("a websocket needs an Origin")
        scheme, _, name = origin.partition("://")
        if scheme not in ("http", "https") or name != host or (self.names and name not in self.names):
            return Refusal(f"origin {origin!r} is not {self.title}")
        given = list(self._tokens_in(cookie))
        if self._is_short_of_token(given):
            return Refusal("the token is missing or wrong", bool(given))
        return None

    @property
    def _cookie_name(self) -> str:
        return f"rcilab_token_{self.port}"

    def _is_short_of_token(self, given: list[str]) -> bool:
        if self.token is None:
            return False
        wanted = self.token.encode()
        return not any([hmac.compare_digest(one.encode(errors="replace"), wanted) for one in given])

    def _tokens_in(self, cookie: str | None) -> Iterator[str]:
        for part in (cookie or "").split(";"):
            name, _, value = part.strip().partition("=")
            if name == self._cookie_name:
                yield unquote(value)


class Guesses:
    """Delays the answer to each wrong token: longer each time, until none was tried for a while.

    Args:
        clock: Returns the time, [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._last, self._delay = float("-inf"), 0.0

    def delay(self) -> float:
        """Returns for how long the answer to a wrong token that has just come is to be held back, [s]."""
        now = self._clock()
        is_first = now - self._last > _FORGOTTEN
        self._last = now
        self._delay = _FIRST_DELAY if is_first else min(2.0 * self._delay, _LONGEST_DELAY)
        return self._delay


def is_loopback(host: str) -> bool:
    """Returns whether only this machine can reach an address, by what it resolves to.

    Raises:
        OSError: It is no address and no name of one.
    """
    found = {info[4][0] for info in socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)}
    return all(ipaddress.ip_address(str(address).partition("%")[0]).is_loopback for address in found)


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host
